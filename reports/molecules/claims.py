"""Claims of the report on molecules: which tolerance is enough, how the change of the energy depends on it, and what it costs."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pandas as pd

from daebench.methods.fixed_step.constraint_structure import RADIUS
from daebench.pages.report.claims import require
from daebench.reports.molecules.hess import check_hess
from daebench.reports.molecules.laws import clear, fit
from daebench.reports.molecules.luck import luck
from daebench.reports.molecules.motions import (
    BUTANE,
    DOUBLE,
    GAUSS_SEIDEL,
    ILVES,
    LINCS,
    MIDDLE,
    MULTIPLIERS,
    NEWTON,
    SETTLE,
    SINGLE,
    SINGLE_TOLERANCES,
    TITLES,
    WATER,
    double,
)
from daebench.reports.molecules.numbers import Numbers

MOST = 1e-3
"""The change of the energy that is wanted at most in 10 ps, in parts of the fluctuation of the kinetic energy."""

ROUND_OFF = 1e-9
"""An exact solver changes the energy by less."""

ROUNDS = 1.0
"""Rounds that a decade of the tolerance takes more, at least, for its cost to be spoken of."""

STEEP = (0.5, 2.5)
"""The exponent of the tolerance is between these for the Gauss-Seidel iteration."""

LEVEL = 0.6
"""A change that goes like a power of the step with a smaller exponent is said to depend on it hardly: 1.5 times for twice the step."""

ERRORS = 2.0
"""The modulus of a mean change is at most the measured one and so many of its standard errors; of a normal mean in 19 cases of 20."""

NANOSECOND = 1e4
"""Units of 0.1 ps in a nanosecond."""


def check(numbers: Numbers) -> SimpleNamespace:
    """Return the numbers of the text; the first sentence that does not hold raises ClaimRefuted."""
    runs = with_rates(numbers)
    enough, laws = asked(runs), check_laws(runs)
    return SimpleNamespace(
        runs=runs,
        asked=enough,
        answer=check_answer(enough),
        radii=check_radii(numbers.molecules),
        laws=laws,
        law_of=by_molecule(laws, GAUSS_SEIDEL),
        two_rounds=by_molecule(laws, ILVES),
        stairs=check_stairs(runs),
        exact=check_exact(runs, numbers.converged),
        solvers=solvers(runs, enough),
        cost=cost(runs, enough),
        missed=missed_in_single(runs),
        floor=floor(runs),
        scatter=scatter(runs),
        tenfold=tenfold(laws),
        lincs=extremes(laws[laws["scheme"] == LINCS]["b"].dropna()),
        loose=extremes(numbers.molecules["loose"]),
        luck=luck(numbers.starts, runs),
        hess=check_hess(runs),
        converged=numbers.converged,
    )


def with_rates(numbers: Numbers) -> pd.DataFrame:
    """Return the runs with the mean change as a rate, kJ/mol per nanosecond and degree of freedom, and the upper limit of its modulus."""
    size = numbers.converged.set_index(["molecule", "h"])["fluctuation"]
    degrees = numbers.molecules.set_index("molecule")["degrees"]
    keys = zip(numbers.runs["molecule"], numbers.runs["h"], strict=True)
    unit = np.array([float(size[key]) / float(degrees[key[0]]) for key in keys])
    limit = numbers.runs["mean"].abs() + ERRORS * numbers.runs["error"]
    return numbers.runs.assign(rate=numbers.runs["mean"] * unit * NANOSECOND / numbers.t_end, limit=limit)


def asked(runs: pd.DataFrame) -> pd.DataFrame:
    """Return, for each molecule and step, the loosest tolerance with which, and with all tighter ones, the change is small enough.

    Small enough is a mean change whose upper limit is at most :data:`MOST`. Columns molecule, scheme, h, tolerance (NaN where none is
    enough), rounds, limit, and fortuitous: looser tolerances with a change as small, though a tighter one has not.
    """
    rows = []
    for (molecule, scheme, h), some in pd.concat([double(runs, GAUSS_SEIDEL), double(runs, ILVES)]).groupby(
        ["molecule", "scheme", "h"], sort=False
    ):
        ordered = some.sort_values("tolerance")
        good = (ordered["limit"] <= MOST).to_numpy()
        first = int(np.argmin(good)) if not good.all() else len(good)
        row: dict[str, Any] = {"molecule": molecule, "scheme": scheme, "h": h, "tolerance": np.nan, "rounds": np.nan, "limit": np.nan}
        if first:
            row |= {name: float(ordered[name].iloc[first - 1]) for name in ("tolerance", "rounds", "limit")}
        rows.append(row | {"fortuitous": [float(x) for x in ordered["tolerance"].to_numpy()[first:][good[first:]]]})
    return pd.DataFrame(rows)


def check_answer(enough: pd.DataFrame) -> SimpleNamespace:
    """Test that some tolerance is enough everywhere; return the tightest that a molecule needs, by the step."""
    require(enough["tolerance"].notna().all(), f"some tolerance keeps the change below {MOST:g} with every step", enough.to_dict("records"))
    least = {scheme: enough[enough["scheme"] == scheme].groupby("h")["tolerance"].min() for scheme in (GAUSS_SEIDEL, ILVES)}
    looser = enough[enough["fortuitous"].map(len) > 0]
    steps: dict[float, list[float]] = {}
    for h in sorted(least[GAUSS_SEIDEL].index):
        steps.setdefault(float(least[GAUSS_SEIDEL][h]), []).append(float(h))
    return SimpleNamespace(
        steps=steps,
        not_run=_steps_left_out(enough),
        usual=float(least[GAUSS_SEIDEL][MIDDLE]),
        newton=float(least[ILVES][MIDDLE]),
        by_molecule=enough[(enough["scheme"] == GAUSS_SEIDEL) & (enough["h"] == MIDDLE)].set_index("molecule")["tolerance"],
        fortuitous=looser,
    )


def _steps_left_out(enough: pd.DataFrame) -> dict[str, list[float]]:
    """Return the steps that some molecule was run with, for each molecule that was not."""
    every = set(enough["h"])
    left = {molecule: sorted(every - set(enough[enough["molecule"] == molecule]["h"])) for molecule in TITLES}
    return {molecule: steps for molecule, steps in left.items() if steps}


def check_radii(molecules: pd.DataFrame) -> pd.DataFrame:
    """Test that LINCS is refused where the spectral radius of its expansion is 1, and only there."""
    refused = molecules["refused"] != ""
    require(
        bool((refused == (molecules["radius"] >= RADIUS)).all()) and int(refused.sum()) == 1,
        "LINCS is refused on the ring alone, where its expansion has no sum",
        molecules[["molecule", "radius", "refused"]].to_dict("records"),
    )
    return molecules


def check_laws(runs: pd.DataFrame) -> pd.DataFrame:
    """Test that the change falls with the tolerance of the Gauss-Seidel iteration; return its laws, and those of ILVES and LINCS."""
    rows = []
    for molecule in TITLES:
        rows.append(
            {"molecule": molecule, "scheme": GAUSS_SEIDEL, "what": "all tolerances"} | vars(fit(_of(double(runs, GAUSS_SEIDEL), molecule)))
        )
        law = rows[-1]
        require(
            STEEP[0] < law["a"] - 2 * law["a_error"] and law["a"] + 2 * law["a_error"] < STEEP[1],
            f"the change on {TITLES[molecule]} falls with a power of the tolerance between {STEEP[0]} and {STEEP[1]}",
            f"{law['a']:.3g} +- {law['a_error']:.2g}",
        )
        require(abs(law["b"]) < LEVEL, f"the change on {TITLES[molecule]} hardly depends on the step", f"h^{law['b']:.2g}")
        same = _of(double(runs, ILVES), molecule)
        rows.append({"molecule": molecule, "scheme": ILVES, "what": "two rounds"} | vars(fit(_two_rounds(same))))
        for (order, iterations), some in _of(double(runs, LINCS), molecule).groupby(["order", "iterations"]):
            rows.append({"molecule": molecule, "scheme": LINCS, "what": f"({order}, {iterations})"} | vars(fit(some)))
    return pd.DataFrame(rows)


def by_molecule(laws: pd.DataFrame, scheme: str) -> dict[str, Any]:
    """Return the law of a scheme on each molecule."""
    return {str(row["molecule"]): row for row in laws[laws["scheme"] == scheme].to_dict("records")}


def _of(rows: pd.DataFrame, molecule: str) -> pd.DataFrame:
    return rows[rows["molecule"] == molecule]


def _two_rounds(rows: pd.DataFrame) -> pd.DataFrame:
    """Return one row a step: a run in which every step took two rounds, whatever its tolerance; without the tolerance."""
    two: pd.DataFrame = rows[(rows["rounds"] - 2).abs() < 0.01]
    return two.drop_duplicates("h").assign(tolerance=np.nan)


def check_stairs(runs: pd.DataFrame) -> SimpleNamespace:
    """Return how many different runs the tolerances of Newton's iteration make on water, where they make the same ones."""
    rows = _of(double(runs, ILVES), WATER)
    counts = rows.groupby("h")["mean"].nunique()
    tolerances = rows["tolerance"].nunique()
    require(bool((counts < tolerances).all()), "several tolerances of Newton's iteration make the same run", counts.to_dict())
    return SimpleNamespace(tolerances=tolerances, least=int(counts.min()), most=int(counts.max()))


def check_exact(runs: pd.DataFrame, converged: pd.DataFrame) -> SimpleNamespace:
    """Test that SETTLE in double precision and RATTLE leave nothing to see on water, and that converged runs do not drift."""
    closed = _of(runs[(runs["precision"] == DOUBLE) & runs["scheme"].isin((SETTLE, NEWTON))], WATER)
    most = float(closed["high"].max())
    require(most < ROUND_OFF, f"SETTLE and RATTLE change the energy of water by less than {ROUND_OFF:g}", most)
    verdicts = converged["verdict"].value_counts()
    require(
        "drifts" not in verdicts, "no run with converged constraints drifts", converged[["molecule", "h", "verdict"]].to_dict("records")
    )
    return SimpleNamespace(most=most, bounded=int((converged["verdict"] == "bounded").sum()), of=len(converged))


def solvers(runs: pd.DataFrame, enough: pd.DataFrame) -> pd.DataFrame:
    """Return every solver on every molecule with the middle step: with the tolerance that is enough there, and its cost."""
    middle = runs[(runs["h"] == MIDDLE) & (runs["velocities"] == MULTIPLIERS)]
    tolerances = enough[enough["h"] == MIDDLE].set_index(["molecule", "scheme"])["tolerance"]

    def chosen(row: Any) -> bool:
        if row["scheme"] == LINCS:
            return (row["order"], row["iterations"]) == (8, 4)
        wanted = tolerances.get((row["molecule"], row["scheme"]), np.nan)
        if row["precision"] == SINGLE and np.isfinite(row["tolerance"]):
            return bool(row["tolerance"] == max(wanted, SINGLE_TOLERANCES[-1]))
        return bool(np.isnan(row["tolerance"]) or row["tolerance"] == wanted)

    some = middle[middle.apply(chosen, axis=1)]
    least = some[some["precision"] == DOUBLE].groupby("molecule")["nanoseconds"].min()
    return some.assign(times=some["nanoseconds"] / some["molecule"].map(least)).reset_index(drop=True)


def cost(runs: pd.DataFrame, enough: pd.DataFrame) -> SimpleNamespace:
    """Return the rounds of a middle step with the tolerance that is enough there on all molecules, and how many more each decade takes."""
    tightest = enough[enough["h"] == MIDDLE].groupby("scheme")["tolerance"].min()
    middle = {scheme: double(runs, scheme)[lambda rows: rows["h"] == MIDDLE] for scheme in (GAUSS_SEIDEL, ILVES)}
    rounds = {scheme: rows[rows["tolerance"] == tightest[scheme]]["rounds"] for scheme, rows in middle.items()}
    of_molecule = middle[GAUSS_SEIDEL].groupby("molecule")
    slopes = [float(np.polyfit(-np.log10(rows["tolerance"]), rows["rounds"], 1)[0]) for _, rows in of_molecule]
    require(min(slopes) > ROUNDS, "each decade of the tolerance takes more rounds", slopes)
    seconds = {scheme: rows[rows["tolerance"] == tightest[scheme]].set_index("molecule")["nanoseconds"] for scheme, rows in middle.items()}
    faster = seconds[GAUSS_SEIDEL] / seconds[ILVES]
    return SimpleNamespace(
        rounds=extremes(rounds[GAUSS_SEIDEL]),
        newton=extremes(rounds[ILVES]),
        faster=extremes(faster),
        decade=float(np.median(slopes)),
    )


def missed_in_single(runs: pd.DataFrame) -> pd.DataFrame:
    """Return the best run of the Gauss-Seidel iteration in single precision, for each molecule on which none is good enough.

    With the middle step, and velocities from multipliers.
    """
    rows = runs[(runs["scheme"] == GAUSS_SEIDEL) & (runs["precision"] == SINGLE) & (runs["velocities"] == MULTIPLIERS)]
    best = rows[rows["h"] == MIDDLE].sort_values("limit").drop_duplicates("molecule")
    return best[best["limit"] > MOST]


def floor(runs: pd.DataFrame) -> float:
    """Return the smallest change of butane that is clear with the iteration of Gauss and Seidel in double precision."""
    return float(clear(_of(double(runs, GAUSS_SEIDEL), BUTANE))["mean"].abs().min())


def scatter(runs: pd.DataFrame) -> Any:
    """Return the row of butane whose tolerance is the tightest and whose step is the largest."""
    return _of(double(runs, GAUSS_SEIDEL), BUTANE).sort_values(["tolerance", "h"], ascending=[True, False]).iloc[0]


def tenfold(laws: pd.DataFrame) -> SimpleNamespace:
    """Return by what a tolerance ten times as tight divides the change, by the laws of the molecules."""
    return extremes(10 ** laws[laws["scheme"] == GAUSS_SEIDEL]["a"])


def extremes(values: Any) -> SimpleNamespace:
    """Return the least and the most of some numbers."""
    return SimpleNamespace(least=float(values.min()), most=float(values.max()))

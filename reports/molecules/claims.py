"""Claims of the report on molecules: which tolerance is enough, how the change of the energy depends on it, and what it costs."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pandas as pd

from daebench.methods.fixed_step.constraint_structure import RADIUS
from daebench.pages.report.claims import require
from daebench.reports.molecules.hess import check_hess
from daebench.reports.molecules.laws import CLEAR, clear, fit
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
    TITLES,
    WATER,
)
from daebench.reports.molecules.numbers import Numbers

MOST = 1e-3
"""The change of the energy that is wanted at most in 10 ps, in parts of the fluctuation of the kinetic energy."""

ROUND_OFF = 1e-9
"""Changes below are no matter of the solver any more."""

STEEP = (0.5, 2.5)
"""The exponent of the tolerance is between these for the Gauss-Seidel iteration."""

LEVEL = 0.6
"""A change that goes like a power of the step with a smaller exponent is said to depend on it hardly: 1.5 times for twice the step."""

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
        price=price(runs, enough),
        floor=floor(runs),
        luck=luck(numbers.starts, runs),
        hess=check_hess(runs),
        converged=numbers.converged,
    )


def with_rates(numbers: Numbers) -> pd.DataFrame:
    """Return the runs with the mean change as a rate, kJ/mol per nanosecond and degree of freedom."""
    size = numbers.converged.set_index(["molecule", "h"])["fluctuation"]
    degrees = numbers.molecules.set_index("molecule")["degrees"]
    keys = zip(numbers.runs["molecule"], numbers.runs["h"], strict=True)
    unit = np.array([float(size[key]) / float(degrees[key[0]]) for key in keys])
    return numbers.runs.assign(rate=numbers.runs["mean"] * unit * NANOSECOND / numbers.t_end)


def double(runs: pd.DataFrame, scheme: str) -> pd.DataFrame:
    """Return the runs of a scheme in double precision."""
    return runs[(runs["scheme"] == scheme) & (runs["precision"] == DOUBLE)]


def asked(runs: pd.DataFrame) -> pd.DataFrame:
    """Return, for each molecule and step, the loosest tolerance with which, and with all tighter ones, the change is small enough.

    Small enough is a change of at most :data:`MOST` from nineteen starts in twenty. Columns molecule, scheme, h, tolerance (NaN where none
    is enough), rounds, high, and fortuitous: looser tolerances with a change as small, though a tighter one has not.
    """
    rows = []
    for (molecule, scheme, h), some in pd.concat([double(runs, GAUSS_SEIDEL), double(runs, ILVES)]).groupby(
        ["molecule", "scheme", "h"], sort=False
    ):
        ordered = some.sort_values("tolerance")
        good = (ordered["high"] <= MOST).to_numpy()
        first = int(np.argmin(good)) if not good.all() else len(good)
        row: dict[str, Any] = {"molecule": molecule, "scheme": scheme, "h": h, "tolerance": np.nan, "rounds": np.nan, "high": np.nan}
        if first:
            row |= {name: float(ordered[name].iloc[first - 1]) for name in ("tolerance", "rounds", "high")}
        rows.append(row | {"fortuitous": [float(x) for x in ordered["tolerance"].to_numpy()[first:][good[first:]]]})
    return pd.DataFrame(rows)


def check_answer(enough: pd.DataFrame) -> SimpleNamespace:
    """Test that some tolerance is enough everywhere; return the tightest that has to be asked for, of each scheme and molecule."""
    require(enough["tolerance"].notna().all(), f"some tolerance keeps the change below {MOST:g} with every step", enough.to_dict("records"))
    least = {str(scheme): some.groupby("molecule")["tolerance"].min().reindex(list(TITLES)) for scheme, some in enough.groupby("scheme")}
    by_hand, newton = least[GAUSS_SEIDEL], least[ILVES]
    looser = enough[enough["fortuitous"].map(len) > 0]
    return SimpleNamespace(gauss_seidel=by_hand, ilves=newton, tightest=float(by_hand.min()), newton=float(newton.min()), fortuitous=looser)


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
    """Return every solver on every molecule with the middle step: with the tolerance that is enough there, and its price."""
    middle = runs[(runs["h"] == MIDDLE) & (runs["velocities"] == MULTIPLIERS)]
    tolerances = enough[enough["h"] == MIDDLE].set_index(["molecule", "scheme"])["tolerance"]

    def chosen(row: Any) -> bool:
        if row["scheme"] == LINCS:
            return (row["order"], row["iterations"]) == (8, 4)
        wanted = tolerances.get((row["molecule"], row["scheme"]), np.nan)
        if row["precision"] == SINGLE and np.isfinite(row["tolerance"]):
            return bool(row["tolerance"] == max(wanted, SINGLE_FINEST)) or row["scheme"] == ILVES
        return bool(np.isnan(row["tolerance"]) or row["tolerance"] == wanted)

    some = middle[middle.apply(chosen, axis=1)]
    least = some[some["precision"] == DOUBLE].groupby("molecule")["nanoseconds"].min()
    return some.assign(times=some["nanoseconds"] / some["molecule"].map(least)).reset_index(drop=True)


def price(runs: pd.DataFrame, enough: pd.DataFrame) -> SimpleNamespace:
    """Return the rounds of a step with the tolerance that is enough everywhere, and how many more each decade takes."""
    tightest = enough.groupby("scheme")["tolerance"].min()
    middle = {scheme: double(runs, scheme)[lambda rows: rows["h"] == MIDDLE] for scheme in (GAUSS_SEIDEL, ILVES)}
    rounds = {scheme: rows[rows["tolerance"] == tightest[scheme]]["rounds"] for scheme, rows in middle.items()}
    of_molecule = middle[GAUSS_SEIDEL].groupby("molecule")
    slopes = [float(np.polyfit(-np.log10(rows["tolerance"]), rows["rounds"], 1)[0]) for _, rows in of_molecule]
    require(min(slopes) > 0, "each decade of the tolerance takes more rounds", slopes)
    return SimpleNamespace(
        least=float(rounds[GAUSS_SEIDEL].min()),
        most=float(rounds[GAUSS_SEIDEL].max()),
        newton_least=float(rounds[ILVES].min()),
        newton_most=float(rounds[ILVES].max()),
        decade=float(np.median(slopes)),
    )


def floor(runs: pd.DataFrame) -> float:
    """Return the smallest change of butane that is clear with the iteration of Gauss and Seidel in double precision."""
    return float(clear(_of(double(runs, GAUSS_SEIDEL), BUTANE))["mean"].abs().min())


SINGLE_FINEST = 1e-6
"""The tightest tolerance of runs in single precision."""


def luck(starts: pd.DataFrame, runs: pd.DataFrame) -> SimpleNamespace:
    """Return from how many starts a looser tolerance changes the energy less than the next tighter one, whose change is clear.

    Of the Gauss-Seidel iteration in double precision; ``worst`` is the pair of tolerances in which that is most frequent.
    """
    keys = ["molecule", "h", "tolerance"]
    chosen = clear(double(runs, GAUSS_SEIDEL))
    sizes = (
        double(starts, GAUSS_SEIDEL)
        .assign(size=lambda rows: rows["change"].abs())
        .pivot(index=[*keys[:2], "start"], columns="tolerance", values="size")
    )
    tolerances = sorted(sizes.columns, reverse=True)
    rows = []
    for molecule, h, tight in chosen[keys].itertuples(index=False):
        k = tolerances.index(tight)
        if k:
            pair = sizes.loc[(molecule, h)][[tolerances[k - 1], tight]].dropna()
            rows.append(
                {
                    "molecule": molecule,
                    "h": h,
                    "loose": tolerances[k - 1],
                    "tight": tight,
                    "part": float(np.mean(pair.iloc[:, 0] < pair.iloc[:, 1])),
                }
            )
    table = pd.DataFrame(rows)
    worst = table.iloc[int(table["part"].to_numpy().argmax())]
    indexed = double(runs, GAUSS_SEIDEL).set_index(keys)
    loose, tight = (indexed.loc[(worst["molecule"], worst["h"], worst[which])] for which in ("loose", "tight"))
    early = loose["mean"] - loose["slope"]
    cancels = early < -CLEAR * loose["error"] and loose["slope"] > CLEAR * loose["slope_error"]
    return SimpleNamespace(
        pairs=len(table),
        some=int((table["part"] > 0).sum()),
        worst=worst,
        loose=loose,
        tight=tight,
        worst_ordered=abs(loose["mean"]) > abs(tight["mean"]),
        cancels=bool(cancels),
    )

"""Laws of the report on molecules: powers of the tolerance and of the step, fitted to changes that are clear of their own scatter."""

from dataclasses import dataclass
from types import SimpleNamespace
from typing import Any

import numpy as np
import pandas as pd

from daebench.pages.report.claims import require
from daebench.pages.report.tables import part
from daebench.reports.molecules.motions import GAUSS_SEIDEL, ILVES, LINCS, TITLES, WATER, double

CLEAR = 4.0
"""A change is clear where its mean over the starts is more than so many of its standard errors."""

LOST = 1.0
"""From this change on, in standard deviations of the kinetic energy, a motion is another one and no law is looked for."""

FEWEST = 3
"""Fewest clear changes of a fit."""

NAN = float("nan")


@dataclass(frozen=True)
class Law:
    """A law |mean change| = c tolerance^a h^b."""

    a: float
    a_error: float
    b: float
    b_error: float
    """Exponents and their standard errors; NaN where too few changes are clear, or all have the same tolerance or the same step."""
    points: int
    """Changes that were used."""
    tightest: float
    """The tightest tolerance among them."""


def clear(rows: pd.DataFrame) -> pd.DataFrame:
    """Return the rows whose mean is clear of its standard error, and whose motion is not lost."""
    moduli = rows["mean"].abs()
    return rows[(moduli > CLEAR * rows["error"]) & (moduli < LOST)]


def fit(rows: pd.DataFrame) -> Law:
    """Return the least-squares law of the logarithms, with the standard errors that the scatter about it gives."""
    used = clear(rows)
    tolerances = np.log(used["tolerance"].to_numpy(dtype=float))
    columns = {"a": tolerances, "b": np.log(used["h"].to_numpy(dtype=float))}
    varied = {name: x for name, x in columns.items() if len(np.unique(x[np.isfinite(x)])) > 1}
    tightest = float(used["tolerance"].min()) if len(used) else NAN
    if len(used) < FEWEST or not varied or len(used) <= len(varied) + 1:
        return Law(NAN, NAN, NAN, NAN, len(used), tightest)
    A = np.stack([np.ones(len(used)), *varied.values()], axis=1)
    y = np.log(used["mean"].abs().to_numpy())
    x, *_ = np.linalg.lstsq(A, y, rcond=None)
    variance = float(np.sum((y - A @ x) ** 2)) / (len(y) - len(x))
    errors = np.sqrt(variance * np.diag(np.linalg.inv(A.T @ A)))
    exponents = {name: (float(x[k]), float(errors[k])) for k, name in enumerate(varied, start=1)}
    (a, a_error), (b, b_error) = (exponents.get(name, (NAN, NAN)) for name in "ab")
    return Law(a, a_error, b, b_error, len(used), tightest)


KEYS = ["molecule", "h", "tolerance"]


def luck(starts: pd.DataFrame, runs: pd.DataFrame) -> SimpleNamespace:
    """Return from how many starts a looser tolerance changes the energy less than the next tighter one, whose change is clear.

    Of the Gauss-Seidel iteration in double precision; ``worst`` is the pair of tolerances in which that is most frequent.
    """
    table = pairs(double(starts, GAUSS_SEIDEL), clear(double(runs, GAUSS_SEIDEL)))
    worst = table.iloc[int(table["part"].to_numpy().argmax())]
    rows = double(runs, GAUSS_SEIDEL)
    rows = part(rows, molecule=worst["molecule"], h=worst["h"])
    loose, tight = (rows[rows["tolerance"] == worst[which]].iloc[0] for which in ("loose", "tight"))
    early = loose["mean"] - loose["slope"]
    cancels = early < -CLEAR * loose["error"] and loose["slope"] > CLEAR * loose["slope_error"]
    return SimpleNamespace(
        pairs=len(table),
        some=(table["part"] > 0).sum(),
        worst=worst,
        loose=loose,
        tight=tight,
        worst_ordered=abs(loose["mean"]) > abs(tight["mean"]),
        cancels=cancels,
    )


def pairs(starts: pd.DataFrame, chosen: pd.DataFrame) -> pd.DataFrame:
    """Return each pair of neighbouring tolerances, and the fraction of the starts from which the looser one changes the energy less."""
    sizes = starts.assign(size=starts["change"].abs()).pivot(index=[*KEYS[:2], "start"], columns="tolerance", values="size")
    tolerances = sorted(sizes.columns, reverse=True)
    rows = []
    for molecule, h, tight in chosen[KEYS].itertuples(index=False):
        k = tolerances.index(tight)
        if k:
            pair = sizes.loc[(molecule, h)][[tolerances[k - 1], tight]].dropna()
            part = float(np.mean(pair.iloc[:, 0] < pair.iloc[:, 1]))
            rows.append({"molecule": molecule, "h": h, "loose": tolerances[k - 1], "tight": tight, "part": part})
    return pd.DataFrame(rows)


STEEP = (0.5, 2.5)
"""The exponent of the tolerance is between these for the Gauss-Seidel iteration."""


LEVEL = 0.6
"""A change that goes like a power of the step with a smaller exponent is said to depend on it hardly: 1.5 times for twice the step."""


def check_laws(runs: pd.DataFrame) -> pd.DataFrame:
    """Test that the change falls with the tolerance of the Gauss-Seidel iteration; return its laws, and those of ILVES and LINCS."""
    rows = []
    for molecule in TITLES:
        rows.append(
            {"molecule": molecule, "scheme": GAUSS_SEIDEL, "what": "all tolerances"}
            | vars(fit(part(double(runs, GAUSS_SEIDEL), molecule=molecule)))
        )
        law = rows[-1]
        require(
            STEEP[0] < law["a"] - 2 * law["a_error"] and law["a"] + 2 * law["a_error"] < STEEP[1],
            f"the change on {TITLES[molecule]} falls with a power of the tolerance between {STEEP[0]} and {STEEP[1]}",
            f"{law['a']:.3g} +- {law['a_error']:.2g}",
        )
        require(abs(law["b"]) < LEVEL, f"the change on {TITLES[molecule]} hardly depends on the step", f"h^{law['b']:.2g}")
        same = part(double(runs, ILVES), molecule=molecule)
        rows.append({"molecule": molecule, "scheme": ILVES, "what": "two rounds"} | vars(fit(_two_rounds(same))))
        for (order, iterations), some in part(double(runs, LINCS), molecule=molecule).groupby(["order", "iterations"]):
            rows.append({"molecule": molecule, "scheme": LINCS, "what": f"({order}, {iterations})"} | vars(fit(some)))
    return pd.DataFrame(rows)


def by_molecule(laws: pd.DataFrame, scheme: str) -> dict[str, Any]:
    """Return the law of a scheme on each molecule."""
    return {str(row["molecule"]): row for row in laws[laws["scheme"] == scheme].to_dict("records")}


def _two_rounds(rows: pd.DataFrame) -> pd.DataFrame:
    """Return one row a step: a run in which every step took two rounds, whatever its tolerance; without the tolerance."""
    two: pd.DataFrame = rows[(rows["rounds"] - 2).abs() < 0.01]
    return two.drop_duplicates("h").assign(tolerance=np.nan)


def check_stairs(runs: pd.DataFrame) -> SimpleNamespace:
    """Return how many different runs the tolerances of Newton's iteration make on water, where they make the same ones."""
    rows = part(double(runs, ILVES), molecule=WATER)
    counts = rows.groupby("h")["mean"].nunique()
    tolerances = rows["tolerance"].nunique()
    require((counts < tolerances).all(), "several tolerances of Newton's iteration make the same run", counts.to_dict())
    return SimpleNamespace(tolerances=tolerances, least=counts.min(), most=counts.max())


def tenfold(laws: pd.DataFrame) -> SimpleNamespace:
    """Return the factor by which a tolerance ten times as tight reduces the change, by the laws of the molecules."""
    return extremes(10 ** laws[laws["scheme"] == GAUSS_SEIDEL]["a"])


def extremes(values: Any) -> SimpleNamespace:
    """Return the least and the most of some numbers."""
    return SimpleNamespace(least=values.min(), most=values.max())

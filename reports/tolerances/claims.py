"""Claims of the report on tolerances, tested on the numbers before they are printed."""

from collections.abc import Mapping
from types import SimpleNamespace
from typing import Any

import numpy as np
import pandas as pd

from daebench.pages.report.claims import require
from daebench.reports.tolerances.drift import QUANTITIES, TOL
from daebench.reports.tolerances.numbers import Numbers
from daebench.reports.tolerances.runs import FAST, FORMULATIONS, IVPS, REACHED
from daebench.reports.tolerances.tables import WANTED, to_ask
from daebench.reports.tolerances.treatment_claims import check_treatments

TIGHT = 1e-12
"""The tolerance that people take for safe."""

CLOSE = 2.0
"""An estimate is close if it is within this factor of the true error, either way."""

SMALL = 0.1
"""Errors from this on, in lengths of a rod, are of the size of the motion: nothing is estimated there."""

EXPONENTS: Mapping[str, Mapping[str, float]] = {
    "index1": {"g": 2, "energy": 2, "error": 3},
    "index2": {"g": 1, "energy": 1, "error": 2},
    "ggl": {"energy": 1, "error": 2},
    "index3": {"energy": 1, "error": 2},
}
"""Powers of time that the text explains."""

BAND = 0.5
"""A fitted exponent agrees with a whole number within this."""

BOUNDED = 0.5
"""Growth with an exponent below this is said to be slow."""


def check(numbers: Numbers) -> SimpleNamespace:
    """Return the numbers of the text; the first sentence that does not hold raises ClaimRefuted."""
    runs = numbers.runs.assign(scene=numbers.runs["problem"] + "-" + numbers.runs["case"])
    done = runs[runs["default"] & (runs["end"] == REACHED)]
    return SimpleNamespace(
        headline=check_headline(runs[runs["default"]], done),
        tight=check_tight(done[done["tol"] == TIGHT]),
        floor=check_floor(done),
        slopes=slopes(done),
        last=last_decade(done),
        treatments=check_treatments(runs),
        cost=check_cost(runs[runs["default"]]),
        estimate=check_estimate(done),
        laws=check_laws(numbers.laws),
    )


def check_headline(default: pd.DataFrame, done: pd.DataFrame) -> SimpleNamespace:
    """Test that no run is as accurate as it was asked to be; return how far it is."""
    beyond = int(np.sum(done["error"] > done["tol"]))
    require(beyond == len(done), "every position error is larger than its tolerance", f"{beyond} of {len(done)}")
    ratio = done["error"] / done["tol"]
    useless = done[done["error"] > 1]
    return SimpleNamespace(
        runs=len(default),
        done=len(done),
        failed=default[default["end"] != REACHED],
        least=ratio.min(),
        median=float(f"{ratio.median():.2g}"),
        useless=useless,
    )


def check_tight(rows: pd.DataFrame) -> SimpleNamespace:
    """Test what is said of the tolerance 1e-12, problem by problem."""
    errors = rows.pivot(index="scene", columns="formulation", values="error").reindex(list(IVPS))
    require(errors.notna().all().all(), "every formulation gets to the end at 1e-12", errors.to_dict())
    require(errors.min().min() > 10 * TIGHT, "at 1e-12 every error is over ten times that", errors.min().min())
    best, worst = errors.idxmin(axis=1), errors.idxmax(axis=1)
    require((worst == "index3").all(), "index 3 is the least accurate at 1e-12", worst.to_dict())
    require(best.isin(["index2", "ggl"]).all(), "index 2 or GGL is the most accurate at 1e-12", best.to_dict())
    fast = rows[rows["scene"] == FAST].set_index("formulation")
    off = fast["g"]
    require(off["index1"] > 100 * off["index3"], "index 3 stays on the constraint a hundred times closer than index 1", off.to_dict())
    require(
        cell(errors, FAST, "index3") > cell(errors, FAST, "index1"), "index 3 is nevertheless less accurate", errors.loc[FAST].to_dict()
    )
    low, high = errors.min(axis=1), errors.max(axis=1)
    apart = (errors["index3"] / errors[["index2", "ggl"]].min(axis=1)).rename("ratio")
    return SimpleNamespace(errors=errors, best=low.min(), best_worst=low.max(), worst=high.max(), worst_best=high.min(), g=off, apart=apart)


def check_floor(done: pd.DataFrame) -> SimpleNamespace:
    """Test that no error is smaller than what it is taken against can tell."""
    clear = float((done["error"] / done["floor"]).min())
    require(clear > 10, "every error is over ten times what its reference may be wrong by", f"{clear:.3g}")
    growth = done.groupby("scene")["amplification"].max().reindex(list(IVPS)).rename(IVPS).sort_values()
    return SimpleNamespace(
        largest=done["floor"].max(), clear=clear, least_growth=growth.iloc[0], most_growth=growth.iloc[-1], growth=growth
    )


def slopes(done: pd.DataFrame) -> pd.DataFrame:
    """Test that errors fall more slowly than tolerances; return, by formulation, the least and the largest power over the problems."""
    small = done[done["error"] < SMALL]
    rows = []
    for (formulation, ivp), group in small.groupby(["formulation", "scene"]):
        power = np.polyfit(np.log(group["tol"]), np.log(group["error"]), 1)[0]
        rows.append({"formulation": formulation, "scene": ivp, "power": power})
    power_ranges: pd.DataFrame = pd.DataFrame(rows).groupby("formulation")["power"].agg(["min", "max"])
    require(power_ranges["max"].max() < 1, "the error falls more slowly than the tolerance everywhere", power_ranges["max"].to_dict())
    return power_ranges


def last_decade(done: pd.DataFrame) -> pd.DataFrame:
    """Return the runs at the tightest tolerance with what they cost, and reach, of those one decade before."""
    columns = ["residuals", "error"]
    tols = sorted(done["tol"].unique())
    end, before = (done[done["tol"] == tol].set_index(["scene", "formulation"])[columns] for tol in tols[:2])
    ratio = (end / before).dropna().reset_index()
    ordered: pd.DataFrame = ratio.sort_values("residuals", ascending=False)
    return ordered


def check_cost(default: pd.DataFrame) -> SimpleNamespace:
    """Test that index 3 is the dearest way to a given accuracy; return by how much, and where it does not get there."""
    calls = {key: calls_for(rows, WANTED) for key, rows in default.groupby(["scene", "formulation"])}
    table = pd.Series(calls).unstack().reindex(list(IVPS))
    require(table.drop(columns="index3").notna().all().all(), f"all but index 3 reach {WANTED:g} m on every system", table.to_dict())
    ratio = table["index3"] / table.min(axis=1)
    dearest = (table["index3"] >= table.max(axis=1)) | table["index3"].isna()
    require(dearest.all(), f"index 3 is the dearest way to {WANTED:g} m on every system", table.to_dict())
    never = [IVPS[str(ivp)] for ivp in ratio.index[ratio.isna()]]
    return SimpleNamespace(least=ratio.min(), most=ratio.max(), never=never)


def calls_for(rows: pd.DataFrame, wanted: float) -> float:
    """Return the residual calls of the run with the loosest tolerance that is to be asked for an accuracy, NaN if there is none."""
    calls = rows["residuals"][rows["tol"] == to_ask(rows, wanted)]
    return float(calls.iloc[0]) if len(calls) else float("nan")


def check_estimate(done: pd.DataFrame) -> SimpleNamespace:
    """Test that the difference from the run at a tenth of the tolerance tells the error."""
    rows = done[done["estimate"].notna() & (done["error"] < SMALL)]
    ratio = rows["estimate"] / rows["error"]
    close = int(np.sum((ratio > 1 / CLOSE) & (ratio < CLOSE)))
    require(close > 0.9 * len(ratio), "the estimate is within a factor of two in nine cases of ten", f"{close} of {len(ratio)}")
    low = rows.loc[ratio == ratio.min()].iloc[0]
    return SimpleNamespace(n=len(ratio), close=close, least=ratio.min(), most=ratio.max(), median=ratio.median(), low=low)


def check_laws(laws: pd.DataFrame) -> SimpleNamespace:
    """Test the powers of time."""
    main = laws[laws["tol"] == TOL]
    for formulation, expected in EXPONENTS.items():
        for quantity, power in expected.items():
            fitted_power = exponent(main, formulation, quantity)
            require(abs(fitted_power - power) < BAND, f"{quantity} of {formulation} grows like t^{power}", f"{fitted_power:.3f}")
    for formulation in ("ggl", "index3"):
        fitted_power = exponent(main, formulation, "g")
        require(fitted_power < BOUNDED, f"g of {formulation} hardly grows", f"{fitted_power:.3f}")
    return SimpleNamespace(main={f: {q: law_of(main, f, q) for q in QUANTITIES} for f in FORMULATIONS})


def law_of(laws: pd.DataFrame, formulation: str, quantity: str) -> Any:
    """Return the row of a law among those of one tolerance."""
    return laws[(laws["formulation"] == formulation) & (laws["quantity"] == quantity)].iloc[0]


def exponent(laws: pd.DataFrame, formulation: str, quantity: str) -> float:
    """Return the exponent of a law."""
    return float(law_of(laws, formulation, quantity)["exponent"])


def cell(frame: pd.DataFrame, row: str, column: str) -> float:
    """Return one number of a table."""
    value: Any = frame.loc[row, column]
    return float(value)

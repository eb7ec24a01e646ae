"""Claims of the report on tolerances, tested on the numbers before they are printed."""

from collections.abc import Mapping
from types import SimpleNamespace
from typing import Any

import numpy as np
import pandas as pd

from daebench.pages.report.claims import require
from daebench.reports.tolerances.bands import typical
from daebench.reports.tolerances.drift import QUANTITIES, TOL
from daebench.reports.tolerances.numbers import Numbers
from daebench.reports.tolerances.projection_claims import check_example, check_projected
from daebench.reports.tolerances.runs import FAST, FORMULATIONS, IVPS, REACHED
from daebench.reports.tolerances.tables import WANTED, to_ask
from daebench.reports.tolerances.treatment_claims import check_treatments

TIGHT = 1e-12
"""A tolerance that is usually considered safe."""

CLOSE = 2.0
"""An estimate is close if it is within this factor of the true error, either way."""

SMALL = 0.1
"""Errors from this on, in lengths of a rod, are of the size of the motion: such errors are not estimated."""

EXPONENTS: Mapping[str, Mapping[str, float]] = {
    "index1": {"g": 2, "energy": 2, "error": 3},
    "index2": {"g": 1, "energy": 1, "error": 2},
    "ggl": {"energy": 1, "error": 2},
    "index3": {"energy": 1, "error": 2},
}
"""Powers of time that the text explains."""

MOST = 0.9
"""Fraction of the starts that counts as most."""

BAND = 0.5
"""Tolerance for the agreement of a fitted exponent with a whole number."""

BOUNDED = 0.5
"""Growth with an exponent below this is called slow."""


def check(numbers: Numbers) -> SimpleNamespace:
    """Return the numbers of the text; the first sentence that does not hold raises ClaimRefuted."""
    default = numbers.runs[numbers.runs["default"]]
    done, bands = default[default["end"] == REACHED], typical(default)
    return SimpleNamespace(
        headline=check_headline(default, done),
        tight=check_tight(done[done["tol"] == TIGHT], bands[bands["tol"] == TIGHT]),
        luck=luck(done, bands),
        floor=check_floor(done),
        slopes=slopes(bands),
        last=last_decade(bands),
        treatments=check_treatments(numbers.runs[numbers.runs["start"] == 0]),
        cost=check_cost(bands),
        estimate=check_estimate(done),
        laws=check_laws(numbers.laws),
        projected=check_projected(numbers.projected),
        example=check_example(numbers.example),
    )


def check_headline(default: pd.DataFrame, done: pd.DataFrame) -> SimpleNamespace:
    """Test that the error of each run exceeds its tolerance; return by what factors."""
    beyond = int(np.sum(done["error"] > done["tol"]))
    require(beyond == len(done), "every position error is larger than its tolerance", f"{beyond} of {len(done)}")
    ratio = done["error"] / done["tol"]
    return SimpleNamespace(
        runs=len(default),
        done=len(done),
        starts=default["start"].nunique(),
        failed=default[default["end"] != REACHED],
        least=ratio.min(),
        median=float(f"{ratio.median():.2g}"),
        useless=done[done["error"] > 1],
    )


def check_tight(rows: pd.DataFrame, bands: pd.DataFrame) -> SimpleNamespace:
    """Test the statements about the tolerance 1e-12, problem by problem and start by start."""
    errors = bands.pivot(index="scene", columns="formulation", values="error").reindex(list(IVPS))
    require((bands["done"] == 1).all(), "every formulation reaches the end at 1e-12 from every start", bands["done"].min())
    require(errors.min().min() > 10 * TIGHT, "at 1e-12 every median error is over ten times that", errors.min().min())
    each = rows.pivot(index=["scene", "start"], columns="formulation", values="error")
    worst = float(np.mean(each.idxmax(axis=1) == "index3"))
    best = float(np.mean(each.idxmin(axis=1).isin(["index2", "ggl"])))
    require(worst > MOST, "index 3 is the least accurate at 1e-12 from most starts", worst)
    require(best > MOST, "index 2 or GGL is the most accurate at 1e-12 from most starts", best)
    require((errors.idxmax(axis=1) == "index3").all(), "index 3 is the least accurate in the median", errors.idxmax(axis=1).to_dict())
    require(errors.idxmin(axis=1).isin(["index2", "ggl"]).all(), "index 2 or GGL is the most accurate in the median", errors.to_dict())
    off = rows[rows["scene"] == FAST].groupby("formulation")["g"].median()
    require(off["index1"] > 100 * off["index3"], "index 3 stays on the constraint a hundred times closer than index 1", off.to_dict())
    require(
        cell(errors, FAST, "index3") > cell(errors, FAST, "index1"), "index 3 is nevertheless less accurate", errors.loc[FAST].to_dict()
    )
    low, high = errors.min(axis=1), errors.max(axis=1)
    return SimpleNamespace(
        errors=errors,
        best=low.min(),
        best_worst=low.max(),
        worst=high.max(),
        worst_best=high.min(),
        g=off,
        share_worst=worst,
        share_best=best,
    )


def luck(done: pd.DataFrame, bands: pd.DataFrame) -> SimpleNamespace:
    """Return the spread of errors over the starts, and the ratio of the error from the case's start to the median."""
    spread = (bands["high"] / bands["low"])[bands["done"] == 1]
    keys = ["scene", "formulation", "tol"]
    one = done[done["start"] == 0].set_index(keys)["error"] / bands.set_index(keys)["error"]
    one = one.dropna()
    factor = np.exp(np.abs(np.log(one)))
    return SimpleNamespace(median=spread.median(), most=spread.max(), factor=factor.max(), astray=float(np.mean(factor > 2)))


def check_floor(done: pd.DataFrame) -> SimpleNamespace:
    """Test that no error is below the resolution of its reference."""
    clear = float((done["error"] / done["floor"]).min())
    require(clear > 10, "every error is over ten times the error bound of its reference", f"{clear:.3g}")
    growth = done[done["start"] == 0].groupby("scene")["amplification"].max().reindex(list(IVPS)).rename(IVPS).sort_values()
    return SimpleNamespace(
        largest=done["floor"][done["start"] == 0].max(),
        beside=done["floor"].max(),
        clear=clear,
        least_growth=growth.iloc[0],
        most_growth=growth.iloc[-1],
        growth=growth,
    )


def slopes(bands: pd.DataFrame) -> pd.DataFrame:
    """Test that errors fall more slowly than tolerances; return, by formulation, the least and the largest power over the problems."""
    small = bands[bands["error"] < SMALL]
    rows = []
    for (formulation, ivp), group in small.groupby(["formulation", "scene"]):
        power = np.polyfit(np.log(group["tol"]), np.log(group["error"]), 1)[0]
        rows.append({"formulation": formulation, "scene": ivp, "power": power})
    power_ranges: pd.DataFrame = pd.DataFrame(rows).groupby("formulation")["power"].agg(["min", "max"])
    require(power_ranges["max"].max() < 1, "the error falls more slowly than the tolerance everywhere", power_ranges["max"].to_dict())
    return power_ranges


def last_decade(bands: pd.DataFrame) -> pd.DataFrame:
    """Return cost and error of the tightest tolerance relative to one decade before; medians over the starts."""
    columns = ["residuals", "error"]
    tols = sorted(bands["tol"].unique())
    end, before = (bands[bands["tol"] == tol].set_index(["scene", "formulation"])[columns] for tol in tols[:2])
    ratio = (end / before).dropna().reset_index()
    ordered: pd.DataFrame = ratio.sort_values("residuals", ascending=False)
    return ordered


def check_cost(bands: pd.DataFrame) -> SimpleNamespace:
    """Test that index 3 is the most expensive way to a given accuracy; return by what factor, and where it does not reach it."""
    calls = {key: calls_for(rows, WANTED) for key, rows in bands.groupby(["scene", "formulation"])}
    table = pd.Series(calls).unstack().reindex(list(IVPS))
    require(table.drop(columns="index3").notna().all().all(), f"all but index 3 reach {WANTED:g} m on every system", table.to_dict())
    ratio = table["index3"] / table.min(axis=1)
    dearest = (table["index3"] >= table.max(axis=1)) | table["index3"].isna()
    require(dearest.all(), f"index 3 is the most expensive way to {WANTED:g} m on every system", table.to_dict())
    never = [IVPS[str(ivp)] for ivp in ratio.index[ratio.isna()]]
    return SimpleNamespace(least=ratio.min(), most=ratio.max(), never=never)


def calls_for(rows: pd.DataFrame, wanted: float) -> float:
    """Return the residual calls of the run with the loosest tolerance that reaches an accuracy, NaN if there is none."""
    calls = rows["residuals"][rows["tol"] == to_ask(rows, wanted)]
    return float(calls.iloc[0]) if len(calls) else float("nan")


def check_estimate(done: pd.DataFrame) -> SimpleNamespace:
    """Test that the difference from the run at a tenth of the tolerance estimates the error."""
    rows = done[done["estimate"].notna() & (done["error"] < SMALL)]
    ratio = rows["estimate"] / rows["error"]
    close = int(np.sum((ratio > 1 / CLOSE) & (ratio < CLOSE)))
    require(close > 0.9 * len(ratio), "the estimate is within a factor of two in nine cases of ten", f"{close} of {len(ratio)}")
    low, high = ratio.quantile(0.01), ratio.quantile(0.99)
    return SimpleNamespace(n=len(ratio), close=close, low=low, high=high, least=ratio.min(), most=ratio.max(), median=ratio.median())


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
    """Return the row of a law from the rows of one tolerance."""
    return laws[(laws["formulation"] == formulation) & (laws["quantity"] == quantity)].iloc[0]


def exponent(laws: pd.DataFrame, formulation: str, quantity: str) -> float:
    """Return the exponent of a law."""
    return float(law_of(laws, formulation, quantity)["exponent"])


def cell(frame: pd.DataFrame, row: str, column: str) -> float:
    """Return one number of a table."""
    value: Any = frame.loc[row, column]
    return float(value)

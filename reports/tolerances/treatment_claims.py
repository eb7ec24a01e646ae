"""Claims of the report on tolerances about the treatment of multipliers, tested on the numbers."""

from types import SimpleNamespace

import numpy as np
import pandas as pd

from daebench.pages.report.claims import require
from daebench.reports.tolerances.runs import FAST, FORMULATIONS, REACHED, STOPPED


def check_treatments(runs: pd.DataFrame) -> SimpleNamespace:
    """Test where the treatments are needed, where they work and which one is more accurate."""

    def share(formulation: str, treatment: str) -> float:
        ends = runs["end"][(runs["formulation"] == formulation) & (runs["cure"] == treatment)]
        return float(np.mean(ends == REACHED))

    for formulation in ("index2", "ggl"):
        for treatment in ("derivative", "atol"):
            require(
                share(formulation, treatment) == 1, f"{formulation} with {treatment} always reaches the end", share(formulation, treatment)
            )
    for formulation, treatment in (("index3", "none"), ("index3", "derivative"), ("index2", "none"), ("ggl", "none")):
        require(share(formulation, treatment) < 0.5, f"{formulation} with {treatment} fails in most runs", share(formulation, treatment))
    fast = runs[(runs["scene"] == FAST) & (runs["cure"] == "none")]
    at_start = fast[(fast["formulation"] == "index3") & (fast["t_reached"] == 0)]
    tried = int(np.sum(fast["formulation"] == "index3"))
    require(len(at_start) == tried, "plain index 3 on the fast pendulum stops at t = 0 at every tolerance", f"{len(at_start)} of {tried}")
    through = fast[(fast["formulation"] == "index1") & (fast["end"] == REACHED)]
    dearer = _against(through, runs[(runs["scene"] == FAST) & runs["default"]], "residuals")
    gain = {formulation: _gain(runs, formulation, "derivative") for formulation in ("index2", "index1", "ggl")}
    require(gain["index2"] > 1, "derivatives are the more accurate treatment of index 2", f"{gain['index2']:.3g}")
    require(gain["ggl"] > 1, "derivatives are the more accurate treatment of GGL", f"{gain['ggl']:.3g}")
    require(gain["index1"] < 1, "the absolute tolerance is the more accurate treatment of index 1", f"{gain['index1']:.3g}")
    stopped_runs = runs[runs["end"].isin(STOPPED)]
    return SimpleNamespace(
        runs=len(runs),
        stopped=len(stopped_runs),
        ours=int(np.sum(runs["end"] != REACHED)) - len(stopped_runs),
        at_start=len(at_start),
        through=len(through),
        dearer=float(dearer.max()),
        gain=gain,
        suppressed=_check_suppressed(runs),
        reached={formulation: int(np.sum((fast["formulation"] == formulation) & (fast["end"] == REACHED))) for formulation in FORMULATIONS},
    )


def _against(rows: pd.DataFrame, others: pd.DataFrame, column: str) -> "pd.Series[float]":
    """Return a column as a multiple of the value for the default treatment at the same tolerance, by tolerance."""
    default_values = others[others["formulation"] == "index1"].set_index("tol")[column]
    return (rows.set_index("tol")[column] / default_values).dropna()


def _check_suppressed(runs: pd.DataFrame) -> SimpleNamespace:
    """Test that IDASetSuppressAlg fails at tight tolerances, in Newton's iteration, and is no worse where it reaches the end."""
    rows = runs[(runs["cure"] == "suppress") & runs["formulation"].isin(["index3", "index2", "ggl"])]
    lost = rows[rows["end"] != REACHED]
    for keys, group in rows.groupby(["formulation", "scene"]):
        through = group["tol"][group["end"] == REACHED]
        tight = group["tol"][group["end"] != REACHED]
        require(bool(tight.max() < through.min()) or not len(tight), "suppress fails at the tight end", f"{keys}: {tight.to_list()}")
    newton = float(np.mean(lost["end"] == "Newton"))
    require(newton > 0.5, "it is Newton's iteration that fails", newton)
    gain = {formulation: _gain(runs, formulation, "suppress") for formulation in ("index3", "index2", "ggl")}
    require(min(gain.values()) > 1, "where suppress reaches the end it is more accurate", gain)
    ends = {str(name): (len(group), len(rows[rows["formulation"] == name])) for name, group in lost.groupby("formulation")}
    require(set(ends) == {"index3", "index2", "ggl"}, "suppress fails at index 3, 2 and GGL", ends)
    return SimpleNamespace(lost=ends, newton=newton, gain=gain, loosest=lost.groupby("formulation")["tol"].max())


def _gain(runs: pd.DataFrame, formulation: str, treatment: str) -> float:
    """Return the geometric mean of the error with ``atol`` over that with another treatment, over all problems and tolerances."""
    rows = runs[(runs["formulation"] == formulation) & (runs["end"] == REACHED)]
    errors = rows.pivot(index=["scene", "tol"], columns="cure", values="error")
    return float(np.exp(np.log(errors["atol"] / errors[treatment]).mean()))

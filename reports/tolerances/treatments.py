"""The treatment of the multipliers: where it is needed, which is the more accurate one, and how runs end."""

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pandas as pd
from markupsafe import Markup

from daebench.draw.figures import STROKES, grid_of_axes, save
from daebench.pages.report import NONE, count, listing, power_of_ten
from daebench.pages.report.claims import require
from daebench.pages.report.tables import Of, Table, once, part, text
from daebench.reports.index_reduction.ida import label
from daebench.reports.tolerances.accuracy import ASKED, EDGE, ERROR, diagonal, finish
from daebench.reports.tolerances.runs import FAST, FORMULATIONS, IN_WORDS, IVPS, KINDS, REACHED, STOPPED


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
    fast = part(runs, scene=FAST, cure="none")
    at_start = part(fast, formulation="index3", t_reached=0)
    tried = int(np.sum(fast["formulation"] == "index3"))
    require(len(at_start) == tried, "plain index 3 on the fast pendulum stops at t = 0 at every tolerance", f"{len(at_start)} of {tried}")
    through = part(fast, formulation="index1", end=REACHED)
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
        dearer=dearer.max(),
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
    rows = part(runs, cure="suppress", formulation=("index3", "index2", "ggl"))
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
    rows = part(runs, formulation=formulation, end=REACHED)
    errors = rows.pivot(index=["scene", "tol"], columns="cure", values="error")
    return float(np.exp(np.log(errors["atol"] / errors[treatment]).mean()))


TREATMENT_STROKE = {"derivative": STROKES[3], "atol": STROKES[1], "suppress": STROKES[2], "none": STROKES[6]}


TREATMENT_NAMES = {"derivative": "derivative", "atol": "atol", "suppress": "suppress", "none": "plain"}


def draw_treatments(runs: pd.DataFrame, folder: Path) -> Path:
    """Draw the same for all treatments on the fast pendulum: one panel per formulation."""
    fast = runs[runs["scene"] == FAST]
    figure, axes = grid_of_axes(2, 2, 5.2, x=ASKED, y=ERROR, sharex=True, sharey=True)
    for ax, formulation in zip(axes.flat, FORMULATIONS, strict=True):
        diagonal(ax, fast["tol"])
        for k, (treatment, stroke) in enumerate(TREATMENT_STROKE.items()):
            rows = part(fast, formulation=formulation, cure=treatment)
            ax.plot(rows["tol"], shown(rows), label=TREATMENT_NAMES[treatment], **stroke.points())
            mark_ends(ax, rows, stroke.color, k, len(TREATMENT_STROKE))
        finish(ax, label(formulation))
    handles, labels = axes[0, 0].get_legend_handles_labels()
    stops = [axes[0, 0].plot([], [], linestyle="none", marker=marker, color="black", markeredgewidth=1.4)[0] for marker in "x+"]
    figure.legend([*handles, *stops], [*labels, "IDA stopped", "given up"], loc="outside lower center", ncols=6, columnspacing=1.2)
    return save(figure, folder, "cures", fast)


def mark_ends(ax: Any, rows: pd.DataFrame, color: str, k: int, of: int) -> None:
    """Mark runs without a result at the upper edge: a cross where IDA stopped, a plus where it was given up."""
    y = EDGE[0] * (EDGE[1] / EDGE[0]) ** ((k + 0.5) / of)
    for chosen, marker in ((rows["end"].isin(STOPPED), "x"), (~rows["end"].isin((*STOPPED, REACHED)), "+")):
        tols = rows["tol"][chosen]
        ax.plot(tols, np.full(len(tols), y), linestyle="none", marker=marker, markersize=5, markeredgewidth=1.4, color=color)


def shown(rows: pd.DataFrame) -> "pd.Series[float]":
    """Return errors as they are drawn: at least the error bound of the reference."""
    return rows["error"].clip(lower=rows["floor"])


def ends(runs: pd.DataFrame) -> pd.DataFrame:
    """Return one row per formulation and treatment: the number of runs by outcome, over all problems, including runs without a failure."""
    names = (REACHED, *KINDS.values(), "other")
    rows = []
    for formulation in FORMULATIONS:
        for treatment in ("none", "atol", "derivative", "suppress"):
            treated_runs = part(runs, formulation=formulation, cure=treatment)
            good = treated_runs[treated_runs["end"] == REACHED]
            counts = {name: int(np.sum(treated_runs["end"] == name)) for name in names}
            tightest = good.groupby("scene")["tol"].min().reindex(list(IVPS))
            rows.append(
                {
                    "formulation": label(formulation),
                    "cure": treatment,
                    "default": bool(treated_runs["default"].iloc[0]),
                    "runs": len(treated_runs),
                }
                | counts
                | {"tightest_of_worst_scene": tightest.max() if tightest.notna().all() else float("nan")}
            )
    return pd.DataFrame(rows)


def ends_table(frame: pd.DataFrame) -> Table:
    """Return how runs ended."""
    outcomes = {
        "error test": "error test<small>IDA stops</small>",
        "Newton": "Newton<small>IDA stops</small>",
        "step size": "step size<small>collapsed</small>",
        "patience": "given up<small>too much work</small>",
        "other": "other<small>IDA stops</small>",
    }
    shown = {
        "formulation": text,
        "cure": Of(
            lambda cure, default: ("none (plain)" if cure == "none" else cure) + (", default" if default else ""), "cure", "default"
        ),
        "runs": count,
        REACHED: (zero, "reached<small>the end</small>"),
    }
    shown |= {name: (zero, heading) for name, heading in outcomes.items() if frame[name].any()}
    return Table(frame.assign(formulation=once(frame["formulation"])), shown, frame)


def zero(value: int) -> Markup:
    """Return a count, or a dash for none."""
    return count(value) if value else Markup(NONE)


def sentences(failed: pd.DataFrame) -> Markup:
    """Return a sentence on runs that ended early: from how many starts, which, and why."""
    phrases = []
    for (formulation, scene, tol, end), rows in failed.groupby(["formulation", "scene", "tol", "end"], sort=False):
        phrases.append(
            Markup("{} on the {} at tolerance {} from {} {} ({})").format(
                label(str(formulation)),
                IVPS[str(scene)],
                power_of_ten(float(str(tol))),
                len(rows),
                "start" if len(rows) == 1 else "starts",
                IN_WORDS[str(end)],
            )
        )
    return listing(phrases)

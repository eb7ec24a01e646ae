"""The picture of a work-precision study: error against time and against evaluations, a column a family of methods."""

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from daebench.diagnostics.energy import DRIFTS
from daebench.draw.figures import BLACK, QUIET, curve, drawing, grid_of_axes, save
from daebench.errors import DaebenchError
from daebench.studies.grid.against import OWN
from daebench.studies.grid.claimed import claims_of
from daebench.studies.grid.rows import by_method
from daebench.studies.work_precision.study import bound_of, front

if TYPE_CHECKING:
    import pandas as pd

COSTS = {"seconds": "CPU time [s]", "evaluations": "evaluations"}
"""What errors are drawn against, and its label."""

FAMILIES = ("fixed steps,\nno drift claimed", "fixed steps,\nno such claim", "compositions,\nfixed steps", "by tolerance")
"""Columns of the picture: methods that claim to keep the energy without drift, and others."""

OTHERS = "#d4d4d4"
"""Grey of the curves of all other families."""

MARGIN = 3.0
"""Factor between what is drawn and the frame."""

HIGHEST = 10.0
"""Errors up to this are drawn: beyond it nothing is right."""


def families(table: "pd.DataFrame") -> Mapping[str, list[str]]:
    """Return the families that there are and their methods: by resolution, composition and claim on the energy."""
    claims = claims_of(table)
    methods_by_family: dict[str, list[str]] = {name: [] for name in FAMILIES}
    for name, runs in by_method(table):
        claiming, others, composed, by_tolerance = FAMILIES
        fixed = composed if "/" in name else claiming if "energy" in claims[name] else others
        methods_by_family[fixed if (runs["knob"] == "h").all() else by_tolerance].append(name)
    return {family: names for family, names in methods_by_family.items() if names}


def nothing_of(table: "pd.DataFrame", error: str) -> str:
    """Return why there is nothing of an error to draw, as a clause; "" where there is something."""
    done = table[table["failure"] == ""]
    if done.empty:
        return f"none of the {len(table)} runs came to its end; the first says: {str(table['failure'].iloc[0]).rstrip('.')}"
    if done[error].isna().all():
        return f"no run on {table['problem'].iloc[0]} has a number for it"
    drawn = _known(table, error)
    if drawn.empty:
        return "all errors are 0, or within the bound of what they are taken against"
    return "" if _costs(drawn) else "no run has a time, or evaluations that are counted; take --repeat 1 for times"


def _known(table: "pd.DataFrame", error: str) -> "pd.DataFrame":
    """Return the runs whose error is known, each above its own bound, with moduli."""
    done = table[table["failure"] == ""]
    runs, bound = done.assign(**{error: done[error].abs()}), bound_of(done, error)
    return runs[runs[error] > (runs[bound] if bound else 0.0)]


def _floor(table: "pd.DataFrame", error: str) -> float:
    """Return the largest bound of an error, 0 if it has none."""
    bound = bound_of(table, error)
    return float(table[bound].max()) if bound else 0.0


def _costs(table: "pd.DataFrame") -> list[str]:
    return [cost for cost in COSTS if table[cost].notna().any()]


def draw(out: Path, table: "pd.DataFrame", error: str, label: str, *, stem: str | None = None) -> Path:
    """Write the figure of one error, ``work_precision_ERROR`` as SVG, PNG and CSV; return the path of the SVG.

    Each family has a column - fixed steps with a claim to energy without drift, and without - and a method whose energy was measured to
    drift in the run with its smallest step size or tolerance says so in the legend. The curves of the other families are in grey behind,
    and the Pareto front of all runs is a black line. A curve ends where an error reaches its own bound, below which nothing is known; a
    dotted line is at the largest of the bounds, and of a finer run, which is not certified, a dashed one over a hatched area. Of what has a
    sign, its modulus is drawn.

    The table is that of :func:`daebench.studies.work_precision.study.with_costs`. DaebenchError is raised if there is nothing to draw, see
    :func:`nothing_of`.
    """
    if why := nothing_of(table, error):
        raise DaebenchError(f"there is nothing of {error} to draw: {why}.")
    shown = table[table["failure"] == ""].dropna(subset=[error])
    drawn, floor = _known(table, error), _floor(shown, error)
    costs = _costs(drawn)
    groups = families(table[table["method"].isin(drawn["method"])])
    with drawing():
        figure, axes = grid_of_axes(len(costs), len(groups), 0.9 + 2.35 * len(costs), sharey=True, sharex="row")
        for row, cost in zip(axes, costs, strict=True):
            for axis, (family, names) in zip(row, groups.items(), strict=True):
                _panel(axis, drawn, names, error, cost)
                if floor > 0:
                    axis.set_ylim(bottom=min(floor, float(drawn[error].min())) / MARGIN)
                    _draw_floor(axis, floor, certified=not _own(shown))
                axis.set(xscale="log", yscale="log", xlabel=COSTS[cost], title=family if cost == costs[0] else "")
                axis.set_ylim(top=min(HIGHEST, MARGIN * float(drawn[error].max())))
            row[0].set_ylabel(label)
        for axis in axes[-1]:
            axis.legend(loc="upper left", bbox_to_anchor=(-0.1, -0.28), handlelength=2.2, borderaxespad=0.0, fontsize=8)
        return save(figure, out, stem or f"work_precision_{error}", shown)


def _own(table: "pd.DataFrame") -> bool:
    """Return whether errors of some runs are taken against a finer run, which is not certified."""
    return "reference" in table and bool(table["reference"].astype(str).str.startswith(OWN).any())


def _draw_floor(axis: Any, floor: float, *, certified: bool) -> None:
    """Draw what the reference may be wrong by: a dotted line, of a finer run a dashed one over a hatched area, with words."""
    if certified:
        axis.axhline(floor, color=QUIET, linestyle=":", linewidth=1.0)
        return
    axis.axhline(floor, color=QUIET, linestyle="--", linewidth=1.0, label=f"{OWN},\nbound {floor:.1e}")
    axis.axhspan(axis.get_ylim()[0], floor, facecolor="none", edgecolor=OTHERS, hatch="///", linewidth=0.0, zorder=0)


def _panel(axis: Any, table: "pd.DataFrame", names: list[str], error: str, cost: str) -> None:
    """Draw the methods of a family over those of all others, and the front of all."""
    curves = {name: runs.sort_values(cost) for name, runs in by_method(table)}
    for name, runs in curves.items():
        if name not in names:
            axis.plot(runs[cost], runs[error], color=OTHERS, linewidth=0.7, zorder=1)
    best = front(table, error, cost)
    axis.plot(best[cost], best[error], color=BLACK, linewidth=0.8, zorder=2)
    for k, name in enumerate(name for name in names if name in curves):
        _curve(axis, k, name, curves[name], error, cost)


def _drift(runs: "pd.DataFrame") -> str:
    """Return a mark for a method whose energy drifts in the run with its smallest step size or tolerance, whatever it claims; else ""."""
    if "energy_verdict" not in runs:
        return ""
    return ", drifts" if runs.sort_values("value")["energy_verdict"].iloc[0] == DRIFTS else ""


def _curve(axis: Any, k: int, name: str, runs: "pd.DataFrame", error: str, cost: str) -> None:
    style = curve(k)
    fixed = (runs["knob"] == "h").all()
    axis.plot(
        runs[cost],
        runs[error],
        label=f"{name}{_drift(runs)}",
        zorder=3,
        **style | {"linestyle": "-" if fixed else (0, (4, 1.5)), "linewidth": 1.1},
    )

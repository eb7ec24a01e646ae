"""The picture of a work-precision study: error against time or evaluations, the curves named at their ends, dashed by family."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

from daebench.diagnostics.drift import DRIFTS
from daebench.draw.end_labels import label_ends
from daebench.draw.figures import BLACK, QUIET, WIDTH, drawing, save
from daebench.draw.methods import short_name_of, strokes_of
from daebench.errors import DaebenchError
from daebench.methods.outside.read import is_outside
from daebench.studies.grid.claimed import claims_of
from daebench.studies.grid.reference import OWN
from daebench.studies.grid.rows import by_method, endless
from daebench.studies.work_precision.study import bound_of, front

if TYPE_CHECKING:
    import pandas as pd

COSTS = {"seconds": "CPU time [s]", "evaluations": "evaluations"}
"""What errors are drawn against, and its label."""

FAMILIES = ("fixed steps, no energy drift claimed", "fixed steps, no such claim", "compositions", "by tolerance")
"""Families of methods, by what they claim of the energy."""

DASHES: Mapping[str, Any] = MappingProxyType(dict(zip(FAMILIES, ("-", (0, (4, 1.6)), (0, (9, 1.2)), (0, (1, 1.1))), strict=True)))
"""How the curves of a family are dashed."""

OTHERS = "#d4d4d4"
"""Grey of the front, and of what lies behind other curves."""

MARGIN = 3.0
"""Factor between what is drawn and the frame."""

EMPTY = 100.0
"""Factor below the least error up to which the bound of the reference is inside the frame."""

HIGHEST = 10.0
"""Errors up to this are drawn: beyond it nothing is right."""


def families(table: "pd.DataFrame") -> Mapping[str, list[str]]:
    """Return the families that there are and their methods: by resolution, composition and claim on the energy."""
    claims = claims_of(table)
    methods_by_family: dict[str, list[str]] = {name: [] for name in FAMILIES}
    for name, runs in by_method(table):
        claiming, others, composed, by_tolerance = FAMILIES
        fixed = composed if "/" in name and not is_outside(name) else claiming if "energy" in claims[name] else others
        methods_by_family[fixed if (runs["knob"] == "h").all() else by_tolerance].append(name)
    return {family: names for family, names in methods_by_family.items() if names}


def nothing_of(table: "pd.DataFrame", error: str) -> str:
    """Return why there is nothing of an error to draw, as a clause; "" where there is something."""
    if why := endless(table):
        return why
    if table[error][table["failure"] == ""].isna().all():
        return f"no run on {table['problem'].iloc[0]} has a number for it"
    drawn = _known(table, error)
    if drawn.empty:
        return "all errors are 0, or within the error bound of the reference"
    return "" if _costs(drawn) else "no run has a time, or counted evaluations; give --repeat 1 for times"


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


def draw(
    out: Path, table: "pd.DataFrame", error: str, label: str, *, stem: str | None = None, against: Sequence[str] = tuple(COSTS)
) -> Path:
    """Write the figure of one error, ``work_precision_ERROR`` as SVG, PNG and CSV; return the path of the SVG.

    A diagram of the full width for each cost. Each curve has its method's colour, and its name at the end; dashes tell the families, by
    what is claimed of the energy. A method whose energy was measured to drift in the run with its smallest step size or tolerance has a
    star at its name. The Pareto front of all runs is a wide grey band behind the curves. A curve ends where an error reaches its own bound,
    below which nothing is known; a dotted line is at the largest of the bounds, and of a finer run, which is not certified, a dashed one
    over a hatched area. Of what has a sign, its modulus is drawn.

    The table is that of :func:`daebench.studies.work_precision.study.with_costs`. DaebenchError is raised if there is nothing to draw, see
    :func:`nothing_of`.
    """
    from matplotlib.figure import Figure

    if why := nothing_of(table, error):
        raise DaebenchError(f"there is no {error} to draw: {why}.")
    shown = table[table["failure"] == ""].dropna(subset=[error])
    drawn, floor = _known(table, error), _floor(shown, error)
    costs = [cost for cost in _costs(drawn) if cost in against] or _costs(drawn)
    groups = families(table[table["method"].isin(drawn["method"])])
    with drawing():
        figure, share = Figure(figsize=(WIDTH, HEIGHT * len(costs))), 1 / len(costs)
        figure.set_layout_engine("none")
        for k, cost in enumerate(costs):
            axis = figure.add_axes((0.1, 1 - (k + 0.89) * share, 0.62, 0.79 * share))
            axis.set(xscale="log", yscale="log", xlabel=COSTS[cost], ylabel=label)
            least = float(drawn[error].min())
            axis.set_ylim((floor if least / EMPTY < floor < least else least) / MARGIN, min(HIGHEST, MARGIN * float(drawn[error].max())))
            if floor > 0:
                _draw_floor(axis, floor, certified=not _own(shown))
            _diagram(axis, drawn, groups, error, cost)
        figure.legend(handles=_legend(groups), loc="upper left", fontsize=8, ncols=3, handlelength=3.0, columnspacing=1.4)
        return save(figure, out, stem or f"work_precision_{error}", shown)


HEIGHT = 4.9
"""Height of a diagram, inches: room for the names of some twenty curves."""


def _diagram(axis: Any, table: "pd.DataFrame", groups: Mapping[str, list[str]], error: str, cost: str) -> None:
    """Draw the front of all runs, and the curve of each method with its name at the end."""
    best = front(table, error, cost)
    axis.plot(best[cost], best[error], color=OTHERS, linewidth=5.0, zorder=1, solid_capstyle="round")
    family = {name: group for group, names in groups.items() for name in names}
    curves = {name: runs.dropna(subset=[cost]).sort_values(cost) for name, runs in by_method(table)}
    curves = {name: runs for name, runs in curves.items() if len(runs)}
    strokes = strokes_of(family)
    for name, runs in curves.items():
        style = strokes[name].points() | {"linestyle": DASHES[family[name]], "linewidth": 1.1, "markersize": 3.6}
        axis.plot(runs[cost], runs[error], zorder=3, **style)
    ends = {name: runs.iloc[-1] for name, runs in curves.items()}
    label_ends(
        axis,
        [f"{short_name_of(name)}{_drift(curves[name])}" for name in ends],
        [float(end[cost]) for end in ends.values()],
        [float(end[error]) for end in ends.values()],
        [strokes[name].color for name in ends],
    )


def _legend(groups: Mapping[str, list[str]]) -> list[Any]:
    """Return the meaning of the dashes and of the band, for a legend."""
    from matplotlib.lines import Line2D

    dashed = [Line2D([], [], color=BLACK, linestyle=DASHES[family], linewidth=1.2, label=family) for family in groups]
    return [*dashed, Line2D([], [], color=OTHERS, linewidth=5.0, label="cheapest runs")]


def _own(table: "pd.DataFrame") -> bool:
    """Return whether errors of some runs are taken against a finer run, which is not certified."""
    return "reference" in table and bool(table["reference"].astype(str).str.startswith(OWN).any())


def _draw_floor(axis: Any, floor: float, *, certified: bool) -> None:
    """Draw the bound on the error of the reference: a dotted line, of a finer run a dashed one over a hatched area, with words."""
    words = "bound of the reference" if certified else f"{OWN}, bound {floor:.1e}"
    axis.axhline(floor, color=QUIET, linestyle=":" if certified else "--", linewidth=1.0)
    axis.text(0.005, floor, words, transform=axis.get_yaxis_transform(), va="bottom", fontsize=7.5, color=QUIET, clip_on=True)
    if not certified:
        axis.axhspan(axis.get_ylim()[0], floor, facecolor="none", edgecolor=OTHERS, hatch="///", linewidth=0.0, zorder=0)


def _drift(runs: "pd.DataFrame") -> str:
    """Return a star for a method whose energy drifts in the run with its smallest step size or tolerance, whatever it claims; else ""."""
    if "energy_verdict" not in runs:
        return ""
    return " *" if runs.sort_values("value")["energy_verdict"].iloc[0] == DRIFTS else ""

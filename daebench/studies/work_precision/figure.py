"""The pictures of a work-precision study: error against time or evaluations, and over many starts bands of errors against time."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from textwrap import fill as wrapped
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

import numpy as np

from daebench.diagnostics.drift import DRIFTS
from daebench.draw.bands import LEVELS, column, fill
from daebench.draw.end_labels import label_ends
from daebench.draw.figures import BLACK, QUIET, WIDTH, drawing, grid_of_axes, save
from daebench.draw.methods import short_name_of, strokes_of
from daebench.errors import DaebenchError
from daebench.methods.outside.read import is_outside
from daebench.studies.grid.claimed import claims_of
from daebench.studies.grid.reference import OWN
from daebench.studies.grid.rows import by_method, endless
from daebench.studies.work_precision.starts import Curves
from daebench.studies.work_precision.study import bound_of, front
from daebench.systems.lazily import matplotlib as mpl
from daebench.systems.lazily import pandas as pd

if TYPE_CHECKING:
    from matplotlib.figure import Figure

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

HEIGHT = 4.9
"""Height of a diagram, inches: room for the names of some twenty curves."""

ROOM = 15.0
"""Factor between the largest time and the frame, for the legend."""

LETTERS = 125
"""Letters of a line of the title."""


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
    out: Path,
    table: "pd.DataFrame",
    error: str,
    label: str,
    *,
    stem: str | None = None,
    against: Sequence[str] = tuple(COSTS),
    **which: Any,
) -> Path:
    """Write :func:`figure` of one error, ``work_precision_ERROR`` as SVG, PNG and CSV; return the path of the SVG."""
    drawn = figure(table, error, label, against=against, **which)
    return save(drawn, out, stem or f"work_precision_{error}", table[table["failure"] == ""].dropna(subset=[error]))


def figure(
    table: "pd.DataFrame", error: str, label: str, *, against: Sequence[str] = tuple(COSTS), methods: Sequence[str] = ()
) -> "Figure":
    """Return the picture of one error.

    A diagram of the full width for each cost. Each curve has its method's colour, and its name at the end; dashes tell the families, by
    what is claimed of the energy. A method whose energy was measured to drift in the run with its smallest step size or tolerance has a
    star at its name. The Pareto front of all runs is a wide grey band behind the curves. A curve ends where an error reaches its own bound,
    below which nothing is known; a dotted line is at the largest of the bounds, and of a finer run, which is not certified, a dashed one
    over a hatched area. Of what has a sign, its modulus is drawn. ``methods`` names those whose curves are drawn, by default all.

    The table is that of :func:`daebench.studies.work_precision.study.with_costs`. DaebenchError is raised if there is nothing to draw, see
    :func:`nothing_of`.
    """
    if why := nothing_of(table, error):
        raise DaebenchError(f"there is no {error} to draw: {why}.", "error-not-to-draw")
    shown = table[table["failure"] == ""].dropna(subset=[error])
    drawn, floor = _known(table, error), _floor(shown, error)
    costs = [cost for cost in _costs(drawn) if cost in against] or _costs(drawn)
    groups = families(table[table["method"].isin(drawn["method"]) & table["method"].isin(list(methods) or table["method"])])
    with drawing():
        picture, share = mpl.figure.Figure(figsize=(WIDTH, HEIGHT * len(costs))), 1 / len(costs)
        picture.set_layout_engine("none")
        for k, cost in enumerate(costs):
            axis = picture.add_axes((0.1, 1 - (k + 0.89) * share, 0.62, 0.79 * share))
            axis.set(xscale="log", yscale="log", xlabel=COSTS[cost], ylabel=label)
            least = float(drawn[error].min())
            axis.set_ylim((floor if least / EMPTY < floor < least else least) / MARGIN, min(HIGHEST, MARGIN * float(drawn[error].max())))
            if floor > 0:
                _draw_floor(axis, floor, certified=not _own(shown))
            _diagram(axis, drawn, groups, error, cost)
        picture.legend(handles=_legend(groups), loc="upper left", fontsize=8, ncols=3, handlelength=3.0, columnspacing=1.4)
    return picture


def _diagram(axis: Any, table: "pd.DataFrame", groups: Mapping[str, list[str]], error: str, cost: str) -> None:
    """Draw the front of all runs, and the curve of each method with its name at the end."""
    best = front(table, error, cost)
    axis.plot(best[cost], best[error], color=OTHERS, linewidth=5.0, zorder=1, solid_capstyle="round")
    family = {name: group for group, names in groups.items() for name in names}
    curves = {name: runs.dropna(subset=[cost]).sort_values(cost) for name, runs in by_method(table) if name in family}
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
    dashed = [mpl.lines.Line2D([], [], color=BLACK, linestyle=DASHES[family], linewidth=1.2, label=family) for family in groups]
    return [*dashed, mpl.lines.Line2D([], [], color=OTHERS, linewidth=5.0, label="cheapest runs")]


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


def bands(curves: Sequence[Curves]) -> "pd.DataFrame":
    """Return quantiles of errors over starts, a row each of method and step size or tolerance.

    Columns are method, knob, value, starts, failed, the number of runs that stopped early, whose errors count as infinite; seconds, the
    median; q05 to q95, errors of which each is at least the bound of its reference; and reference and reference_q95, the median of these
    bounds and their quantile.
    """
    rows = []
    for some in curves:
        reference, high = np.quantile(some.bound, (0.5, 0.95), method="inverted_cdf")
        for k, value in enumerate(some.values):
            spent = some.seconds[k][np.isfinite(some.seconds[k])]
            row = {"method": some.method, "knob": some.knob, "value": value, "starts": some.starts, "failed": some.failed[k]}
            row |= {"seconds": np.median(spent) if len(spent) else np.nan}
            levels = np.quantile(some.errors[k], LEVELS, method="inverted_cdf")
            row |= {column(level): x for level, x in zip(LEVELS, levels, strict=True)}
            rows.append(row | {"reference": reference, "reference_q95": high})
    return pd.DataFrame(rows)


def bands_figure(table: "pd.DataFrame", families: Mapping[str, list[str]], label: str, title: Sequence[str]) -> "Figure":
    """Return the picture of bands of errors.

    A panel has one family; bands are the middle 90 % and 50 % of starts, lines the medians, those of other families grey. The area in
    which the references of 5 % of the starts or more are no better is hatched, and the median of their errors dotted; a line ends there.
    """
    most = table.iloc[int(table["starts"].argmax())]
    floor, high = float(most["reference"]), float(most["reference_q95"])
    shown = table[(table["q50"] > table["reference"]) & np.isfinite(table["q50"]) & (table["seconds"] > 0)]
    if shown.empty:
        raise DaebenchError(
            f"there is nothing to draw: no method has an error above that of its reference, {floor:.1e}, and a time.",
            "bands-nothing-to-draw",
        )
    columns = min(2, len(families))
    rows = -(-len(families) // columns)
    with drawing():
        shared: Any = {"sharex": True, "sharey": True}
        height = 0.8 + 0.2 * len(title) + 2.9 * rows
        picture, axes = grid_of_axes(rows, columns, height, x=COSTS["seconds"], y=label, **shared)
        for axis, (family, names) in zip(axes.flat, families.items(), strict=False):
            axis.set(xscale="log", yscale="log", title=family)
            _panel(axis, shown, names)
        bottom = min(floor, float(shown["q05"].min())) / MARGIN
        axes[0, 0].set_xlim(right=ROOM * float(shown["seconds"].max()))
        axes[0, 0].set_ylim(bottom, min(HIGHEST, MARGIN * float(shown["q95"].max())))
        for axis in axes.flat[: len(families)]:
            if np.isfinite(high):
                axis.axhspan(bottom, high, facecolor="none", edgecolor=OTHERS, hatch="///", linewidth=0.0, zorder=0)
            axis.axhline(floor, color=QUIET, linestyle=":", linewidth=1.0, label="error of references")
            axis.tick_params(labelbottom=True)
            axis.legend(loc="upper right", fontsize=7, handlelength=2.0, labelspacing=0.25, borderaxespad=0.1)
        for axis in axes.flat[len(families) :]:
            axis.set_visible(False)
        picture.suptitle(
            "\n".join(wrapped(sentence, LETTERS, subsequent_indent="   ") for sentence in title), fontsize=8, x=0.02, ha="left"
        )
    return picture


def _panel(axis: Any, table: "pd.DataFrame", names: Sequence[str]) -> None:
    """Draw the bands of a family, and the medians of all others."""
    curves = {str(name): rows.sort_values("value", ascending=False) for name, rows in table.groupby("method", sort=False)}
    for name, rows in curves.items():
        if name not in names:
            axis.plot(rows["seconds"], rows["q50"], color=OTHERS, linewidth=0.7, zorder=1)
    strokes = strokes_of(curves)
    for name in (name for name in names if name in curves):
        rows, style = curves[name], strokes[name].points()
        errors = {level: rows[column(level)].clip(upper=HIGHEST * MARGIN) for level in LEVELS}
        fill(axis, rows["seconds"], errors.__getitem__, style["color"], zorder=2)
        fixed = (rows["knob"] == "h").all()
        label = f"{short_name_of(name)} ({rows['starts'].iloc[0]})"
        line = {"linestyle": "-" if fixed else (0, (4, 1.5)), "linewidth": 1.1, "markersize": 3.5}
        axis.plot(rows["seconds"], rows["q50"], label=label, zorder=3, **style | line)

"""Tables of signs in the report on methods: a sign for each property of each method, of the main ones first, then of all by family."""

import math
from collections.abc import Callable, Mapping, Sequence, Set
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.lines import Line2D

from daebench.diagnostics.drift import BOUNDED, DRIFTS, UNDETERMINED
from daebench.draw.figures import BLACK, BLUE, QUIET, VERMILION, grid_of_axes, save
from daebench.draw.methods import name_of
from daebench.reports.methods.families import TITLES, by_family, family
from daebench.reports.methods.matrix import HIDDEN, KEPT, LOST, PROPERTIES, over_time
from daebench.reports.methods.sweep import EVALUATIONS

MAIN = (
    "rattle",
    "lobatto3",
    "shake",
    "symplectic_euler",
    "energy_momentum",
    "radau2_ggl",
    "midpoint",
    "rk4",
    "rk4+proj",
    "baumgarte:rk4",
    "ida:index2",
)
"""Methods of the first figure: one or two of each family."""

FEW = ("rattle", "lobatto3", "energy_momentum", "midpoint", "rk4")
"""Methods of the picture for the index."""

HEADINGS = {"symmetric": "symmetry", "symplectic": "two-form", "g": "$g=0$", "Gv": "$G\\,H_p=0$", "H": "energy"}

SIGNS: Mapping[str, dict[str, Any]] = {
    KEPT: {"marker": "o", "color": BLUE, "markersize": 7.5},
    HIDDEN: {"marker": "o", "markeredgecolor": BLUE, "markerfacecolor": "white", "markersize": 7.0, "markeredgewidth": 1.3},
    BOUNDED: {"marker": r"$\sim$", "color": BLACK, "markersize": 9.0, "markeredgewidth": 0.4},
    DRIFTS: {"marker": r"$\nearrow$", "color": VERMILION, "markersize": 7.5, "markeredgewidth": 0.4},
    LOST: {"marker": "x", "color": VERMILION, "markersize": 4.6, "markeredgewidth": 1.3},
    UNDETERMINED: {"marker": "$?$", "color": QUIET, "markersize": 5.5, "markeredgewidth": 0.3},
}
"""Shape and colour have the same meaning; beside each sign is the power of ten of the largest defect."""

LABELS = {
    KEPT: "claimed, and kept to round-off",
    HIDDEN: "round-off, not claimed",
    BOUNDED: "bounded over a long run",
    DRIFTS: "drifts over a long run",
    LOST: "not kept, or the run ends early",
    UNDETERMINED: "bounded or drifting: undetermined",
}

ROW = 0.172
"""Height of a row, inches."""

ORDER_X, FIRST_X, STEP_X = 1.0, 2.35, 1.12


def lines(rows: Sequence[str]) -> list[tuple[str, str]]:
    """Return the lines of the figure, top first: ("family", its key) or ("method", its name)."""
    entries: list[tuple[str, str]] = []
    for key, members in by_family(rows).items():
        entries += [("family", key), *(("method", name) for name in members)]
    return entries


def draw_main(rows: Mapping[str, Mapping[Any, Any]], folder: Path) -> Path:
    """Draw the signs of the main methods, by the names that they have in words."""
    shown = [("method", name) for name in MAIN if name in rows]
    return draw_signs(shown, rows, folder, "main", name_of)


def draw_few(ax: Any, rows: Mapping[str, Mapping[Any, Any]]) -> None:
    """Draw the signs of a few methods, without numbers."""
    shown = [name for name in FEW if name in rows]
    for line, name in enumerate(shown):
        ax.text(-0.6, line, name_of(name), ha="right", va="center", fontsize=8)
        for k, key in enumerate(HEADINGS):
            if rows[name][key] in SIGNS:
                ax.plot([k], [line], linestyle="none", **SIGNS[rows[name][key]])
    for k, heading in enumerate(HEADINGS.values()):
        ax.text(k, -0.6, heading, ha="left", va="bottom", fontsize=7, rotation=28)
    ax.set(xlim=(-0.5, len(HEADINGS) - 0.3), ylim=(len(shown) - 0.4, -0.7))
    ax.axis("off")


def draw_matrix(rows: Mapping[str, Mapping[Any, Any]], folder: Path) -> Path:
    """Draw the signs of all methods by family, IDA's residuals among them."""
    return draw_signs(lines(list(rows)), rows, folder, "matrix", str)


def rows_of(table: pd.DataFrame, ida: pd.DataFrame, drift: pd.DataFrame) -> dict[str, dict[Any, Any]]:
    """Return a row for each method and each formulation of IDA, with the verdicts of the long runs."""
    everything = pd.concat([table, pd.DataFrame(ida_rows(ida).values())], ignore_index=True)
    return {str(row["method"]): dict(row) for row in over_time(everything, drift).to_dict("records")}


def draw_signs(
    shown: Sequence[tuple[str, str]], rows: Mapping[str, Mapping[Any, Any]], folder: Path, stem: str, named: Callable[[str], str]
) -> Path:
    """Draw lines of :func:`lines`, with a key of the signs that occur; the rows drawn are the data."""
    figure, axes = grid_of_axes(1, 1, ROW * (len(shown) + 5.5))
    ax = axes[0, 0]
    for line, (kind, name) in enumerate(shown):
        if kind == "family":
            ax.text(-2.1, line + 0.1, TITLES[name], fontsize=8.5, fontweight="bold", va="center")
            ax.axhline(line - 0.5, color="#c8c8c8", linewidth=0.6)
        else:
            draw_row(ax, line, named(name), rows[name], "DejaVu Sans Mono" if named(name) == name else "DejaVu Sans")
    for k, heading in enumerate(HEADINGS.values()):
        ax.text(FIRST_X + k * STEP_X, -1.0, heading, ha="center", va="bottom", fontsize=8.5)
    ax.text(ORDER_X, -1.0, "order", ha="center", va="bottom", fontsize=8.5)
    ax.set(xlim=(-2.15, FIRST_X + len(HEADINGS) * STEP_X - 0.35), ylim=(len(shown) - 0.4, -1.6))
    ax.axis("off")
    drawn = [rows[name] for kind, name in shown if kind == "method"]
    draw_key(figure, {row[key] for row in drawn for key in HEADINGS})
    return save(figure, folder, stem, pd.DataFrame(drawn))


def draw_row(ax: Any, line: int, name: str, row: Mapping[Any, Any], family: str) -> None:
    """Draw one method: its name, its order claimed and measured, and its signs."""
    ax.text(-1.95, line, name, fontsize=7.6, va="center", family=family)
    if math.isfinite(row["claimed"]):
        ax.text(ORDER_X - 0.1, line, f"{row['claimed']:.0f}", fontsize=8.5, ha="right", va="center", fontweight="bold")
        measured = f"{row['order']:.2f}" if math.isfinite(row["order"]) else "\N{EN DASH}"
        ax.text(ORDER_X + 0.05, line, measured, fontsize=7.2, ha="left", va="center", color=QUIET)
    for k, key in enumerate(HEADINGS):
        x, state = FIRST_X + k * STEP_X, row[key]
        if state not in SIGNS:
            ax.text(x, line, "\N{EN DASH}", ha="center", va="center", fontsize=8, color=QUIET)
            continue
        ax.plot([x], [line], linestyle="none", **SIGNS[state])
        ax.text(x + 0.17, line, exponent(row[f"{key}_most"]), fontsize=7.0, va="center", color=QUIET)


def exponent(value: float) -> str:
    """Return the power of ten nearest to a positive number on a logarithmic scale, with its sign."""
    return f"{round(math.log10(value)):+d}".replace("-", "\N{MINUS SIGN}") if value > 0 and math.isfinite(value) else ""


def ida_rows(solvers: pd.DataFrame) -> dict[str, dict[str, Any]]:
    """Return rows for IDA's runs: no order, no map of a step, and residuals above round-off."""
    rows = {}
    for row in solvers.to_dict("records"):
        numbers = {"g": row["g"], "Gv": row["Gv"], "H": row["energy"]}
        signs: dict[str, Any] = {key: LOST if key in numbers else "" for key in PROPERTIES}
        signs |= {f"{key}_most": value for key, value in numbers.items()}
        rows[str(row["method"])] = {"method": row["method"], "family": "ida", "claimed": np.nan, "order": np.nan} | signs
    return rows


def draw_key(figure: Any, states: Set[str]) -> None:
    """Draw the legend of the signs of these states, below all rows."""
    handles = [Line2D([], [], linestyle="none", label=LABELS[state], **style) for state, style in SIGNS.items() if state in states]
    figure.legend(handles=handles, loc="outside lower center", ncols=3, fontsize=8, handletextpad=0.2, columnspacing=1.2)


def draw_work(work: pd.DataFrame, folder: Path) -> Path:
    """Draw Newton iterations, evaluations and time of a step, one line per method."""
    rows = by_family(list(work["method"]))
    methods = [name for names in rows.values() for name in names]
    data = work.set_index("method").loc[methods]
    data = data.assign(evaluations=data[list(EVALUATIONS)].sum(axis=1))
    figure, axes = grid_of_axes(1, 3, ROW * (len(methods) + 6), sharey=True)
    y = np.arange(len(methods))
    titles = {"newton": "Newton iterations", "evaluations": "evaluations", "ns": "CPU time (ns)"}
    for ax, (column, title) in zip(axes[0], titles.items(), strict=True):
        ax.plot(data[column], y, color=BLUE, marker="o", linestyle="none", markersize=4.2)
        ax.set(title=title, ylim=(len(methods) - 0.4, -0.6))
        ax.set_xscale("symlog" if column == "newton" else "log")
        ax.set_xlim(-0.4 if column == "newton" else None, 1.5 * data[column].max())
        ax.grid(visible=True, axis="y", linewidth=0.4)
    axes[0, 0].set_yticks(y, methods, fontsize=7)
    edges = np.cumsum([len(names) for names in rows.values()])[:-1]
    for ax in axes[0]:
        for edge in edges:
            ax.axhline(edge - 0.5, color=QUIET, linewidth=0.6)
    return save(figure, folder, "work", data.reset_index().assign(family=[TITLES[family(name)] for name in methods]))

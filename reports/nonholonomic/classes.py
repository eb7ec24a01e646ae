"""Which method keeps the energy on which class of problems: a table of verdicts, and the errors over time."""

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pandas as pd
from markupsafe import Markup

from daebench.diagnostics.drift import BOUNDED, DRIFTS, KEPT
from daebench.draw.figures import BLUE, VERMILION, grid_of_axes, legend_below, save
from daebench.draw.methods import name_of, stroke_of
from daebench.pages.report import percent
from daebench.pages.report.claims import require
from daebench.pages.report.tables import Of, Table, code, part
from daebench.reports.nonholonomic.motions import CONTACT, IRREVERSIBLE, METHODS, MOTIONS, REVERSIBLE_SCHEMES, TRANSMISSION

GOOD = (KEPT, BOUNDED)
TITLES = {CONTACT: "contact oscillator", TRANSMISSION: "transmission"}
PANELS = [motion for motion in MOTIONS if motion[1] != "swinging"]


def check_classes(runs: pd.DataFrame) -> SimpleNamespace:
    """Test that symmetric schemes bound the energy on reversible motions and lose it on others; return what is said of all methods."""
    for row in part(runs, method=REVERSIBLE_SCHEMES).to_dict("records"):
        where = f"{row['method']} on {row['problem']}, {row['case']}"
        if row["class"] == IRREVERSIBLE:
            require(row["verdict"] == DRIFTS, f"the energy of {where} drifts", row["verdict"])
        else:
            require(row["verdict"] in GOOD, f"the energy of {where} is bounded", row["verdict"])
    good = runs[runs["verdict"].isin(GOOD)].groupby("method").size().reindex(METHODS, fill_value=0)
    both = runs[runs["verdict"].isin(GOOD) & runs["driver"].isin(GOOD)].groupby("method").size().reindex(METHODS, fill_value=0)
    every = [name for name in METHODS if good[name] == len(MOTIONS)]
    perfect = [name for name in METHODS if both[name] == len(MOTIONS)]
    uneven = part(runs, problem=TRANSMISSION, case="uneven", method="dla").iloc[0]
    require(uneven["lost"] > 0.99, "dla takes all energy from the oscillators of the uneven transmission", uneven["lost"])
    even, swinging = (part(runs, problem=TRANSMISSION, case=case, method="dla").iloc[0] for case in ("even", "swinging"))
    flattered = part(runs, problem=CONTACT, case="integrable").set_index("method")
    lost = part(runs, problem=TRANSMISSION, case="even").set_index("method")
    projected = flattered["verdict"]["gauss2+proj"] in GOOD and lost["verdict"]["gauss2+proj"] == DRIFTS
    require(projected, "gauss2+proj bounds the energy of the contact oscillator and not that of the even transmission", lost["verdict"])
    drifting = part(runs, method=("rk4+proj", "ida:index2"))["verdict"]
    require((drifting == DRIFTS).all(), "rk4+proj and ida:index2 drift on all motions", drifting.tolist())
    return SimpleNamespace(every=every, perfect=perfect, uneven=uneven, even=even, swinging=swinging, gauss=lost.loc["gauss2+proj"])


def cell(verdict: str, size: float) -> Markup:
    """Return a verdict with the size of the error."""
    return Markup("{}<br><small>{}</small>").format(verdict, percent(size))


def table(runs: pd.DataFrame) -> Table:
    """Return the verdicts, one row a method and one column a motion."""
    columns: dict[str, Any] = {"method": (code, "method")}
    frame = pd.DataFrame({"method": METHODS})
    for k, (problem, case) in enumerate(MOTIONS):
        rows = part(runs, problem=problem, case=case).set_index("method").reindex(METHODS)
        frame = frame.assign(**{f"verdict{k}": rows["verdict"].to_numpy(), f"size{k}": rows["size"].to_numpy()})
        heading = f"{TITLES[problem]}, {case}<small>{MOTIONS[problem, case]}</small>"
        columns[f"verdict{k}"] = (Of(cell, f"verdict{k}", f"size{k}"), heading)
    return Table(frame, columns, runs)


def draw_energy(series: pd.DataFrame, folder: Path) -> Path:
    """Draw the largest energy error so far over time: a row of panels for each problem, a column for each class."""
    figure, axes = grid_of_axes(2, 3, 5.0, x="time", y="energy error / mean kinetic energy", sharex=True, sharey=True)
    for ax, (problem, case) in zip(axes.flat, PANELS, strict=True):
        draw_panel(ax, part(series, problem=problem, case=case))
        ax.set_title(f"{TITLES[problem]}, {case}\n{MOTIONS[problem, case]}", fontsize=8)
    legend_below(figure, axes[0, 0], 5, columnspacing=1.3)
    return save(figure, folder, "energy", series)


def draw_panel(ax: Any, series: pd.DataFrame) -> None:
    """Draw the errors of all methods on one motion."""
    for name, history in series.groupby("method", sort=False):
        ax.plot(history["t"], history["size"], label=name_of(str(name)), markevery=(4 * len(ax.lines), 40), **stroke_of(str(name)).points())
    ax.set(xscale="log", yscale="log", ylim=(1e-9, 2))


def thumbnail(axis: Any, series: pd.DataFrame) -> None:
    """Draw the error of the Lagrange-d'Alembert scheme on a reversible and on an uneven transmission, each with its name."""
    for case, color, label in (("even", BLUE, "reversible"), ("uneven", VERMILION, "not reversible")):
        history = part(series, problem=TRANSMISSION, case=case, method="dla")
        axis.plot(history["t"], history["size"], color=color, linewidth=1.8)
        end = (history["t"].iloc[-1], history["size"].iloc[-1])
        axis.annotate(label, end, (0, 5), textcoords="offset points", ha="right", color=color)
    axis.set(xscale="log", yscale="log", ylim=(1e-3, 3), xlabel="time")
    axis.set_title("energy error, a transmission", loc="left")

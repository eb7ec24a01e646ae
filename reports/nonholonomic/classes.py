"""Which method keeps the energy on which class of problems: a table of verdicts, and the errors over time."""

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pandas as pd
from markupsafe import Markup

from daebench.diagnostics.drift import BOUNDED, DRIFTS, FAILED, KEPT
from daebench.draw.figures import BLUE, VERMILION, grid_of_axes, legend_below, save
from daebench.draw.methods import name_of, stroke_of
from daebench.pages.report import NONE, percent
from daebench.pages.report.claims import require
from daebench.pages.report.tables import Of, Table, code, part
from daebench.reports.nonholonomic.motions import CONTACT, INTEGRABLE, METHODS, MOTIONS, PAIR, PERTURBED, SHIFTED, SYMMETRIC, TRANSMISSION

GOOD = (KEPT, BOUNDED)
TITLES = {CONTACT: "contact oscillator", TRANSMISSION: "transmission"}
PANELS = list(MOTIONS)
DRIFTING = ("rk4+proj", "ida:index2", "nonholonomic_newmark")
"""Methods without symmetry whose energy drifts everywhere."""


def check_classes(runs: pd.DataFrame) -> SimpleNamespace:
    """Test that symmetric schemes bound the energy on reversible motions and on no others, and that no method bounds it on all."""
    for row in part(runs, method=SYMMETRIC).to_dict("records"):
        where = f"{row['method']} on {row['problem']}, {row['case']}"
        if row["class"] in (INTEGRABLE, PERTURBED):
            require(row["verdict"] in GOOD, f"the energy of {where} is bounded", row["verdict"])
        elif row["verdict"]:
            require(row["verdict"] == DRIFTS, f"the energy of {where} drifts", row["verdict"])
    done = runs[runs["verdict"] != ""]
    good = done["verdict"].isin(GOOD).groupby(done["method"]).all()
    require(not good.any(), "no method bounds the energy on all motions", good.to_dict())
    require_of_gni(part(done, method="gni").set_index("case"))
    for name in DRIFTING:
        verdicts = part(done, method=name)["verdict"]
        require((verdicts == DRIFTS).all(), f"{name} drifts on all motions", verdicts.tolist())
    gauss, pair = (part(runs, method=name).set_index(["problem", "case"]) for name in ("gauss2+proj", PAIR))
    projected = gauss["verdict"][CONTACT, "integrable"] in GOOD and gauss["verdict"][TRANSMISSION, "even"] == DRIFTS
    require(projected, "gauss2+proj bounds the energy of the contact oscillator and not that of the even transmission", gauss["verdict"])
    pair_drifts = pair["verdict"][TRANSMISSION, "uneven"] == DRIFTS
    require(pair_drifts, "the energy of Newmark's method and its adjoint drifts on the uneven transmission", pair["verdict"].to_dict())
    dla = part(runs, problem=TRANSMISSION, method="dla").set_index("case")
    require(dla["lost"]["uneven"] > 0.99, "dla takes all energy from the oscillators of the uneven transmission", dla["lost"].to_dict())
    moved = pair[pair["class"].isin((INTEGRABLE, PERTURBED)) & (pair["verdict"] == DRIFTS)]
    seen = {
        "moved": moved,
        "gni": part(runs, method="gni").set_index("case"),
        "pair": pair,
        "gauss": gauss,
        "dla": dla,
    }
    return SimpleNamespace(**seen, refused=runs.loc[runs["verdict"] == "", "method"].unique().tolist())


def require_of_gni(rows: pd.DataFrame) -> None:
    """Require that GNI bounds the energy of the uneven transmission, whose springs are linear, and loses it on others not reversible."""
    verdicts, sizes = rows["verdict"], rows["size"]
    reversible = rows["class"].isin((INTEGRABLE, PERTURBED))
    bounds = verdicts[reversible].isin(GOOD).all() and verdicts["uneven"] in GOOD
    require(bounds, "GNI bounds the energy on reversible motions, and on the uneven transmission", verdicts.to_dict())
    like_others = sizes["uneven"] < 2 * sizes[reversible].max()
    require(like_others, "its error on the uneven transmission is like that on others", sizes.to_dict())
    lost = verdicts[["uneven_coupled", SHIFTED]].isin((DRIFTS, FAILED)).all()
    require(lost, "it loses the energy where springs are coupled, and in other momenta", verdicts.to_dict())


def cell(verdict: str, size: float) -> Markup:
    """Return a verdict with the size of the error; an en dash for a method that does not solve the problem."""
    if not verdict:
        return Markup(NONE)
    return Markup("{}<br><small>{}</small>").format(verdict, percent(size) if size < 10 else "")


def table(runs: pd.DataFrame) -> Table:
    """Return the verdicts, one row a method and one column a motion."""
    columns: dict[str, Any] = {"method": (code, "method")}
    frame = pd.DataFrame({"method": METHODS})
    for k, (problem, case) in enumerate(MOTIONS):
        rows = part(runs, problem=problem, case=case).set_index("method").reindex(METHODS)
        frame = frame.assign(**{f"verdict{k}": rows["verdict"].to_numpy(), f"size{k}": rows["size"].to_numpy()})
        heading = f"{TITLES[problem]}, {case.replace('_', ' ')}<small>{MOTIONS[problem, case]}</small>"
        columns[f"verdict{k}"] = (Of(cell, f"verdict{k}", f"size{k}"), heading)
    return Table(frame, columns, runs)


def draw_energy(series: pd.DataFrame, folder: Path) -> Path:
    """Draw the largest energy error so far over time: a row of panels for each problem, a column for each class."""
    figure, axes = grid_of_axes(2, 4, 5.4, x="time", y="relative energy error", sharex=True, sharey=True)
    for ax, (problem, case) in zip(axes.flat, PANELS, strict=True):
        draw_panel(ax, part(series, problem=problem, case=case))
        ax.set_title(f"{TITLES[problem]},\n{case.replace('_', ' ')}:\n{MOTIONS[problem, case]}", fontsize=7.5)
    legend_below(figure, axes[0, 0], 4, columnspacing=1.3)
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

"""The free rigid body: runs on and off the sphere of constant angular momentum, and the exact curves of constant energy on it."""

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.patches import Circle

from daebench.draw.figures import BLUE, GREEN, VERMILION, grid_of_axes, save
from daebench.draw.orthographic import seen
from daebench.pages.report.claims import require
from daebench.pages.report.tables import code, part, tiny
from daebench.reports.poisson.runs import ROUND_OFF, defect, errors, ivp_of, kind, method, solve
from daebench.runs.ivp import Array

PROBLEM, CASE = "free_rigid_body", "hlw"
ORDERS = ("strang@123", "strang@132", "strang@213", "strang@231", "strang@312", "strang@321")
METHODS = (*ORDERS, "strang@top", "darboux:verlet", "midpoint", "rk4", "lifted:rattle")
H, STEPS = 0.4, 2500

SHOWN = ("midpoint", "strang@123", "strang@top", "rk4")
H_SHOWN, STEPS_SHOWN = 2.0, 400
STARTS = ((np.cos(1.1), 0.0, np.sin(1.1)), (np.cos(0.45), 0.0, np.sin(0.45)), (np.sin(0.12), np.cos(0.12), 0.0))
"""Starts about axis 3, as in the book; about axis 1; and close to the middle axis, which is unstable."""

ENERGIES = (0.12, 0.35, 0.65, 0.88)
"""Energies of the curves in the background: 0 is the smallest energy on the sphere, 1 the largest."""

AROUND = 181
DEFECT_STEPS = 3


def body(name: str) -> dict[str, object]:
    """Return the errors of the conserved quantities, and the Poisson defect, from the book's start."""
    ivp = ivp_of(PROBLEM, CASE)
    run = solve(ivp, name, H, STEPS).complete()
    deviations = errors(ivp, run)
    numbers: dict[str, object] = {"method": name, "claimed_poisson": method(name).is_poisson(ivp)}
    for quantity in ("energy", "C"):
        numbers |= {quantity: np.max(np.abs(deviations[quantity])), f"{quantity}_kind": kind(run.t, deviations[quantity])}
    return numbers | {"defect": defect(ivp, name, H, DEFECT_STEPS)}


def trajectories(name: str) -> pd.DataFrame:
    """Return the states of the runs with a large step: start, t, y1, y2, y3, and the errors of the energy and of C."""
    frames = []
    for k, y0 in enumerate(STARTS):
        ivp = ivp_of(PROBLEM, CASE, y0=y0)
        run = solve(ivp, name, H_SHOWN, STEPS_SHOWN).complete()
        deviations = errors(ivp, run)
        columns = {"method": name, "start": k, "t": run.t} | {f"y{i + 1}": run.y[:, i] for i in range(3)}
        frames.append(pd.DataFrame(columns | {"energy": deviations["energy"], "C": deviations["C"]}))
    return pd.concat(frames, ignore_index=True)


def polhodes() -> pd.DataFrame:
    """Return the curves in which ellipsoids of constant energy meet the unit sphere: energy, curve, y1, y2, y3.

    About axis 3 for 2 E I2 < 1, about axis 1 for 2 E I2 > 1, on either side; two great circles, the separatrices, between them.
    """
    ivp = ivp_of(PROBLEM, CASE)
    e1, e2, e3 = (1 / moment for moment in ivp.parameters.values())
    levels = [(e3 + share * (e1 - e3)) / 2 for share in ENERGIES]
    starts = [float(ivp.value("H", y0)) for y0 in STARTS]
    frames = []
    for energy in (*levels, e2 / 2, *starts):
        for side, curve in zip(("+", "-"), polhode(energy, (e1, e2, e3)), strict=True):
            drawn = "start" if energy in starts else "separatrix" if energy == e2 / 2 else "level"
            columns = {"drawn": drawn, "energy": energy, "side": side} | {f"y{i + 1}": curve[i] for i in range(3)}
            frames.append(pd.DataFrame(columns))
    return pd.concat(frames, ignore_index=True)


def polhode(energy: float, e: tuple[float, float, float]) -> tuple[Array, Array]:
    """Return both curves of an energy on the unit sphere, shape(3, n) each; e has the inverse moments of inertia, falling."""
    phi = np.linspace(0, 2 * np.pi, AROUND)
    near, far = (2, 0) if 2 * energy <= e[1] else (0, 2)
    y = np.empty((3, AROUND))
    y[far] = np.sqrt((2 * energy - e[near]) / (e[far] - e[near])) * np.cos(phi)
    y[1] = np.sqrt((2 * energy - e[near]) / (e[1] - e[near])) * np.sin(phi)
    y[near] = np.sqrt(np.maximum(0, 1 - y[far] ** 2 - y[1] ** 2))
    other = y.copy()
    other[near] *= -1
    return y, other


COLORS, MARKERS = (BLUE, GREEN, VERMILION), ("o", "^", "D")
AXES = ("y1", "y2", "y3")
LABEL = {"boxstyle": "round,pad=0.1", "facecolor": "#f6f6f3", "edgecolor": "none", "alpha": 0.8}
REACH = 1.28
"""Length of the drawn axes."""


def draw_sphere(trajectories: pd.DataFrame, polhodes: pd.DataFrame, folder: Path) -> Path:
    """Draw four methods, one sphere each: energy curves thin, those of the starts broad, states as dots; the rear is paler."""
    figure, axes = grid_of_axes(2, 2, 7.2)
    for ax, name in zip(axes.flat, SHOWN, strict=True):
        globe(ax)
        for (drawn, _, _), curve in polhodes.groupby(["drawn", "energy", "side"], sort=False):
            line(ax, seen(curve[list(AXES)].to_numpy()), str(drawn))
        for k, (color, marker) in enumerate(zip(COLORS, MARKERS, strict=True)):
            states = part(trajectories, method=name, start=k)
            dots(ax, seen(states[list(AXES)].to_numpy()), color, marker)
        ax.set_title(name, loc="center")
    handles = [
        axes[0, 0].plot([], [], linestyle="none", marker=marker, markersize=4.5, color=color)[0]
        for color, marker in zip(COLORS, MARKERS, strict=True)
    ]
    handles.append(axes[0, 0].plot([], [], color="#b0b0b0", linewidth=2.2)[0])
    handles.append(axes[0, 0].plot([], [], color="#555555", linewidth=1.0, linestyle=(0, (4, 2)))[0])
    labels = ["about axis 3", "about axis 1", "near axis 2", "exact", "separatrix"]
    assert len(STARTS) == len(COLORS)
    figure.legend(handles, labels, loc="outside lower center", ncols=5, columnspacing=1.5)
    return save(figure, folder, "sphere", sphere_data(trajectories, polhodes))


def globe(ax: Any) -> None:
    """Draw the outline of the sphere and the axes of the body, named, in units of |y0|."""
    ax.add_patch(Circle((0, 0), 1, facecolor="#f6f6f3", edgecolor="#777777", linewidth=0.8, zorder=0))
    for axis, name in zip(np.eye(3), ("$y_1$", "$y_2$", "$y_3$"), strict=True):
        tip, pole = seen(REACH * axis[None])[0], seen(axis[None])[0]
        ax.annotate("", xy=tip[:2], xytext=pole[:2], arrowprops={"arrowstyle": "-|>", "color": "black", "linewidth": 0.8}, zorder=4)
        ax.plot([0, pole[0]], [0, pole[1]], color="#999999", linewidth=0.6, linestyle=(0, (1, 2)), zorder=1)
        ax.text(*(tip[:2] + 0.09 * tip[:2] / np.linalg.norm(tip[:2])), name, ha="center", va="center", zorder=6, bbox=LABEL)
    ax.set(xlim=(-1.3, 1.3), ylim=(-1.15, 1.35), aspect="equal")
    ax.axis("off")


def line(ax: Any, curve: Array, drawn: str) -> None:
    """Draw a curve on the sphere, pale at the rear."""
    styles = {"level": ("#9a9a9a", 0.6, "-"), "separatrix": ("#555555", 1.0, (0, (4, 2))), "start": ("#b0b0b0", 2.2, "-")}
    color, width, dashes = styles[drawn]
    for front, alpha, order in ((True, 1.0, 2), (False, 0.22, 1)):
        hidden = np.where(((curve[:, 2] >= 0) == front)[:, None], curve, np.nan)
        ax.plot(hidden[:, 0], hidden[:, 1], color=color, linewidth=width, linestyle=dashes, alpha=alpha, zorder=order)


def dots(ax: Any, points: Array, color: str, marker: str) -> None:
    """Draw the states of a run, those in front above those behind."""
    for front, alpha, order in ((True, 1.0, 3), (False, 0.25, 1.5)):
        hemisphere = points[(points[:, 2] >= 0) == front]
        style = {"linestyle": "none", "marker": marker, "markersize": 2.0, "markeredgewidth": 0, "color": color}
        ax.plot(hemisphere[:, 0], hemisphere[:, 1], alpha=alpha, zorder=order, **style)


def sphere_data(trajectories: pd.DataFrame, polhodes: pd.DataFrame) -> pd.DataFrame:
    """Return the data of the picture: states by method, start and time, and the exact curves."""
    curves = polhodes.assign(method="exact: " + polhodes["drawn"])
    columns = ["method", "start", "t", "energy", "side", *AXES]
    return pd.concat([trajectories.drop(columns=["energy", "C"]), curves], ignore_index=True).reindex(columns=columns).round(6)


VISIBLE = 1e-7
"""A larger defect is not round-off."""

ENERGY_RANGE = (1 / 0.6 - 1) / 2
"""Range of the energy on the unit sphere, for the moments 0.6, 0.8 and 1."""


def check_body(frame: pd.DataFrame, trajectories: pd.DataFrame) -> SimpleNamespace:
    """Test which methods stay on the sphere, keep the energy, and are Poisson maps; lifted RATTLE has all three properties."""
    rows: dict[Any, Any] = {row["method"]: row for row in frame.to_dict("records")}
    for name, row in rows.items():
        if row["claimed_poisson"]:
            good = row["C"] <= ROUND_OFF and row["defect"] <= ROUND_OFF
            require(good, f"{name} stays on the sphere as a Poisson map", (row["C"], row["defect"]))
    for name in (*ORDERS, "strang@top", "darboux:verlet"):
        require(rows[name]["energy_kind"] == "bounded", f"{name} bounds the energy", rows[name]["energy_kind"])
    for name in ("midpoint", "lifted:rattle"):
        both = max(rows[name]["energy"], rows[name]["C"])
        require(both <= ROUND_OFF, f"{name} keeps energy and Casimir function", both)
    require(rows["midpoint"]["defect"] > VISIBLE, "midpoint is not a Poisson map", rows["midpoint"]["defect"])
    require(rows["lifted:rattle"]["claimed_poisson"], "RATTLE on the constrained system claims to be a Poisson map", "no claim")
    for quantity in ("energy", "C"):
        require(rows["rk4"][f"{quantity}_kind"] == "linear", f"rk4 loses {quantity} linearly", rows["rk4"][f"{quantity}_kind"])
    energies = {name: rows[name]["energy"] for name in ORDERS}
    best, worst = min(energies, key=energies.__getitem__), max(energies, key=energies.__getitem__)
    factor = energies[worst] / energies[best]
    require(factor > 3, "the order of the factors changes the energy error over threefold", f"a factor of {factor:.3g}")
    require(
        rows["strang@top"]["energy"] < energies[best], "the symmetric top is more accurate than every order", rows["strang@top"]["energy"]
    )
    return SimpleNamespace(row=rows, best=best, worst=worst, factor=factor, **check_picture(trajectories))


def check_picture(trajectories: pd.DataFrame) -> dict[str, float]:
    """Test that with the large step of the picture only rk4 leaves the sphere."""
    length = np.sqrt((trajectories[["y1", "y2", "y3"]] ** 2).sum(axis=1))
    rk4_mask = trajectories["method"] == "rk4"
    off = float((length[~rk4_mask] - 1).abs().max())
    require(off <= ROUND_OFF, "all methods of the picture but rk4 stay on the sphere", f"a distance of {off:.2e}")
    last = trajectories["t"] == trajectories["t"].max()
    require(length[rk4_mask & last].max() < 0.95, "rk4 ends over 5 % below the sphere from every start", length[rk4_mask & last].tolist())
    energy = {str(name): float(rows["energy"].abs().max()) for name, rows in trajectories.groupby("method")}
    require(energy["midpoint"] <= ROUND_OFF, "midpoint is on the energy curves", f"{energy['midpoint']:.2e}")
    shifted, tilted = energy["strang@top"] / ENERGY_RANGE, energy["strang@123"] / ENERGY_RANGE
    require(shifted < 0.15, "the energy error of strang@top is below 15 % of the range on the sphere", f"{shifted:.3g}")
    require(tilted > 0.5, "the energy error of strang@123 is over half of the range on the sphere", f"{tilted:.3g}")
    lengths = {"off": off, "shortest": float(length[rk4_mask & last].min()), "longest": float(length[rk4_mask & last].max())}
    return lengths | {"tilted": energy["strang@123"], "shifted": energy["strang@top"]}


COLUMNS = {
    "method": code,
    "C": (tiny, "Casimir function<small>largest error</small>"),
    "C_kind": "<small>which is</small>",
    "energy": (tiny, "energy<small>largest error</small>"),
    "energy_kind": "<small>which is</small>",
    "defect": (tiny, "Poisson defect<small>of 3 steps</small>"),
}

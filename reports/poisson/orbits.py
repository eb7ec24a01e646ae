"""HLW Fig. 4.1: predator and prey with h = 0.25, the exact orbits beneath, and the form of symplectic Euler that leaves the domain."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pandas as pd

from daebench.diagnostics.drift import LAWS
from daebench.diagnostics.energy import energy_drift
from daebench.diagnostics.section import closure, section
from daebench.draw.figures import BLUE, QUIET, VERMILION, grid_of_axes, save
from daebench.pages.report import count, number
from daebench.pages.report.claims import require
from daebench.pages.report.tables import Table, code, part, text
from daebench.reports.poisson.runs import errors, ivp_of, solve
from daebench.runs.ivp import Array, PoissonIvp
from daebench.runs.trajectory import PoissonTrajectory
from daebench.systems.lazily import scipy

CASES = ("4,2", "6,2")
METHODS = ("symplectic_euler_adjoint", "verlet", "midpoint")
"""The three panels of HLW Fig. 4.1."""

PRINTED = "symplectic_euler"
"""The method as Example 4.7 prints it."""

H, STEPS = 0.25, 1000
AROUND = 361
FOLLOWED = 5
"""Closure is measured on a run this many times as long: crossings return to their place only after tens of revolutions."""


@dataclass(frozen=True)
class Orbits:
    """Fig. 4.1 in numbers."""

    points: pd.DataFrame
    """case, method, t, u, v, energy: all states of the runs, with the energy error."""
    exact: pd.DataFrame
    """case, u, v: the level curves of H."""
    table: pd.DataFrame
    """One row per case and method: whether and where the run ended, the error of the energy, how well the orbit closes."""


def orbits(steps: int = STEPS) -> Orbits:
    """Return the runs of Fig. 4.1 and of the printed form."""
    points, exact, rows = [], [], []
    for case in CASES:
        ivp = ivp_of("lotka_volterra", case)
        exact.append(level_curve(ivp).assign(case=case))
        for name in (PRINTED, *METHODS):
            run = solve(ivp, name, H, steps)
            energy = errors(ivp, run)["energy"]
            points.append(pd.DataFrame({"case": case, "method": name, "t": run.t, "u": run.y[:, 0], "v": run.y[:, 1], "energy": energy}))
            drift = energy_drift(run.t, energy)
            numbers = {"most": np.max(np.abs(energy)), "kind": drift.brief, "slope": drift.slope, "left": left(ivp, run.y)}
            numbers |= {"steps": run.steps, "t": run.t[-1], "failure": run.failure or ""} | (
                closed(ivp, solve(ivp, name, H, FOLLOWED * steps)) if not run.failure else {}
            )
            last = run.y[-1]
            u_next, v_next = printed_step(last, H, ivp.parameters) if name == PRINTED and run.failure else (np.nan, np.nan)
            rows.append({"case": case, "method": name, "u": last[0], "v": last[1], "u_next": u_next, "v_next": v_next} | numbers)
    return Orbits(pd.concat(points, ignore_index=True), pd.concat(exact, ignore_index=True), pd.DataFrame(rows))


def printed_step(y: Array, h: float, parameters: Mapping[str, float]) -> tuple[float, float]:
    """Return the next state of symplectic Euler of HLW Ex. 4.7, solved by hand: its implicit equation is linear in u1.

    ::

        u1 = u + h u1 (v - b)      v1 = v - h v (u1 - a)
    """
    u1 = y[0] / (1 - h * (y[1] - parameters["b"]))
    return float(u1), float(y[1] - h * y[1] * (u1 - parameters["a"]))


def level_curve(ivp: PoissonIvp) -> pd.DataFrame:
    """Return the exact orbit: the curve on which H has its value at the start.

    In logarithms H is convex about the equilibrium, so each ray from the equilibrium meets the curve once.
    """
    centre = np.log([ivp.parameters["a"], ivp.parameters["b"]])
    level = float(ivp.value("H", ivp.y0))
    points = []
    for angle in np.linspace(0, 2 * np.pi, AROUND):
        ray = np.array([np.cos(angle), np.sin(angle)])
        points.append(np.exp(centre + scipy.optimize.brentq(partial(above, ivp, centre, ray, level), 1e-3, 50.0, xtol=1e-13) * ray))
    return pd.DataFrame(points, columns=["u", "v"])


def above(ivp: PoissonIvp, centre: Array, ray: Array, level: float, r: float) -> float:
    """Return H minus a level at the distance r along a ray, in logarithms."""
    return float(ivp.value("H", np.exp(centre + r * ray)) - level)


def closed(ivp: PoissonIvp, run: PoissonTrajectory) -> dict[str, Any]:
    """Return how well the orbit of a run closes, from its crossings of the line v = b beyond the equilibrium."""
    orbit_closure = closure(section(ivp, run, center=(ivp.parameters["a"], ivp.parameters["b"]), direction=(1, 0)))
    wander = orbit_closure.drift.slope * float(run.t[-1])
    return {
        "revolutions": orbit_closure.revolutions,
        "period": orbit_closure.period,
        "spread": orbit_closure.spread,
        "wander": wander,
        "orbit": orbit_closure.drift.brief,
    }


def left(ivp: PoissonIvp, y: Array) -> float:
    """Return the remaining fraction of the energy above the equilibrium: its mean over the last tenth of a run, relative to the start."""
    level = ivp.along("H", y)
    lowest = float(ivp.value("H", [ivp.parameters["a"], ivp.parameters["b"]]))
    return float((np.mean(level[-max(1, len(level) // 10) :]) - lowest) / (level[0] - lowest))


COLORS = dict(zip(CASES, (BLUE, VERMILION), strict=True))
NAMES = {
    "symplectic_euler_adjoint": "symplectic Euler, adjoint",
    "verlet": "Störmer\N{EN DASH}Verlet",
    "midpoint": "implicit midpoint",
    PRINTED: "symplectic Euler as printed",
}
LIMITS = {"xlim": (-0.4, 9.6), "ylim": (-1.4, 9.4)}


def draw_orbits(orbits: Orbits, folder: Path) -> Path:
    """Draw Fig. 4.1 and, in a fourth panel, the form that leaves the domain; exact orbits in grey beneath."""
    figure, axes = grid_of_axes(2, 2, 6.4, x="predators $u$", y="prey $v$", sharex=True, sharey=True)
    for ax, name in zip(axes.flat, (*METHODS, PRINTED), strict=True):
        ax.axhspan(-3, 0, color="#eeeeee", zorder=0, linewidth=0)
        ax.axvspan(-3, 0, color="#eeeeee", zorder=0, linewidth=0)
        for case in CASES:
            exact = orbits.exact[orbits.exact["case"] == case]
            ax.plot(exact["u"], exact["v"], color="#a8a8a8", linewidth=2.4, zorder=1, solid_capstyle="round")
            orbit = part(orbits.points, case=case, method=name)
            marker = "o" if case == CASES[0] else "D"
            ax.plot(
                orbit["u"], orbit["v"], linestyle="none", marker=marker, markersize=1.7, markeredgewidth=0, color=COLORS[case], zorder=3
            )
            ax.plot(
                orbit["u"].iloc[0], orbit["v"].iloc[0], marker=marker, markersize=5, markerfacecolor="white", color=COLORS[case], zorder=4
            )
        ax.set(title=NAMES[name], **LIMITS)
    for row in orbits.table[orbits.table["method"] == PRINTED].to_dict("records"):
        draw_leap(axes[1, 1], row)
    axes[0, 0].text(9.5, -0.25, "outside the domain", color=QUIET, fontsize=8, ha="right", va="top")
    axes[0, 0].plot([], [], color="#a8a8a8", linewidth=2.4, label="exact")
    for case in CASES:
        marker = "o" if case == CASES[0] else "D"
        axes[0, 0].plot([], [], marker=marker, markersize=4, linestyle="none", color=COLORS[case], label=f"from ({case})")
    axes[0, 0].legend(loc="upper right")
    return save(figure, folder, "orbits", shown(orbits))


def draw_orbit(ax: Any, orbits: Orbits, name: str) -> None:
    """Draw the orbits of one method, exact ones in grey beneath."""
    for case in CASES:
        exact, orbit = orbits.exact[orbits.exact["case"] == case], orbits.points[orbits.points["case"] == case]
        ax.plot(exact["u"], exact["v"], color="#a8a8a8", linewidth=3.0)
        states = orbit[orbit["method"] == name]
        ax.plot(states["u"], states["v"], linestyle="none", marker="o", markersize=1.6, markeredgewidth=0, color=COLORS[case])
    ax.set_title("predators and prey", loc="left")
    ax.set(xticks=[0, 5], yticks=[0, 5])


def draw_leap(ax: Any, row: dict[Any, Any]) -> None:
    """Draw the step that would leave the domain, up to the edge of the panel."""
    begin, end = np.array([row["u"], row["v"]]), np.array([row["u_next"], row["v_next"]])
    share = min(1.0, (begin[1] - LIMITS["ylim"][0]) / (begin[1] - end[1]))
    shown_end = begin + share * (end - begin)
    arrow = {"arrowstyle": "-|>", "color": COLORS[row["case"]], "linewidth": 1.4, "shrinkA": 3, "shrinkB": 0}
    ax.annotate("", xy=tuple(shown_end), xytext=tuple(begin), arrowprops=arrow, zorder=5)
    ax.text(*(begin + 0.62 * (shown_end - begin) + [0.2, 0]), f"step {row['steps'] + 1}", color=COLORS[row["case"]], fontsize=8)


def shown(orbits: Orbits) -> pd.DataFrame:
    """Return the data of the figure: states of the runs by step, and the exact curves, with four digits after the point."""
    steps = orbits.points.groupby(["case", "method"]).cumcount()
    runs = orbits.points.assign(step=steps)[["case", "method", "step", "u", "v"]]
    exact = orbits.exact.assign(method="exact", step=-1)[["case", "method", "step", "u", "v"]]
    return pd.concat([runs, exact], ignore_index=True).round(4)


def draw_energy(orbits: Orbits, folder: Path) -> Path:
    """Draw the energy error over time of the three methods, both orbits in each panel."""
    figure, axes = grid_of_axes(2, 3, 4.2, x="time $t$", sharex=True, sharey="row")
    points = orbits.points[orbits.points["method"].isin(METHODS)]
    for row, case in zip(axes, reversed(CASES), strict=True):
        for ax, name in zip(row, METHODS, strict=True):
            orbit = part(points, case=case, method=name)
            ax.axhline(0, color=QUIET, linewidth=0.8)
            ax.plot(orbit["t"], orbit["energy"], color=COLORS[case], linewidth=0.6)
        row[0].set_ylabel(f"energy error, from ({case})")
    for ax, name in zip(axes[0], METHODS, strict=True):
        ax.set_title(NAMES[name])
    return save(figure, folder, "energy", points[["case", "method", "t", "energy"]])


TREND = 0.5
"""A fitted line accounts for more than this part of the largest change where the change is said to be a trend."""


def check_orbits(orbits: Orbits) -> SimpleNamespace:
    """Test that the printed form leaves the domain, that two methods close their orbits, and that midpoint does not."""
    rows = {(row["case"], row["method"]): row for row in orbits.table.to_dict("records")}
    inner, outer = (rows[case, PRINTED] for case in CASES)
    for case, row in zip(CASES, (inner, outer), strict=True):
        require(
            "left the domain" in row["failure"], f"the printed form leaves the domain from ({case})", row["failure"] or "a complete run"
        )
        require(min(row["u_next"], row["v_next"]) <= 0, "its next step is beyond the axis", (row["u_next"], row["v_next"]))
    require(outer["steps"] == 0, "from (6,2) it does so in its first step", f"{outer['steps']} steps")
    require(inner["steps"] > 0, "from (4,2) it does so later", f"{inner['steps']} steps")
    for (case, name), row in rows.items():
        if name in METHODS:
            require(row["failure"] == "", f"{name} takes every step from ({case})", row["failure"])
        if name in ("symplectic_euler_adjoint", "verlet"):
            both = {row["kind"], row["orbit"]}
            require(both == {"bounded"}, f"{name} bounds the energy and closes the orbit from ({case})", both)
        if name == "midpoint":
            lost, inwards = -row["slope"] * row["t"] / row["most"], -row["wander"] / row["spread"]
            require(row["kind"] in LAWS and lost > TREND, "midpoint loses energy for good", (row["kind"], lost))
            require(row["orbit"] in LAWS and inwards > TREND, "its orbit spirals inwards", (row["orbit"], inwards))
            require(row["left"] < 0.95, "midpoint loses over 5 % of the energy above the equilibrium", row["left"])
    chosen: dict[str, Any] = {name: SimpleNamespace(**{case[0]: rows[case, name] for case in CASES}) for name in METHODS}
    least = min(row["revolutions"] for (_, name), row in rows.items() if name in METHODS)
    return SimpleNamespace(inner=inner, outer=outer, least_revolutions=least, row={key: vars(value) for key, value in chosen.items()})


def table(frame: pd.DataFrame) -> Table:
    """Return the table of the orbits of Fig. 4.1."""
    orbits = frame[frame["method"].isin(METHODS)]
    return Table(
        orbits,
        {
            "method": code,
            "case": ("({})".format, "from"),
            "revolutions": count,
            "period": partial(number, digits=3),
            "spread": (number, "crossings<small>spread in u</small>"),
            "wander": (number, "drift<small>over the run</small>"),
            "orbit": text,
            "most": (number, "energy<small>largest error</small>"),
            "kind": "energy<small>becomes</small>",
        },
        frame,
    )

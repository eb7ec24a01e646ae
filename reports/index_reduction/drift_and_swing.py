"""HLW Figs. 1.1 and 1.2: the energy over time of schemes with and without constraints, and the swing of both Euler methods."""

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pandas as pd
from markupsafe import Markup

from daebench.diagnostics.energy import energy_drift
from daebench.draw.figures import QUIET, grid_of_axes, legend_below, save
from daebench.draw.methods import name_of
from daebench.pages.report import with_error
from daebench.pages.report.claims import require
from daebench.pages.report.tables import Columns, Of, code, tiny
from daebench.reports.index_reduction.schemes import DRIFT_RUNS, FAST, NAMES, OTHER_FAST, ROUND_OFF, STROKE, T_LONG, VISIBLE, Numbers


def check_drift(numbers: Numbers, table: pd.DataFrame) -> SimpleNamespace:
    """Return the numbers of Fig. 1.1: the energy error is linear with ``se`` and ``seproj``, and bounded with the constrained schemes."""
    se, seproj = numbers.drift_fit["se"], table.loc["seproj"]
    away = energy_drift(numbers.drift["se"]["t"], numbers.drift["se"]["distance"])
    require(se.law == "linear", "the energy of se drifts linearly", f"{se.brief}, exponent {se.exponent:.3f}")
    require(away.law == "linear", "se leaves the manifold linearly", f"{away.brief}, exponent {away.exponent:.3f}")
    require(seproj["kind"] == "linear", "the energy of seproj drifts linearly", f"{seproj['kind']}, exponent {seproj['growth']:.3f}")
    ratio = numbers.facts["se_slope_same_h"] / seproj["slope"]
    require(ratio >= 10, "the projection improves the slope at least tenfold", f"a factor of {ratio:.3g}")
    doubtful = abs(seproj["growth_short"] - 1) > 0.25 or seproj["growth_short_error"] > 0.25
    for name in ("L3", "Gv"):
        require(table[name]["se"] <= ROUND_OFF, f"se keeps {name}", f"{table[name]['se']:.2e}")
    require(table["L3"]["seproj"] >= VISIBLE, "the projection changes L3", f"{table['L3']['seproj']:.2e}")
    for name in ("seproj", "symplectic_euler", "rattle"):
        most = numbers.drift[name]["distance"].max()
        require(most <= ROUND_OFF, f"{name} stays on the manifold", f"a distance of {most:.2e}")
    for name in ("symplectic_euler", "rattle"):
        fit = numbers.drift_fit[name]
        require(fit.verdict == "bounded", f"the energy of {name} is bounded", fit.brief)
        most = numbers.drift[name]["energy_error"].abs().max()
        require(fit.change_bound < most, f"the mean of {name} changes by less than its energy error", f"{fit.change_bound:.2e}")
    bounds = {name: numbers.drift_fit[name].change_bound for name in ("symplectic_euler", "rattle")}
    return SimpleNamespace(
        bounds=bounds, se=se, away=away, ratio=ratio, doubtful=doubtful, distance=numbers.drift["se"]["distance"].iloc[-1]
    )


def check_swing(numbers: Numbers) -> SimpleNamespace:
    """Return the numbers of Fig. 1.2, from both tangent starts: one motion stays regular, the other decays."""
    swings = (numbers.swing, numbers.facts["other_swing"])
    first, other = (swing_numbers(swing, numbers.facts["periods"][case]) for swing, case in zip(swings, (FAST, OTHER_FAST), strict=True))
    for case, summary in ((FAST, first), ("fig1.2b", other)):
        require(summary.kind == "bounded", f"symplectic Euler bounds the energy on {case}", summary.kind)
        require(summary.regular < 0.05, f"its swings on {case} are equally high to 5 %", f"{summary.regular:.3g}")
        require(summary.falling, f"implicit Euler loses energy in every step on {case}", "a gain")
        require(
            summary.lost_at_once > 0.01,
            f"implicit Euler loses over 1 % of its energy in one period on {case}",
            f"{summary.lost_at_once:.2%}",
        )
        require(summary.lost_at_once > 5 * summary.wobble, f"that is more than symplectic Euler's error on {case}", f"{summary.wobble:.2%}")
    require(numbers.facts["se_stops"], "se has no solution on fig1.2", "a complete run")
    return SimpleNamespace(first=first, other=other, stops_at=numbers.facts["se_stops_at"])


def swing_numbers(swing: pd.DataFrame, period: float) -> SimpleNamespace:
    """Return regularity and losses of a pair of runs; energies are counted from the lowest point and relative to the start.

    The period is that of the exact motion.
    """
    t, q3 = swing["t"].to_numpy(), swing["q3_symplectic_euler"].to_numpy()
    tops = np.flatnonzero((q3[1:-1] > q3[:-2]) & (q3[1:-1] >= q3[2:])) + 1
    good, bad = (
        (swing[f"energy_{name}"].to_numpy() + 1) / (swing[f"energy_{name}"][0] + 1) for name in ("symplectic_euler", "implicit_euler")
    )
    return SimpleNamespace(
        period=period,
        periods=float(t[-1]) / period,
        regular=np.ptp(q3[tops]) / np.ptp(q3),
        kind=energy_drift(t, good - 1).verdict,
        wobble=np.max(np.abs(good - 1)),
        falling=np.all(np.diff(bad) < 0),
        lost_at_once=1 - np.interp(period, t, bad),
        lost=1 - bad[-1],
    )


TIME = r"time $t$  [$\sqrt{\ell/\gamma}$]"


ENERGY = r"energy error  [$m\gamma\ell$]"


WINDOW = 3.0


CLEAR = 3.0
"""Standard errors from which on the slope of a line counts as different from zero."""


def draw_energy(numbers: Numbers, folder: Path) -> Path:
    """Draw the energy error of the four runs, each on a separate linear scale, with the fitted line."""
    figure, axes = grid_of_axes(2, 2, 4.3, x=TIME, y=ENERGY, sharex=True)
    for ax, (name, h) in zip(axes.flat, DRIFT_RUNS.items(), strict=True):
        run, fit, stroke = numbers.drift[name], numbers.drift_fit[name], STROKE[name]
        ax.axhline(0, color=QUIET, linewidth=0.8)
        ax.plot(run["t"], run["energy_error"], color=stroke.color, linewidth=1.0)
        if abs(fit.slope) > CLEAR * fit.slope_error:
            line = fit.slope * (run["t"] - run["t"].mean()) + run["energy_error"].mean()
            ax.plot(run["t"], line, color="black", linewidth=1.1, linestyle=(0, (5, 2)))
        ax.set_title(f"{NAMES[name]}, $h$ = {h:g}")
        ax.margins(x=0.01)
    figure.align_ylabels()
    return save(figure, folder, "energy", long_table(numbers))


def draw_together(numbers: Numbers, folder: Path) -> Path:
    """Draw all four runs on common logarithmic scales: the largest energy error, and the largest distance, in a window."""
    figure, axes = grid_of_axes(1, 2, 3.5, sharex=True)
    columns: dict[str, Any] = {}
    for ax, quantity, label in zip(axes[0], ("energy_error", "distance"), (ENERGY, "distance from the manifold"), strict=True):
        for k, (name, h) in enumerate(DRIFT_RUNS.items()):
            t, most = windows(numbers.drift[name], quantity)
            columns |= {"t": t, f"{quantity}_{name}": most}
            ax.plot(t, np.maximum(most, 1e-17), label=f"{NAMES[name]}, $h$ = {h:g}", markevery=(k, 4), **STROKE[name].points())
        ax.set(yscale="log", xlabel=TIME, ylabel=f"largest |{label}|" if quantity == "energy_error" else f"largest {label}")
    axes[0, 1].axhspan(1e-17, 2.3e-16, color="#eeeeee", zorder=0)
    axes[0, 1].text(99, 3.4e-16, "round-off", ha="right", va="bottom", color=QUIET, fontsize=8)
    axes[0, 1].set_ylim(1e-17, 1e-1)
    legend_below(figure, axes[0, 0], 2)
    return save(figure, folder, "drift", columns)


def draw_swing(swing: pd.DataFrame, folder: Path) -> Path:
    """Draw the height of the pendulum for both Euler methods, and their energies."""
    figure, axes = grid_of_axes(3, 1, 4.7, sharex=True)
    strokes = {name: STROKE[name] for name in ("symplectic_euler", "implicit_euler")}
    low, high = swing[["q3_symplectic_euler", "q3_implicit_euler"]].min().min(), swing["q3_symplectic_euler"].max()
    for ax, name in zip(axes[:2, 0], strokes, strict=True):
        ax.plot(swing["t"], swing[f"q3_{name}"], color=strokes[name].color)
        ax.set(ylabel=r"height $q_3$  [$\ell$]", ylim=(low - 0.08, high + 0.08), title=NAMES[name])
    for name, stroke in strokes.items():
        axes[2, 0].plot(swing["t"], swing[f"energy_{name}"], label=NAMES[name], **stroke.line())
    axes[2, 0].set(ylabel=r"energy $H$  [$m\gamma\ell$]", xlabel=TIME, title="energy of both", ylim=(0, None))
    axes[2, 0].legend(loc="center right")
    axes[2, 0].margins(x=0.01)
    figure.align_ylabels()
    return save(figure, folder, "swing", swing)


def windows(run: pd.DataFrame, quantity: str) -> tuple[Any, Any]:
    """Return the middles of windows of time and the largest modulus in each."""
    index = (run["t"] / WINDOW).astype(int)
    groups = run[quantity].abs().groupby(index.where(index < round(run["t"].iloc[-1] / WINDOW), index.max() - 1))
    return (np.array(list(groups.groups)) + 0.5) * WINDOW, groups.max().to_numpy()


def long_table(numbers: Numbers) -> pd.DataFrame:
    """Return the four runs below one another."""
    return pd.concat([frame.assign(method=name, h=DRIFT_RUNS[name]) for name, frame in numbers.drift.items()], ignore_index=True)


def thumbnail(axis: Any, numbers: Numbers) -> None:
    """Draw the energy errors of the four runs, each with its name."""
    for name, h in DRIFT_RUNS.items():
        t, most = windows(numbers.drift[name], "energy_error")
        axis.plot(t, most, color=STROKE[name].color, linewidth=1.6)
        axis.text(1.02 * t[-1], most[-1], f"{name_of(name)}, $h$ = {h:g}", color=STROKE[name].color, fontsize=6.5, va="center")
    axis.set(yscale="log", xticks=[0, 50, 100])
    axis.minorticks_off()
    axis.spines["right"].set_visible(False)
    axis.set_title("energy error over time, pendulum", loc="left")


def growth(exponent: float, error: float, kind: str) -> Markup:
    """Return the growth exponent in words or as a number."""
    return Markup("{} ({})").format(with_error(exponent, error), kind) if np.isfinite(exponent) else Markup(kind)


DRIFT: Columns = {
    "method": (code, "scheme"),
    "energy_error": (tiny, "energy error<small>largest</small>"),
    "slope": (Of(with_error, "slope", "slope_error"), "slope<small>per unit of time</small>"),
    "growth": (Of(growth, "growth", "growth_error", "kind"), f"growth exponent<small>to t = {T_LONG:g}</small>"),
    "g": (tiny, "|<i>g</i>|<small>largest</small>"),
    "Gv": (tiny, "|<i>G H<sub>p</sub></i>|<small>largest</small>"),
    "L3": (tiny, "<i>L</i><sub>3</sub> error<small>largest</small>"),
}
"""The errors of energy, constraints and angular momentum."""

"""Sentences of B. Hess on energy drift and constraints, gmx-developers, April and October 2006, tested on single molecules."""

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.lines import Line2D

from daebench.diagnostics.random_walk import WALK
from daebench.draw.figures import QUIET, grid_of_axes, save
from daebench.draw.methods import name_of, stroke_of
from daebench.pages.report.claims import require
from daebench.pages.report.tables import part
from daebench.reports.molecules.laws import CLEAR, clear, fit
from daebench.reports.molecules.motions import (
    BUTANE,
    COMPENSATED,
    DIFFERENCES,
    GAUSS_SEIDEL,
    LINCS,
    MIDDLE,
    MIXED,
    MULTIPLIERS,
    SETTLE,
    SINGLE,
    TITLES,
    USUAL,
    WATER,
)
from daebench.reports.molecules.tolerance import CHANGE, MARKERS

ONCE = 0.5
"""A change that grows by less than this part of it in the last seven eighths of the time was there from the beginning."""

INVERSE = (-1.4, -0.6)
"""Exponents of the step that are said to be about -1."""

UNBIASED = 3.5
"""A mean within so many of its standard errors is none."""


def check_hess(runs: pd.DataFrame) -> SimpleNamespace:
    """Return the numbers on sentences of Hess; the first sentence of the text that does not hold raises ClaimRefuted."""
    return SimpleNamespace(diffusive=check_diffusive(runs), always=check_always(runs), smaller=check_smaller(runs))


def single(runs: pd.DataFrame, molecule: str, scheme: str, velocities: str) -> pd.DataFrame:
    """Return the rows of a scheme in single precision, with the usual tolerance where it has one, by the step."""
    rows = part(runs, molecule=molecule, scheme=scheme, velocities=velocities)
    return rows[(rows["precision"] == SINGLE) & (rows["tolerance"].isna() | (rows["tolerance"] == USUAL))].sort_values("h")


def middle(rows: pd.DataFrame) -> Any:
    """Return the row of the middle step."""
    return rows[rows["h"] == MIDDLE].iloc[0]


def check_diffusive(runs: pd.DataFrame) -> SimpleNamespace:
    """Test "diffusive and does not go down systematically": rounding alone is, and SHAKE at the usual tolerance is on water alone."""
    walk = middle(single(runs, WATER, SETTLE, MULTIPLIERS))
    require(
        WALK[0] < walk["alpha"] < WALK[1] and abs(walk["mean"]) <= UNBIASED * walk["error"],
        "rounding in single precision makes the energy of water a random walk without a bias, where the solver is exact",
        f"spread ~ t^{walk['alpha']:.2f}, mean {walk['mean']:.2g} +- {walk['error']:.2g}",
    )
    water, butane = (middle(single(runs, molecule, GAUSS_SEIDEL, MULTIPLIERS)) for molecule in (WATER, BUTANE))
    require(
        abs(water["slope"]) < ONCE * abs(water["mean"]) and water["mean"] < -CLEAR * water["error"],
        "at the usual tolerance water loses some energy at once, and then no more than a part of that",
        f"{water['mean']:.2g} in all, of which {water['slope']:.2g} in the last seven eighths of the time",
    )
    require(
        butane["slope"] < -CLEAR * butane["slope_error"] and abs(butane["slope"]) > ONCE * abs(butane["mean"]),
        "at the usual tolerance butane goes down systematically",
        f"{butane['slope']:.2g} +- {butane['slope_error']:.2g}",
    )
    return SimpleNamespace(walk=walk, water=water, butane=butane)


def check_always(runs: pd.DataFrame) -> SimpleNamespace:
    """Return how often inaccurate constraining decreases the energy, of the settings whose change is clear; rounding is left out."""
    inaccurate = runs[runs["tolerance"].notna() | (runs["scheme"] == LINCS)]
    seen = clear(inaccurate[inaccurate["velocities"] == MULTIPLIERS])
    up = seen[seen["mean"] > 0].sort_values("mean", ascending=False)
    parts = {molecule: seen[seen["molecule"] == molecule] for molecule in TITLES}
    velocities = inaccurate[inaccurate["velocities"] == MULTIPLIERS]
    later = clear(velocities.assign(mean=velocities["slope"], error=velocities["slope_error"]))
    require(
        len(up) < len(seen) / 2, "inaccurate constraining decreases the energy in most settings", f"{len(up)} of {len(seen)} increase it"
    )
    return SimpleNamespace(
        n=len(seen),
        down=len(seen) - len(up),
        up=up,
        later=len(later),
        later_up=later[later["mean"] > 0].sort_values("mean", ascending=False),
        by_molecule={molecule: (int((rows["mean"] < 0).sum()), len(rows)) for molecule, rows in parts.items()},
    )


def check_smaller(runs: pd.DataFrame) -> SimpleNamespace:
    """Test that in single precision the drift grows as the step falls, where velocities are differences of positions."""
    rows = []
    for molecule in TITLES:
        for scheme in (SETTLE, LINCS, GAUSS_SEIDEL):
            for velocities in (DIFFERENCES, MULTIPLIERS):
                some = single(runs, molecule, scheme, velocities)
                if len(some):
                    rows.append(
                        {"molecule": molecule, "scheme": scheme, "velocities": velocities} | vars(fit(some.assign(tolerance=np.nan)))
                    )
    laws = pd.DataFrame(rows)
    settle = part(laws, molecule=WATER, scheme=SETTLE, velocities=DIFFERENCES).iloc[0]
    require(
        INVERSE[0] < settle["b"] < INVERSE[1] and settle["b_error"] < 0.3,
        "the drift of water with SETTLE grows like 1/h as the step falls, with velocities from differences",
        f"h^{settle['b']:.2f} +- {settle['b_error']:.2f}",
    )
    both = [single(runs, WATER, SETTLE, velocities).set_index("h") for velocities in (DIFFERENCES, MULTIPLIERS)]
    factors = both[0]["median"] / both[1]["median"]
    require((factors > 10).all(), "velocities from differences change the energy more than ten times as much", factors.to_dict())
    settles = part(runs, scheme=SETTLE, velocities=MULTIPLIERS)
    spread = {precision: float(middle(some)["spread"]) for precision, some in settles.groupby("precision")}
    return SimpleNamespace(
        laws=laws,
        settle=settle,
        least=factors.min(),
        most=factors.max(),
        differences=both[0].reset_index(),
        compensated=spread[SINGLE] / spread[COMPENSATED],
        mixed=spread[SINGLE] / spread[MIXED],
    )


GROWTH = (
    (WATER, SETTLE, MULTIPLIERS, "water, SETTLE,\nvelocities from multipliers"),
    (WATER, SETTLE, DIFFERENCES, "water, SETTLE,\nvelocities from differences"),
    (WATER, GAUSS_SEIDEL, MULTIPLIERS, "water, Gauss-Seidel $10^{-5}$,\nvelocities from multipliers"),
    (BUTANE, GAUSS_SEIDEL, MULTIPLIERS, "butane, Gauss-Seidel $10^{-5}$,\nvelocities from multipliers"),
)
"""Settings in single precision whose growth is drawn."""


SINGLE_SCHEMES = (SETTLE, LINCS)
"""Solvers without a tolerance, whose change in single precision is drawn against the step."""


def draw_growth(growth: pd.DataFrame, folder: Path) -> Path:
    """Draw how the mean change and its spread over the starts grow with time, in single precision with the middle step."""
    figure, axes = grid_of_axes(1, 4, 3.4, x="time [ps]", sharex=True, sharey=True)
    axes[0, 0].set_ylabel("change over fluctuation")
    frames = []
    for ax, (molecule, scheme, velocities, title) in zip(axes[0], GROWTH, strict=True):
        rows = single(growth, molecule, scheme, velocities).sort_values("t")
        stroke, t = stroke_of(scheme), rows["t"] / 10
        ax.plot(t, rows["mean"].abs(), color=stroke.color, marker="o", markersize=4, label="mean, modulus")
        ax.plot(
            t, rows["spread"], color=stroke.color, linestyle=(0, (4, 2)), marker="s", markerfacecolor="white", markersize=4, label="spread"
        )
        for power, at in ((1.0, 1e-4), (0.5, 1.5e-6)):
            ax.plot(t, at * (t / t.iloc[-1]) ** power, color=QUIET, linewidth=0.8)
        ax.set(xscale="log", yscale="log")
        ax.set_title(title, fontsize=8)
        frames.append(rows)
    axes[0, 0].text(0.9, 1.6e-5, "$t$", color=QUIET, fontsize=8)
    axes[0, 0].text(0.9, 2.2e-7, r"$\sqrt{t}$", color=QUIET, fontsize=8)
    figure.legend(*axes[0, 0].get_legend_handles_labels(), loc="outside lower center", ncols=2)
    return save(figure, folder, "growth", pd.concat(frames, ignore_index=True))


def draw_steps(runs: pd.DataFrame, folder: Path) -> Path:
    """Draw the change in single precision against the step, with both velocities: a panel a molecule."""
    rows = runs[(runs["precision"] == SINGLE) & runs["scheme"].isin(SINGLE_SCHEMES)]
    molecules = [molecule for molecule in TITLES if molecule in set(rows["molecule"])]
    figure, axes = grid_of_axes(1, len(molecules), 3.4, x="step [fs]", sharey=True)
    axes[0, 0].set_ylabel(CHANGE)
    for ax, molecule in zip(axes[0], molecules, strict=True):
        for (scheme, velocities), some in rows[rows["molecule"] == molecule].groupby(["scheme", "velocities"]):
            _steps_curve(ax, some.sort_values("h"), str(scheme), velocities == DIFFERENCES)
        ax.set(xscale="log", yscale="log", title=TITLES[molecule])
        ax.set_xticks([0.5, 1, 2, 4], ["0.5", "1", "2", "4"])
        ax.minorticks_off()
    _steps_legend(figure)
    return save(figure, folder, "steps", rows)


def _steps_curve(ax: Any, rows: pd.DataFrame, scheme: str, filled: bool) -> None:
    """Draw medians and bands over the starts against the step; filled markers and whole lines are differences."""
    color = stroke_of(scheme).color
    look = {"color": color, "marker": MARKERS[scheme], "markerfacecolor": color if filled else "white"}
    ax.fill_between(100 * rows["h"], rows["low"], rows["high"], color=color, alpha=0.15, linewidth=0)
    ax.plot(100 * rows["h"], rows["median"], **look, linestyle="-" if filled else (0, (4, 2)))


def _steps_legend(figure: Any) -> None:
    schemes = [
        Line2D([], [], color=stroke_of(s).color, marker=MARKERS[s], markerfacecolor="white", label=name_of(s)) for s in SINGLE_SCHEMES
    ]
    black: dict[str, Any] = {"color": "black", "marker": "o"}
    looks = [
        Line2D([], [], label="velocities from differences", **black),
        Line2D([], [], label="velocities from multipliers", linestyle=(0, (4, 2)), markerfacecolor="white", **black),
    ]
    figure.legend(handles=[*schemes, *looks], loc="outside lower center", ncols=3)

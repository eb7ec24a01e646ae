"""A penalty in place of the constraint, g^T g / (2 eps^2) added to H, as eps goes to 0: how near it comes to the constrained motion."""

from pathlib import Path
from typing import TYPE_CHECKING

from daebench.draw.figures import QUIET, drawing, grid_of_axes, legend_below, save
from daebench.draw.methods import curve_of, name_of
from daebench.studies.grid.claimed import feasible
from daebench.studies.grid.rows import by_method, rows_of
from daebench.studies.grid.run_specification import GridRun, Row
from daebench.studies.grid.runs import Runs
from daebench.studies.stability.extreme import Asked, uncertified
from daebench.studies.work_precision.study import with_costs

if TYPE_CHECKING:
    import pandas as pd

LIMITS = {"stiff:midpoint": "rattle", "stiff:rk4": "lobatto3", "stiff:gauss2": "lobatto3"}
"""Methods on the stiff system, each with a method of the same order on the constrained system that it is held against."""

EPS = tuple(10.0 ** (-k / 2) for k in range(2, 15))
"""Values of eps."""

HALVINGS = (3, 5, 7)
"""Halvings of the distance of stored times, where no step sizes are given."""

MOST = 1.0
"""Where a picture ends: an error of the size of the motion."""


def refusal(asked: Asked) -> str:
    """Return why a problem has no such extreme, as a sentence, or ""."""
    if not asked.ivp.on_manifold:
        return f"{asked.problem} is a Poisson system, which has no constraint"
    return uncertified(asked) or ("" if feasible(asked.ivp, tuple(LIMITS))[0] else f"{', '.join(LIMITS)} cannot be run on {asked.problem}")


def specifications(asked: Asked) -> list[GridRun]:
    """Return the runs."""
    assert asked.reference is not None
    steps = asked.h or [float(asked.reference.t[1]) / 2**k for k in HALVINGS]
    metrics = ("q", "energy", "manifold")
    methods, _ = feasible(asked.ivp, tuple(LIMITS))
    stiff = [asked.specification(method, h, metrics, options=(("eps", eps),)) for method in methods for h in steps for eps in EPS]
    limits = dict.fromkeys(LIMITS[method] for method in methods)
    return stiff + [asked.specification(limit, h, metrics, options=()) for limit in limits for h in steps]


def measure(asked: Asked, runs: Runs) -> "pd.DataFrame":
    """Return one row a run, with its costs; eps is 0 for the constrained system."""
    given = specifications(asked)
    return with_costs(runs(given)).assign(eps=[dict(specification.options).get("eps", 0.0) for specification in given])


def says(table: "pd.DataFrame") -> list[str]:
    """Return, for the smallest step, how near the penalty comes to the constrained motion, and what becomes of it as eps goes to 0."""
    h = float(table["value"].min())
    same = table[table["value"] == h]
    limits = {str(row["method"]): row for row in rows_of(same[same["eps"] == 0])}
    sentences = [_constrained(h, row) for row in limits.values()]
    good = {method: row for method, row in limits.items() if not row["failure"]}
    stiff = [(method, rows) for method, rows in by_method(same[same["eps"] > 0]) if LIMITS[method] in good]
    return sentences + [_approach(method, rows_of(rows), good[LIMITS[method]]) for method, rows in stiff]


def _constrained(h: float, limit: Row) -> str:
    """Return the error of a method on the constrained system."""
    method = limit["method"]
    if limit["failure"]:
        return f"{method} on the constrained system fails with h = {h:.3g} s, so there is no comparison for penalties of its order."
    return f"With h = {h:.3g} s {method} on the constrained system has an error of {limit['error_q']:.1e} in q."


def _approach(method: str, rows: list[Row], limit: Row) -> str:
    """Return how near one method comes to the constrained motion."""
    good = [row for row in rows if not row["failure"]]
    if not good:
        return f"{method} fails for every eps."
    best, last = min(good, key=lambda row: float(row["error_q"])), min(good, key=lambda row: float(row["eps"]))
    failed = "" if len(good) == len(rows) else f", and {len(rows) - len(good)} of {len(rows)} runs fail"
    times, work = best["error_q"] / limit["error_q"], best["evaluations"] / limit["evaluations"]
    compared = f"{times:.2g} times that of {limit['method']}, of the same order, with {work:.2g} times its evaluations"
    end = f"at the smallest eps with which it reaches the end, {last['eps']:.1e}, it has {last['error_q']:.1e}{failed}"
    return f"{method} has {best['error_q']:.1e} at best, at eps = {best['eps']:.1e}, {compared}; {end}."


def draw(out: Path, stem: str, table: "pd.DataFrame") -> Path:
    """Draw the error in q against eps, a panel for each step."""
    steps = sorted(set(table["value"]), reverse=True)
    with drawing():
        figure, axes = grid_of_axes(1, len(steps), 3.2, sharey=True)
        for axis, h in zip(axes[0], steps, strict=True):
            same = table[table["value"] == h]
            for method, rows in by_method(same[same["eps"] > 0]):
                rows = rows.dropna(subset=["error_q"]).sort_values("eps")
                axis.plot(rows["eps"], rows["error_q"].clip(upper=MOST), **curve_of(method))
            for limit, dashes in zip(rows_of(same[same["eps"] == 0]), ("-", "--"), strict=False):
                axis.axhline(float(limit["error_q"]), color=QUIET, linestyle=dashes, label=f"{name_of(str(limit['method']))}, constrained")
            axis.set(xscale="log", yscale="log", xlabel="penalty parameter eps", title=f"h = {h:.3g} s")
        axes[0, 0].set_ylabel("largest error of a position q")
        legend_below(figure, axes[0, 0], 4)
        return save(figure, out, stem, table)

"""The Ablowitz-Ladik lattice: its four integrals over time at one step size, and the cost of a step by the number of sites."""

from collections.abc import Mapping
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pandas as pd

from daebench.draw.figures import grid_of_axes, legend_below, save
from daebench.pages.report import number
from daebench.pages.report.claims import require
from daebench.pages.report.tables import code, tiny
from daebench.reports.poisson.casimirs import plot_so_far
from daebench.reports.poisson.defects import LEAST
from daebench.reports.poisson.runs import ROUND_OFF, errors, ivp_of, kind, method
from daebench.runs.request import Request

PROBLEM, CASE = "ablowitz_ladik", "hlw16"
METHODS = ("strang", "strang/suzuki4", "darboux:verlet", "midpoint", "rk4")
QUANTITIES = ("energy", "norm", "coupling", "momentum")
SITES, H, T_END, EVERY = 16, 2e-4, 20.0, 50
FINE = H / 8
"""Step size of a second run of ``strang``, with which its error is asymptotic."""

SIZES = (16, 256, 5_000, 100_000)
SITE_STEPS = 400_000
"""Product of steps and sites of a timed run."""

TIMED_RUNS = 3
SHOWN = 300


def invariants(name: str, h: float = H, t_end: float = T_END) -> tuple[dict[str, object], pd.DataFrame]:
    """Return the row of a method, and the errors so far of energy and integrals over time, thinned out evenly in log t."""
    ivp, every = ivp_of(PROBLEM, CASE), round(EVERY * H / h)
    run = method(name, compiled=True).solve(ivp, Request(value=h, t_end=t_end, every=every, watch=())).complete()
    deviations = errors(ivp, run)
    row: dict[str, object] = {"method": name, "h": h, "ns": 1e9 * run.seconds / run.steps}
    for quantity in QUANTITIES:
        row |= {quantity: np.max(np.abs(deviations[quantity])), f"{quantity}_kind": kind(run.t, deviations[quantity])}
    indices = np.unique(np.geomspace(1, len(run.t) - 1, SHOWN).astype(int))
    so_far = {quantity: np.maximum.accumulate(np.abs(deviations[quantity]))[indices] for quantity in QUANTITIES}
    return row, pd.DataFrame({"method": name, "h": h, "t": run.t[indices]} | so_far)


def sizes_of_integrals() -> dict[str, float]:
    """Return energy and integrals at the start, by name."""
    ivp = ivp_of(PROBLEM, CASE)
    values = [ivp.along("H", ivp.y0[None])[0], *ivp.along("integrals", ivp.y0[None])[0]]
    return dict(zip(("energy", *ivp.integrals), map(float, values), strict=True))


def speeds() -> dict[str, float]:
    """Return how fast the state moves at the start, and how fast the logarithms alone would turn it: every y_k at the rate 2/dx^2."""
    ivp = ivp_of(PROBLEM, CASE)
    moving = float(np.linalg.norm(ivp.value("field", ivp.y0)))
    return {"all": moving, "part": 2 * SITES**2 * float(np.linalg.norm(ivp.y0)), "rate": 2.0 * SITES**2}


def cost(sites: int) -> dict[str, object]:
    """Return the CPU time of a step of ``strang`` per site, best of several runs."""
    ivp = ivp_of(PROBLEM, CASE, {"sites": sites})
    request = Request(value=0.02 / sites**2, steps=max(4, SITE_STEPS // sites), every=0, watch=())
    runs = [method("strang", compiled=True).solve(ivp, request).complete() for _ in range(TIMED_RUNS)]
    return {"sites": sites, "ns_per_site": min(1e9 * run.seconds / run.steps / sites for run in runs)}


def check_lattice(frame: pd.DataFrame, sizes: Mapping[str, float], speeds: Mapping[str, float], cost: pd.DataFrame) -> SimpleNamespace:
    """Test which errors drift or are bounded on the lattice, and how inaccurate a splitting of second order is."""
    rows = {row["method"]: row for row in frame[frame["h"] == H].to_dict("records")}
    fine = frame[frame["h"] == FINE].iloc[0]
    for quantity in QUANTITIES:
        kind = rows["rk4"][f"{quantity}_kind"]
        require(kind == "linear", f"rk4 loses {quantity} linearly", kind)
    unbounded = []
    for name in ("strang", "strang/suzuki4", "darboux:verlet"):
        for quantity in ("energy", "norm", "coupling"):
            kind = rows[name][f"{quantity}_kind"]
            require(kind in ("bounded", "undetermined"), f"{quantity} does not drift with {name}", kind)
            unbounded += [(name, quantity)] if kind == "undetermined" else []
    require(not [name for name, _ in unbounded if name == "darboux:verlet"], "darboux:verlet bounds energy, norm and coupling", unbounded)
    middle = rows["midpoint"]
    for quantity in ("coupling", "momentum"):
        require(middle[quantity] <= ROUND_OFF, f"midpoint keeps {quantity}, which is quadratic", middle[quantity])
    require(middle["norm_kind"] == "bounded" and middle["norm"] > ROUND_OFF, "it bounds the norm", (middle["norm_kind"], middle["norm"]))
    share = rows["strang"]["norm"] / sizes["norm"]
    require(share > 0.5, "the error of strang in the norm is over half of the norm", f"{share:.2f}")
    ratio = rows["strang"]["norm"] / rows["darboux:verlet"]["norm"]
    require(ratio > 1000, "darboux:verlet is a thousand times more accurate", f"a factor of {ratio:.3g}")
    cure = rows["strang"]["norm"] / rows["strang/suzuki4"]["norm"]
    require(cure > 1e5, "order four is a hundred thousand times more accurate", f"a factor of {cure:.3g}")
    gain = rows["strang"]["norm"] / fine["norm"]
    require(gain > 10, "an eighth of the step makes strang ten times more accurate", f"a factor of {gain:.3g}")
    fast = speeds["part"] / speeds["all"]
    require(fast > 5, "a part alone moves the lattice over five times as fast as all parts together", f"{fast:.3g} times")
    return SimpleNamespace(row=rows, unbounded=unbounded, fine=fine, share=share, ratio=ratio, fast=fast, cost=cost)


def draw_lattice(series: pd.DataFrame, sizes: Mapping[str, float], folder: Path) -> Path:
    """Draw the largest error so far of energy and integrals of the lattice against time, one panel per quantity."""
    series = series[series["h"] == H]
    figure, axes = grid_of_axes(2, 2, 5.2, x="time $t$", y="largest error so far", sharex=True, sharey=True)
    titles = {"energy": "energy $H$", "norm": "norm", "coupling": "coupling", "momentum": "momentum"}
    for ax, (quantity, title) in zip(axes.flat, titles.items(), strict=True):
        for name in METHODS:
            history = series[series["method"] == name]
            plot_so_far(ax, history["t"], history[quantity], name)
        ax.set(xscale="log", yscale="log", title=f"{title}, ${sizes[quantity]:.3g}$ at the start", ylim=(LEAST / 2, 1e2))
    legend_below(figure, axes[0, 0], 5, columnspacing=1.3)
    return save(figure, folder, "lattice", series)


COLUMNS = {
    "method": code,
    "h": (number, "<i>h</i>"),
    **dict.fromkeys(QUANTITIES, tiny),
    "energy_kind": "energy<small>becomes</small>",
    "us": (number, "µs<small>per step</small>"),
}

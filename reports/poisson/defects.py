"""The Poisson defect against the step size, and Lemma 4.9: on a constraint manifold it vanishes together with the symplectic one."""

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pandas as pd

from daebench.diagnostics.order import fit_order
from daebench.diagnostics.poisson import poisson_defect
from daebench.diagnostics.symplecticity import symplecticity_defect, tangent_basis
from daebench.draw.figures import QUIET, grid_of_axes, save
from daebench.draw.methods import name_of, stroke_of
from daebench.methods.initial_value_problem import initial_value_problem
from daebench.methods.names import parse
from daebench.pages.report.claims import require
from daebench.reports.poisson.runs import ROUND_OFF, VISIBLE, defect, ivp_of
from daebench.runs.local_flow import enter, local_flow, structure_matrix
from daebench.runs.make_ivp import constrained

METHODS = ("strang", "verlet", "darboux:symplectic_euler", "midpoint", "rk4")
POINT = (3.0, 3.0)
"""Point at which the defect of a step is measured, not the start of an orbit: where u' = 0 the defect has another order."""

STEP_SIZES = tuple(0.1 / 2**k for k in range(6))

CONSTRAINED = ("rattle", "symplectic_euler", "seproj", "implicit_euler", "local:midpoint", "local:rk4")
"""Methods that stay on the manifold of the spherical pendulum, and thus are maps in local coordinates."""

PENDULUM, PENDULUM_CASE = "spherical_pendulum", "fig1.2"
PENDULUM_STEP_SIZES = tuple(0.02 / 2**k for k in range(6))
LEMMA_STEPS = 2


def defects(method: str) -> pd.DataFrame:
    """Return the defect of one step of a method on predator and prey, by h."""
    ivp = ivp_of("lotka_volterra", "4,2", y0=POINT)
    return pd.DataFrame({"method": method, "h": STEP_SIZES, "defect": [defect(ivp, method, h, 1) for h in STEP_SIZES]})


def lemma(method: str) -> pd.DataFrame:
    """Return both defects of two steps of a constrained method, by h: on tangent vectors, and of B(y) in local coordinates."""
    ivp = constrained(initial_value_problem(PENDULUM, PENDULUM_CASE))
    X, y, B = tangent_basis(ivp, ivp.p0, ivp.q0), np.concatenate(enter(ivp)(ivp.p0, ivp.q0)), structure_matrix(ivp)
    chosen: Any = parse(method)
    uncompiled = replace(chosen, compiled=False)
    rows = []
    for h in PENDULUM_STEP_SIZES:
        flow = uncompiled.flow(ivp, h, LEMMA_STEPS)
        symplectic, poisson = symplecticity_defect(flow, ivp.p0, ivp.q0, X), poisson_defect(local_flow(flow, ivp), y, B)
        rows.append({"method": method, "h": h, "symplectic": symplectic, "poisson": poisson, "B": np.max(np.abs(B(y)))})
    return pd.DataFrame(rows)


LEAST = 1e-17
"""Smaller values are drawn at this value."""


def slopes(frame: pd.DataFrame, column: str = "defect") -> pd.DataFrame:
    """Return one row per method: the largest defect, and the fitted power of h if it is not round-off."""
    rows = []
    for name, method_defects in frame.groupby("method", sort=False):
        value = method_defects[column].to_numpy()
        least = ROUND_OFF * (method_defects["B"].iloc[0] if "B" in method_defects else 1.0)
        fit = fit_order(method_defects["h"], value, floor=1e-13) if value.max() > least else None
        power = {"slope": fit.slope, "slope_error": fit.slope_error} if fit else {"slope": np.nan, "slope_error": np.nan}
        rows.append({"method": name, "most": value.max(), "least": value.min(), "round_off": fit is None} | power)
    return pd.DataFrame(rows)


BAND = 0.15
"""Tolerance for the agreement of a fitted power of h with a whole number."""


DEFECT_POWERS = {"midpoint": 3, "rk4": 5}
"""Powers of h: one more than the order of the method."""


KEEP_BOTH, LOSE_BOTH = ("rattle", "symplectic_euler"), ("seproj", "implicit_euler", "local:midpoint", "local:rk4")


def check_defects(fits: pd.DataFrame) -> SimpleNamespace:
    """Test which methods are Poisson maps to round-off, and the power of h in the defects of the others."""
    round_off_defects = []
    for name, row in fits.iterrows():
        if name not in DEFECT_POWERS:
            require(row["round_off"], f"{name} is a Poisson map to round-off", f"a defect of {row['most']:.2e}")
            round_off_defects.append(row["most"])
            continue
        power = DEFECT_POWERS[str(name)]
        require(row["most"] > VISIBLE, f"{name} is not a Poisson map", f"a defect of {row['most']:.2e}")
        require(abs(row["slope"] - power) <= BAND, f"the defect of {name} is O(h^{power})", f"{row['slope']:.3f}")
    return SimpleNamespace(kept=max(round_off_defects), row=fits.to_dict("index"))


def check_lemma(frame: pd.DataFrame) -> SimpleNamespace:
    """Test Lemma 4.9: both defects are round-off, or both fall with the same power of h."""
    symplectic, poisson = (slopes(frame, column).set_index("method") for column in ("symplectic", "poisson"))
    for name in KEEP_BOTH:
        both = symplectic["round_off"][name] and poisson["round_off"][name]
        require(both, f"{name} keeps both structures", (symplectic["most"][name], poisson["most"][name]))
    apart = []
    for name in LOSE_BOTH:
        neither = not symplectic["round_off"][name] and not poisson["round_off"][name]
        require(neither, f"{name} keeps neither", (symplectic["most"][name], poisson["most"][name]))
        apart.append(abs(symplectic["slope"][name] - poisson["slope"][name]))
        require(apart[-1] <= 2 * BAND, f"both defects of {name} fall with the same power of h", f"powers {apart[-1]:.3f} apart")
    most = max(float(table["most"][list(KEEP_BOTH)].max()) for table in (symplectic, poisson))
    return SimpleNamespace(kept=most, apart=max(apart), symplectic=symplectic["slope"].to_dict(), poisson=poisson["slope"].to_dict())


def draw_defects(defects: pd.DataFrame, both: pd.DataFrame, folder: Path) -> Path:
    """Draw defects against h: on predator and prey, and both defects of constrained methods, with the fitted powers at the curves."""
    figure, axes = grid_of_axes(1, 3, 4.5, sharey=True)
    panels = (
        ("defect", "(a) Poisson, predator and prey"),
        ("symplectic", "(b) symplectic, pendulum"),
        ("poisson", "(c) Poisson, in its chart"),
    )
    for ax, (column, title) in zip(axes[0], panels, strict=True):
        frame = defects if column == "defect" else both
        powers = slopes(frame, column).set_index("method")["slope"]
        label_heights: list[float] = []
        for name, method_defects in frame.groupby("method", sort=False):
            stroke, value = stroke_of(str(name)), method_defects[column].clip(lower=LEAST)
            ax.plot(method_defects["h"], value, label=name_of(str(name)), **stroke.points())
            if np.isfinite(powers[name]) and all(abs(np.log(value.iloc[0] / other)) > 1 for other in label_heights):
                ax.text(method_defects["h"].max() * 1.2, value.iloc[0], f"{powers[name]:.1f}", color=stroke.color, fontsize=8, va="center")
                label_heights.append(value.iloc[0])
        ax.axhspan(LEAST, 1e-14, color="#eeeeee", zorder=0, linewidth=0)
        ax.set(
            xscale="log",
            yscale="log",
            title=title,
            xlabel="step size $h$",
            xlim=(method_defects["h"].min() / 1.5, method_defects["h"].max() * 2.2),
        )
    axes[0, 0].set_ylabel("defect")
    axes[0, 0].text(axes[0, 0].get_xlim()[0] * 1.1, 1.3e-14, "round-off", color=QUIET, fontsize=8, va="bottom")
    legends: list[tuple[str, Any, Any]] = [
        ("methods of (a):", axes[0, 0], "outside lower left"),
        ("of (b), (c):", axes[0, 1], "outside lower right"),
    ]
    for heading, ax, place in legends:
        handles, labels = ax.get_legend_handles_labels()
        figure.legend(handles, labels, loc=place, title=heading, alignment="left")
    frames = [defects.assign(kind="poisson, lotka_volterra").rename(columns={"defect": "value"})]
    frames += [both.assign(kind=f"{kind}, spherical_pendulum", value=both[kind]) for kind in ("symplectic", "poisson")]
    return save(figure, folder, "defects", pd.concat(frames, ignore_index=True)[["kind", "method", "h", "value"]])


def all_slopes(defects: pd.DataFrame, both: pd.DataFrame) -> pd.DataFrame:
    """Return the fitted powers of all three panels of the figure of defects."""
    frames = [slopes(defects).assign(defect="poisson, lotka_volterra")]
    frames += [slopes(both, structure).assign(defect=f"{structure}, spherical_pendulum") for structure in ("symplectic", "poisson")]
    return pd.concat(frames, ignore_index=True)

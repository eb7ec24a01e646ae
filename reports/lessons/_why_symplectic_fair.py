"""What the lesson on index reduction says of two long motions, and the numbers of its sentences."""

from collections.abc import Mapping
from types import SimpleNamespace

import numpy as np

from daebench.diagnostics.energy import energy_drift
from daebench.pages.report.claims import require
from daebench.reports._two_motions import BEGUN, PENDULUM, TORUS, Run, measured, require_level, require_lost

MIDDLE = 2e3
"""Time at which the error on the torus is told as well, s."""

ON_TORUS = ("rattle", "lobatto3", "canonical:gauss2", "local:gauss2", "gauss2", "rk4")
ON_PENDULUM = ("rattle", "midpoint", "gauss2", "se", "rk4")

ROUNDED = 1e-12
"""Distance from the surface below which there is only round-off."""

PLANE = np.array([1.0, -1.0, 1.0])
"""The mirror that turns the pendulum's reversed start into the start."""


def fair() -> SimpleNamespace:
    """Return the numbers of both motions; the first sentence that does not hold raises ClaimRefuted."""
    hole = {name: measured(TORUS, name) for name in ON_TORUS}
    swing = {name: measured(PENDULUM, name) for name in ON_PENDULUM}
    check_torus(hole)
    check_pendulum(swing)
    rattle, gauss = hole["rattle"], hole["gauss2"]
    return SimpleNamespace(
        torus={name: run.most for name, run in hole.items()},
        better=rattle.by(BEGUN) / gauss.by(BEGUN),
        crossing=gauss.passes(rattle.most),
        middle=gauss.by(MIDDLE),
        gone=float(hole["rk4"].t[-1]),
        pendulum={name: run.most for name, run in swing.items()},
    )


def check_torus(runs: Mapping[str, Run]) -> None:
    """Require what the lesson says of the torus."""
    for name in ("rattle", "lobatto3", "canonical:gauss2"):
        require_level(runs[name], f"{name} on the torus")
    for name in ("gauss2", "local:gauss2"):
        require_lost(runs[name], f"{name} on the torus")
    require(runs["gauss2"].most > runs["rattle"].most, "Gauss on (1.18) passes RATTLE", runs["gauss2"].most)
    require(runs["rattle"].by(BEGUN) > 100 * runs["gauss2"].by(BEGUN), "it begins far below RATTLE", runs["gauss2"].by(BEGUN))
    require(runs["gauss2"].g > 1e3 * ROUNDED > ROUNDED > runs["rattle"].g, "it leaves the torus, RATTLE does not", runs["gauss2"].g)
    law = energy_drift(runs["local:gauss2"].t, runs["local:gauss2"].energy_error).law
    require(law == "linear", "in angles and rates the error grows linearly", law)
    require(runs["rk4"].failure is not None, "RK4 does not reach the end on the torus", runs["rk4"].most)


def check_pendulum(runs: Mapping[str, Run]) -> None:
    """Require what the lesson says of the pendulum."""
    ivp = PENDULUM.ivp()
    p0, q0 = np.asarray(ivp.p0), np.asarray(ivp.q0)
    require(np.array_equal(-p0 * PLANE, p0) and np.array_equal(q0 * PLANE, q0), "reversed, the start is its own mirror image", (p0, q0))
    for name in ("rattle", "midpoint", "gauss2"):
        require_level(runs[name], f"{name} on the pendulum")
    require(abs(runs["midpoint"].most / runs["rattle"].most - 1) < 0.01, "midpoint has RATTLE's error", runs["midpoint"].most)
    require(runs["midpoint"].g > ROUNDED > runs["rattle"].g, "midpoint leaves the sphere, RATTLE does not", runs["midpoint"].g)
    for name in ("se", "rk4"):
        require(runs[name].failure is not None, f"{name} does not reach the end on the pendulum", runs[name].most)

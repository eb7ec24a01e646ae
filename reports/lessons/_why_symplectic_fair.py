"""The long runs of the lesson on index reduction: a motion on a torus, and a pendulum whose motion is its own mirror image in reverse."""

from dataclasses import dataclass
from functools import cache
from types import SimpleNamespace

import numpy as np

from daebench.diagnostics.energy import energy_drift
from daebench.diagnostics.integrals import energy_error
from daebench.methods.initial_value_problem import initial_value_problem
from daebench.methods.names import parse
from daebench.pages.report.claims import require
from daebench.runs.ivp import Array, ConstrainedIvp
from daebench.runs.make_ivp import constrained
from daebench.runs.request import Request

TORUS, HOLE, TORUS_H, TORUS_END, MIDDLE = "torus", "through_hole", 0.1, 1e4, 2e3
PENDULUM, ANGLE, SPEED, PENDULUM_H, PENDULUM_END = "spherical_pendulum", 1.0, 0.3, 0.05, 5e3
ON_TORUS = ("rattle", "lobatto3", "canonical:gauss2", "local:gauss2", "gauss2", "rk4")
ON_PENDULUM = ("rattle", "midpoint", "gauss2", "se", "rk4")

FIRST, LEVEL, GROWN = 30.0, 1.05, 20.0
"""Seconds in which an error reaches its first level; a level error stays within 1.05 times it, and one that grows passes 20 times it."""

EARLY, FLOOR = 5.0, 1e-12
"""Seconds over which the first errors are compared, and a distance from the surface below which there is only round-off."""

PLANE = np.array([1.0, -1.0, 1.0])
"""The mirror that turns the pendulum's reversed start into the start."""


def torus() -> ConstrainedIvp:
    """Return the bead that slides through the hole of a torus, again and again."""
    return constrained(initial_value_problem(TORUS, HOLE))


def pendulum() -> ConstrainedIvp:
    """Return the pendulum, one radian from hanging, pushed sideways."""
    q0 = (float(np.sin(ANGLE)), 0.0, float(-np.cos(ANGLE)))
    return constrained(initial_value_problem(PENDULUM, "fig1.1", q0=q0, p0=(0.0, SPEED, 0.0)))


@dataclass(frozen=True)
class Long:
    """A long run: times and energy errors of every step, largest distance |g| from the surface, and why it ended early."""

    t: Array
    error: Array
    g: float
    failure: str | None

    @property
    def largest(self) -> Array:
        """Largest modulus of the energy error so far, shape(n,)."""
        return np.asarray(np.maximum.accumulate(np.abs(self.error)))

    @property
    def most(self) -> float:
        """Largest energy error of the run."""
        return float(self.largest[-1])

    @property
    def growth(self) -> float:
        """Largest energy error in units of its first level; infinite for a run that ends early."""
        return float("inf") if self.failure else self.most / self.by(FIRST)

    def by(self, t: float) -> float:
        """Return the largest energy error up to a time."""
        return float(self.largest[np.searchsorted(self.t, t + 1e-9) - 1])


@cache
def followed(problem: str, name: str) -> Long:
    """Return the run of a method on the torus or the pendulum."""
    ivp, h, t_end = (torus(), TORUS_H, TORUS_END) if problem == TORUS else (pendulum(), PENDULUM_H, PENDULUM_END)
    run = parse(name).solve(ivp, Request(value=h, t_end=t_end, every=1, watch=("manifold",)))
    with np.errstate(over="ignore", invalid="ignore"):
        error = np.nan_to_num(energy_error(ivp, run), nan=np.inf)
    return Long(run.t, error, float(run.maxima["g"]), run.failure)


def fair() -> SimpleNamespace:
    """Return the numbers of both motions; the first sentence that does not hold raises ClaimRefuted."""
    hole = {name: followed(TORUS, name) for name in ON_TORUS}
    swing = {name: followed(PENDULUM, name) for name in ON_PENDULUM}
    check_torus(hole)
    check_pendulum(swing)
    rattle, gauss = hole["rattle"], hole["gauss2"]
    return SimpleNamespace(
        torus={name: run.most for name, run in hole.items()},
        first={name: run.by(FIRST) for name, run in hole.items()},
        better=rattle.by(EARLY) / gauss.by(EARLY),
        crossing=float(gauss.t[np.argmax(gauss.largest > rattle.most)]),
        middle=gauss.by(MIDDLE),
        gone=float(hole["rk4"].t[-1]),
        pendulum={name: run.most for name, run in swing.items()},
        rod=swing["midpoint"].g,
        stopped=float(swing["se"].t[-1]),
        overflow=float(swing["rk4"].t[-1]),
    )


def check_torus(runs: dict[str, Long]) -> None:
    """Require what the lesson says of the torus."""
    for name in ("rattle", "lobatto3", "canonical:gauss2"):
        require(runs[name].growth < LEVEL, f"the energy error of {name} on the torus stays level", runs[name].growth)
    for name in ("gauss2", "local:gauss2"):
        require(GROWN < runs[name].growth < np.inf, f"the energy error of {name} on the torus grows", runs[name].growth)
    require(runs["gauss2"].most > runs["rattle"].most, "Gauss on (1.18) passes RATTLE", runs["gauss2"].most)
    require(runs["rattle"].by(EARLY) > 100 * runs["gauss2"].by(EARLY), "it begins far below RATTLE", runs["gauss2"].by(EARLY))
    require(runs["gauss2"].g > 1e3 * FLOOR > FLOOR > runs["rattle"].g, "it leaves the torus, RATTLE does not", runs["gauss2"].g)
    law = energy_drift(runs["local:gauss2"].t, runs["local:gauss2"].error).law
    require(law == "linear", "in angles and rates the error grows linearly", law)
    require(runs["rk4"].failure is not None, "RK4 does not reach the end on the torus", runs["rk4"].most)


def check_pendulum(runs: dict[str, Long]) -> None:
    """Require what the lesson says of the pendulum."""
    ivp = pendulum()
    p0, q0 = np.asarray(ivp.p0), np.asarray(ivp.q0)
    require(np.array_equal(-p0 * PLANE, p0) and np.array_equal(q0 * PLANE, q0), "reversed, the start is its own mirror image", (p0, q0))
    for name in ("rattle", "midpoint", "gauss2"):
        require(runs[name].growth < LEVEL, f"the energy error of {name} on the pendulum stays level", runs[name].growth)
    require(abs(runs["midpoint"].most / runs["rattle"].most - 1) < 0.01, "midpoint has RATTLE's error", runs["midpoint"].most)
    require(runs["midpoint"].g > FLOOR > runs["rattle"].g, "midpoint leaves the sphere, RATTLE does not", runs["midpoint"].g)
    for name in ("se", "rk4"):
        require(runs[name].failure is not None, f"{name} does not reach the end on the pendulum", runs[name].most)

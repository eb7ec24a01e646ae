"""A contender: one model of one motion in one engine, run at one step size or tolerance, as a method of daebench."""

import time
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from daebench.errors import Stopped
from daebench.methods.outside.callables import outputs
from daebench.methods.outside.method import OutsideMethod
from daebench.methods.outside.record import Block
from daebench.runs.grid import Grid
from daebench.runs.ivp import ConstrainedIvp, Ivp
from daebench.runs.request import Request

Array = NDArray[Any]


@dataclass(frozen=True)
class States:
    """States of a run of an engine, in daebench's coordinates."""

    p: Array
    q: Array
    """Momenta and positions at the requested times; shape (n, d)."""
    seconds: float
    """Time of the stepping alone: without building the model, and without reading states from it if the engine allows this."""
    energy: Array
    """The engine's own energy at these times, up to a constant; NaN if it has none; shape (n,)."""


Run = Callable[[ConstrainedIvp, float, Array], States]
"""Function of an initial value problem, a step size or tolerance, and ascending times > 0 at whole steps; it returns the states there."""


@dataclass(frozen=True)
class Contender:
    """One way to run a motion with an engine."""

    engine: str
    """The engine."""
    setting: str
    """How it models and integrates the motion, in a few words."""
    motion: str
    """Key of the motion."""
    knob: str
    """"h" or "tol"."""
    values: tuple[float, ...]
    """Step sizes or tolerances, the coarsest first."""
    run: Run
    """See :data:`Run`."""
    constrained: bool = True
    """Whether this model has constraints; in reduced coordinates it has none."""
    variants: Mapping[str, Run] = field(default_factory=dict)
    """Free numbers of the setting, in words, and the run with each; the most accurate one is found before ``run`` is used."""

    @property
    def name(self) -> str:
        """Engine and setting."""
        return f"{self.engine}, {self.setting}"

    def method(self, value: float) -> OutsideMethod:
        """Return the contender with a step size or tolerance as a method whose step is the spacing of its outputs."""

        def blocks(ivp: Ivp, grid: Grid, request: Request) -> Iterator[Block]:
            assert isinstance(ivp, ConstrainedIvp)
            steps = outputs(grid)
            try:  # an engine may raise any error, and the row of the run reports it
                states = self.run(ivp, value, np.asarray(steps * grid.h))
            except Exception as error:
                raise Stopped(f"{type(error).__name__}: {' '.join(str(error).split())[:300]}") from error
            yield Block(steps, np.concatenate([states.p, states.q], axis=1), states.seconds)

        return OutsideMethod(self.name, blocks, every_step=False)


def stepped(advance: Callable[[int], Any], read: Callable[[], tuple[Array, Array, float]], h: float, times: Array) -> States:
    """Return the states of an engine that is stepped from output to output; only the stepping is timed.

    Shapes: times (n,).
    """
    seconds, done, rows = 0.0, 0, []
    for time_ in times:
        steps = round(float(time_) / h) - done
        began = time.process_time()
        advance(steps)
        seconds += time.process_time() - began
        done += steps
        rows.append(read())
    p, q, energy = zip(*rows, strict=True)
    return States(np.array(p), np.array(q), seconds, np.array(energy))


def mass_matrix(ivp: ConstrainedIvp) -> Array:
    """Return M, shape(d, d), of a problem whose H = 1/2 p^T M^-1 p + U(q) has a constant one."""
    inverse = ivp.along("H_p", np.eye(ivp.d), np.tile(ivp.q0, (ivp.d, 1)))
    return np.asarray(np.linalg.inv(inverse))


def halved(first: float, times: int) -> tuple[float, ...]:
    """Return a step size and its successive halves, ``times`` values."""
    return tuple(first / 2**k for k in range(times))

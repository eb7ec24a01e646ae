"""Taylor series in double precision by heyoka, on the index-reduced ODE: the peer to beat where motion is smooth."""

import time
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np

from daebench.compiler.definition import Source
from daebench.diagnostics.freedom import redundant
from daebench.errors import BadInput, Stopped
from daebench.methods.formulations.constrained import Posed
from daebench.methods.solvers.constrained_run import OnReducedOde
from daebench.methods.solvers.drive import MOST_STEPS, Advance, Array, not_installed
from daebench.methods.solvers.monitor import Monitor
from daebench.runs.ivp import InitialValueProblem, Ivp
from daebench.systems.lazily import heyoka as hy
from daebench.systems.lazily import sympy as sp

if TYPE_CHECKING:
    from daebench.methods.solvers.taylor_equations import Equations

FIRST = 1e-3
"""Part of the run that the first step is at most: heyoka takes steps from the last two coefficients, which may vanish where it starts."""

PIECES = 20
"""Pieces of a run after each of which its progress is told."""

COMPACT = 8
"""Unknowns above which loops are compiled in place of straight lines, which run in half the time: with 12, these compile for 2 to 27 s,
loops for 0.6 to 2 s."""


class HeyokaTaylor(OnReducedOde):
    """Taylor series of the order that a tolerance asks for; what it evaluates inside is not told, and not counted.

    Outputs are read from the series of the steps that pass them. The run is made twice: step by step, to look at each, and then in one
    piece by heyoka alone, as its users run it, which is what is timed.
    """

    solver = "heyoka"
    variants = ("taylor",)

    @property
    def dense(self) -> bool:
        """Whether it solves with the whole Jacobian: it does not."""
        return False

    @property
    def combines(self) -> bool:
        """Whether it takes combinations of redundant constraints: it solves for lam by elimination."""
        return True

    def lacks(self, ivp: Ivp) -> str | None:
        """Return why there are no series: heyoka is not installed, or the equations are written as loops."""
        if missing := not_installed(self.name):
            return missing
        if ivp.arrays:
            return f"{self.name} needs the equations as expressions, and {ivp.problem} has them as loops; use scipy:DOP853."
        if ivp.on_manifold and ivp.singular and not redundant(ivp):
            return f"{self.name} solves for lam by elimination, not by least squares; use scipy:DOP853."
        return None

    def _begin(self, dae: Posed, tol: float, monitor: Monitor) -> Advance:
        if lacking := self.lacks(dae.ivp):
            raise BadInput(lacking, "heyoka-missing")
        ivp = dae.ivp
        equations, velocity = _equations(ivp.source, tuple(ivp.parameters.items()))
        start = np.concatenate(ivp.start[::-1])
        series = hy.taylor_adaptive(equations, start, tol=tol, compact_mode=compact(len(start)))
        return _Along(series, velocity, monitor, hy.taylor_outcome.err_nf_state).outputs


def compact(unknowns: int) -> bool:
    """Return whether equations with so many unknowns are compiled as loops, see :data:`COMPACT`."""
    return unknowns > COMPACT


def equations_of(ivp: InitialValueProblem) -> "Equations":
    """Return the variables and rates of an initial value problem as heyoka takes them, positions before momenta."""
    return _equations(ivp.source, tuple(ivp.parameters.items()))[0]


@dataclass(frozen=True)
class _Exact:
    """A problem in exact numbers, each the decimal that its double stands for."""

    derivation: Any
    parameters: "Mapping[sp.Symbol, sp.Rational]"


@lru_cache(maxsize=8)
def _equations(source: Source, parameters: tuple[tuple[str, float], ...]) -> "tuple[Equations, Any]":
    """Return variables and rates, and what gives velocities of states where these are the unknowns of others, or None."""
    from daebench.methods.solvers.taylor_equations import hamiltonian, own_coordinates

    derivation, values = source.derivation, dict(parameters)
    exact = _Exact(derivation, {symbol: sp.Rational(repr(values[str(symbol)])) for symbol in derivation.problem.parameters})
    if derivation.states == "poisson":
        return hamiltonian(exact, derivation.problem.y, sp.Matrix(derivation.problem.B), derivation.problem.H), None
    equations = own_coordinates(exact)
    if not derivation.mechanical:
        return equations, None
    variables = [variable for variable, _ in equations]
    velocities = [rate for _, rate in equations[: derivation.d]]
    if source.facts.EXTENDED:
        velocities[-1] = variables[-1]  # p_t, which stands for the velocity of the time
    return equations, hy.cfunc(velocities, vars=variables)


class _Along:
    """Goes along the series step by step, and reads outputs from the series of the step that passes them."""

    def __init__(self, series: Any, velocity: Any, monitor: Monitor, failed: object) -> None:
        self.series, self.velocity, self.monitor, self.failed = series, velocity, monitor, failed
        self.start = np.array(series.state)

    def outputs(self, times: Array) -> Iterator[Array]:
        """Give the unknowns at each of these times, and go through them once more by heyoka alone, which is what is timed.

        A step of heyoka takes less time than to ask for it from Python.
        """
        given, monitor, began = 0, self.monitor, time.thread_time()
        for piece in np.array_split(times, min(PIECES, len(times))):
            aside = monitor.aside
            rows, stop = self._looked_at(piece)
            given += len(rows)
            monitor.aside = aside + time.thread_time() - began
            yield np.array(rows)
            began = time.thread_time()
            if stop:
                self._once_more(times[:given])
                raise stop
        self._once_more(times)

    def _looked_at(self, times: Array) -> tuple[list[Array], Stopped | None]:
        """Return the unknowns at these times, each step on the way looked at, as far as the run comes; and why it stops."""
        monitor, rows = self.monitor, list[Array]()
        try:
            for t in map(float, times):
                while monitor.t < t:
                    self._step()
                y = self._unknowns(self.series.update_d_output(t))
                monitor.require_inside(y)
                rows.append(y)
        except Stopped as stop:
            return rows, stop
        return rows, None

    def _once_more(self, times: Array) -> None:
        """Propagate over the times in one piece, from the start to where the run has come."""
        series, monitor = self.series, self.monitor
        if not monitor.steps:
            return
        began = time.thread_time()
        series.time, series.state[:] = 0.0, self.start
        series.step(max_delta_t=FIRST * monitor.t_end)
        grid = np.concatenate([[series.time], times[times > series.time]])
        monitor.aside += time.thread_time() - began  # one step is left out with the making of the grid
        series.propagate_grid(grid)

    def _step(self) -> None:
        """Make a step, and look at it."""
        series, monitor = self.series, self.monitor
        outcome, _ = series.step(max_delta_t=monitor.t_end - monitor.t if monitor.steps else FIRST * monitor.t_end, write_tc=True)
        if outcome == self.failed:
            raise Stopped(f"a value is no longer finite after t = {monitor.t:.9g}", monitor.t)
        monitor.stepped(float(series.time), self._unknowns(series.state))
        if time.perf_counter() > monitor.deadline:
            raise Stopped(f"the limit of {monitor.limit:g} s is reached", advice="allow more time, or use a larger tol")
        if monitor.steps >= MOST_STEPS:
            raise Stopped(f"{MOST_STEPS} steps were not enough")

    def _unknowns(self, state: Array) -> Array:
        """Return a state in the unknowns that others have: velocities in place of momenta where they have these; as a copy."""
        y = np.array(state)
        if self.velocity is not None:
            y[len(y) // 2 :] = self.velocity(y)
        return y

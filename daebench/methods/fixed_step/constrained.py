"""Fixed-step methods for constrained problems, linked to a problem and run."""

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import Any

import numpy as np

from daebench.compiler.facts import WORK, WRITTEN_OUT, in_loops
from daebench.errors import BadInput
from daebench.methods.fixed_step.base import FixedStepMethod
from daebench.methods.fixed_step.constraint_structure import require_reached
from daebench.methods.fixed_step.parts import Parts
from daebench.methods.fixed_step.rank_loss import RankRun, loss_at_start
from daebench.methods.fixed_step.reasons import REASONS, SIMPLIFIED
from daebench.methods.fixed_step.stepping import Run
from daebench.methods.monitored_errors import monitored_names
from daebench.runs.grid import Grid
from daebench.runs.ivp import ConstrainedIvp
from daebench.runs.request import Request
from daebench.runs.scales import constrained_scales, in_coordinates
from daebench.runs.trajectory import Array, Trajectory
from daebench.schemes.kernels.claims import CHARTED
from daebench.schemes.kernels.language import ROUNDINGS

MEAN = "mean"
"""Name of the mean of the last multiplier of a step and the first of the next: (mu_{n-1} + lam_n)/2 of RATTLE."""


@dataclass(frozen=True)
class FixedStep(Parts, FixedStepMethod[ConstrainedIvp, Trajectory]):
    """A scheme of ``daebench.schemes`` run with constant step size."""

    compiled: bool = True
    """Whether the kernel is compiled."""
    sweeps: int = 0
    """Number of iterations after which Newton's iteration is ended, converged or not; 0 for convergence."""
    roundings: float = ROUNDINGS
    """Size of an increment, in roundings, that ends Newton's iteration."""
    counted = WORK

    @property
    def _solves(self) -> bool:
        """Whether systems of constraints are solved, in its own coordinates: those of a chart and of ``stiff`` have none."""
        return self.form not in (*CHARTED, "stiff")

    @property
    def rated(self) -> bool:
        """Whether its steps need the rate of the motion, as those of a scheme for any H do."""
        return self.member.claims.any_form

    def on_singular(self, ivp: ConstrainedIvp, request: Request) -> str:
        """Return the choice where G loses rank: one of :data:`daebench.runs.request.ON_SINGULAR`, or "" if it does not matter."""
        mode = request.at_rank_loss(ivp)
        if mode == "least-squares" and ivp.arrays:
            raise BadInput(
                f"{self.name} on {ivp.facts.NODES} nodes of {ivp.problem} solves banded systems, and not by least squares; "
                "use continue, or fewer nodes.",
                "least-squares-on-bands",
            )
        if request.on_singular == "least-squares" and not self._solves:
            raise BadInput(
                f"{self.name} solves no systems of constraints, and therefore none by least squares; leave out on_singular.",
                "least-squares-unsolved",
            )
        return mode if self._solves and ivp.m else ""

    @property
    def scheme_module(self) -> str:
        """Name of the module that the scheme is in, alone or with its family."""
        return f"daebench.schemes.{self.file}"

    def _derivation(self, ivp: ConstrainedIvp) -> Any:
        return ivp.source.form(self.form)

    def _structure(self, *, stage_multipliers: bool, singular: str) -> dict[str, Any]:
        return {
            "stages": self.member.stages,
            "compensated": self.compensated,
            "projection": self.projection,
            "stage_multipliers": len(self.member.multipliers()) if stage_multipliers else 0,
            "asked": self._asked,
            "singular": ("least-squares" if singular == "least-squares" else "watch") if singular and self._solves else "",
        }

    def _in_loops(self, ivp: ConstrainedIvp, precision: str) -> bool:
        """Return whether a kernel takes arrays; a scheme that puts multipliers together of numbers, or a chart, takes tuples."""
        written = self.form in CHARTED or hasattr(self.module, "multiplier")
        return self.compiled and not written and in_loops(ivp.facts, precision)

    def _coordinates(self, ivp: ConstrainedIvp) -> tuple[Callable[[Sequence[Any]], Any], Callable[[Any], Sequence[Any]]]:
        if not (self.system.enter and self.system.leave):
            return _same, _same
        enter, leave = self.system.enter(ivp), self.system.leave(ivp)
        return lambda vectors: enter(*vectors), lambda x: leave(*x)

    @property
    def _asked(self) -> bool:
        """Whether Newton's iteration is ended otherwise than at round-off."""
        return bool(self.sweeps) or self.roundings != ROUNDINGS

    @cached_property
    def data(self) -> tuple[Any, ...]:
        """Run-time data: the scheme's numbers, the form's, and how Newton's iteration is ended where that is not at round-off."""
        return (*super().data, *[(float(self.sweeps), self.roundings)] * self._asked)

    def _scales(self, ivp: ConstrainedIvp, h: float) -> tuple[float, float]:
        scales = constrained_scales(ivp, h, rated=self.rated)
        if not (self.system.enter and self.system.leave):
            return scales
        return in_coordinates(scales, self.system.leave(ivp), self.system.enter(ivp)(*ivp.start), 1, timed=ivp.facts.EXTENDED)

    def _reasons(self, ivp: ConstrainedIvp) -> Mapping[int, tuple[str, str]]:
        return SIMPLIFIED if self.member.simplified and self.form != "stiff" else REASONS

    def _trajectory(self, ivp: ConstrainedIvp, request: Request, run: Run) -> Trajectory:
        outcome, (t, rows) = run.outcome(), run.states()
        d, m = int(ivp.facts.D), int(ivp.facts.M)
        # Contiguous vectors of the trajectory's own, and no views of the rows of the run.
        p, q = rows[:, :d].copy(), rows[:, d:].copy()
        return Trajectory(
            **outcome,
            t=t,
            q=q,
            p=p,
            lam=run.ivp.along("lam", p, q) if request.multipliers else None,
            raw=stage_multipliers(self.member.multipliers(), run.multipliers(), run.grid.h, m) if request.raw else {},
            passages=tuple(run.passages),
            sensitivities=self._sensitivities(run, len(t), q=slice(d, 2 * d), p=slice(d)),
        )

    def _ready(self, ivp: ConstrainedIvp, request: Request, grid: Grid, monitored: tuple[str, ...]) -> Callable[..., Run]:
        """Return the maker of a run at its start, which monitors whether G keeps its rank."""
        began = time.perf_counter()
        mode = self.on_singular(ivp, request)
        # Functions that the run evaluates, such as lam, solve singular systems as its steps do.
        ivp = replace(ivp, on_singular=mode)
        number = self._number(ivp, request)
        kernel = self.kernel(ivp, number, monitored, count=request.count, stage_multipliers=request.raw, singular=mode)
        kind: Callable[..., Run] = partial(RankRun, mode, loss_at_start(ivp, mode, kernel, grid.h)) if mode else Run
        return partial(
            kind,
            self._differentiated(ivp, request, grid, kernel),
            ivp,
            request,
            grid,
            names=monitored_names(monitored, ivp),
            stage_multipliers=len(self.member.multipliers()) * ivp.m if request.raw else 0,
            linking=[time.perf_counter() - began],
        )

    def _require(self, ivp: ConstrainedIvp, request: Request) -> None:
        self.on_singular(ivp, request)
        if request.precision == "mixed":
            _require_mixed(self, ivp)
        if "tolerance" in self.member.options:
            require_reached(self.name, {**self.member.options, **self.options}["tolerance"], request.precision)

    def grid(self, ivp: ConstrainedIvp, request: Request) -> Grid:
        """Return the steps that a request comes to; raise :class:`BadInput` if it cannot be met."""
        grid = super().grid(ivp, request)
        if request.raw and (self.composition or not self.member.multipliers()):
            why = "those of a composition belong to its substeps" if self.composition else "it computes none"
            raise BadInput(f"{self.name} has no stage multipliers: {why}; ask for lam(p, q) instead.", "no-stage-multipliers")
        if request.raw and grid.every != 1:
            raise BadInput(f"stage multipliers are stored for every step; leave out every = {grid.every}.", "stage-multipliers-every")
        return grid


def _same(vectors: Sequence[Any]) -> tuple[Any, ...]:
    return tuple(map(tuple, vectors))


def _require_mixed(method: FixedStep, ivp: ConstrainedIvp) -> None:
    """Refuse to compute in mixed precision where forces are not a function U_q(q), or their rounding would enter an iteration.

    The increments of an iteration do not become smaller than the rounding of the functions that it evaluates. With forces in single
    precision it therefore does not converge in double precision.
    """
    if why := _obstacle(method, ivp):
        raise BadInput(
            f"{method.name} on {ivp.problem} cannot compute in mixed precision: {why}; use float64 or float32.", "mixed-precision-refused"
        )


def _obstacle(method: FixedStep, ivp: ConstrainedIvp) -> str:
    """Return why forces cannot be computed in single precision alone, or ""."""
    if ivp.facts.EXTENDED or ivp.facts.FORCED:
        return "it needs a system without forces that depend on time or velocity"
    if not ivp.facts.SEPARABLE:
        return "it needs H = 1/2 p^T M^-1 p + U(q) with constant M"
    if ivp.arrays or int(ivp.facts.D) > WRITTEN_OUT:
        return "its forces are computed in loops, of which there are none in single precision"
    if method.form:
        return f"forces are not computed apart in the form {method.form}"
    if "H_q" in method.iterated(ivp):
        return "the scheme evaluates forces in an iteration, which does not converge beyond single precision"
    return ""


def stage_multipliers(nodes: Mapping[str, float], rows: Array, h: float, m: int) -> dict[str, tuple[Array, Array]]:
    """Return times and values, shape(n, m), of each stage multiplier, and of the mean where two steps meet.

    A multiplier of node c belongs to t_n + c h; ``rows``, shape(steps, k m), are what the steps returned, one after another. ``mean`` is
    there if the first multiplier belongs to the start of a step and the last to its end: of first order each with RATTLE, the mean of the
    two that meet at t_n is of second.
    """
    n = np.arange(len(rows), dtype=float)
    series = {name: ((n + c) * h, rows[:, k * m : (k + 1) * m]) for k, (name, c) in enumerate(nodes.items())}
    ends = list(nodes.items())
    if len(ends) > 1 and ends[0][1] == 0.0 and ends[-1][1] == 1.0:
        series[MEAN] = (n[1:] * h, (series[ends[-1][0]][1][:-1] + series[ends[0][0]][1][1:]) / 2)
    return series

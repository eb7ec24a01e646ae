"""A tolerance-driven run on a constrained problem: its start, its trajectory, and the solvers of the index-reduced ODE."""

import time
from collections.abc import Collection
from dataclasses import dataclass, replace
from typing import Any, ClassVar

import numpy as np

from daebench.compiler.under_way import uncollected
from daebench.diagnostics.combined import combined
from daebench.diagnostics.freedom import dependence, redundant
from daebench.errors import BadInput, DaebenchError, unknown
from daebench.methods.formulations.chain import refused
from daebench.methods.formulations.constrained import Dae
from daebench.methods.formulations.variation import VariedDae, varied
from daebench.methods.monitored_errors import output_maxima
from daebench.methods.solvers.drive import Array, Driven, ToleranceMethod, check, check_record, drive
from daebench.methods.solvers.least_squares import reduced
from daebench.methods.solvers.rank_monitor import COMBINED, RankMonitor
from daebench.runs.directions import directions
from daebench.runs.ivp import ConstrainedIvp, Ivp
from daebench.runs.members import Members
from daebench.runs.request import Request
from daebench.runs.trajectory import Passage, Trajectory


class OnConstrained(ToleranceMethod):
    """A tolerance-driven method on constrained problems, whose runs monitor whether G keeps its rank."""

    @property
    def combines(self) -> bool:
        """Whether it takes independent combinations of redundant constraints in the place of least squares."""
        return False

    def check(self, ivp: ConstrainedIvp, request: Request) -> None:
        """Accept a request that can be met; raise :class:`BadInput` otherwise."""
        check(self.name, request, self.least)
        check_record(self, request)
        if refusal := self.refusal(ivp):
            raise BadInput(refusal, "method-refuses-problem")

    def least_squares(self, ivp: ConstrainedIvp, request: Request) -> bool:
        """Return whether least squares are asked for, and no constraints to combine, as those that are redundant for good are."""
        return request.at_rank_loss(ivp) == "least-squares" and not redundant(ivp)

    def solve(self, ivp: ConstrainedIvp, request: Request) -> Trajectory:
        """Return the trajectory; where the solver stops early, the outputs so far and why.

        With ``least-squares`` some methods take combinations of constraints that are redundant for good; multipliers are still those of
        all, of least norm.
        """
        began = time.perf_counter()
        self.check(ivp, request)
        mode = request.at_rank_loss(ivp)
        ivp = replace(ivp, on_singular=mode)
        if mode != "least-squares" and (why := dependence(ivp)):
            where = f"{self.name} cannot start on {ivp.problem}, case {ivp.case}"
            raise DaebenchError(f"{where}: G M^-1 G^T is singular there; {why}.", "constraints-dependent")
        with uncollected():
            posed = combined(ivp) if mode == "least-squares" and self.combines else ivp
            mode = COMBINED if posed is not ivp else mode
            dae = self._posed(posed)
            if request.sensitivities:
                dae = varied(dae, directions(posed, request.sensitivities))
        monitors: list[RankMonitor] = []

        def make_monitor(*settings: Any) -> RankMonitor:
            monitors.append(RankMonitor(dae, mode, *settings))
            return monitors[-1]

        run = drive(self, dae, request, began=began, make_monitor=make_monitor)
        failure = run.outcome["failure"]
        if failure and not run.outcome["interrupted"]:
            run = replace(run, outcome={**run.outcome, "failure": f"{failure[:-1]}{monitors[-1].reason()}."})
        return _trajectory(ivp, dae, request, run, monitors[-1].ended())


@uncollected()
def _trajectory(ivp: ConstrainedIvp, dae: Dae, request: Request, run: Driven, passages: tuple[Passage, ...]) -> Trajectory:
    """Return the trajectory: momenta in the place of velocities, and the monitored quantities, over all outputs."""
    selection = run.kept
    q, v = dae.unpack(run.Y)
    p = dae.momenta(q, v)
    p[0] = ivp.p0  # as given, without the round-off of p = M v
    monitored = request.watched(ivp.state)
    return Trajectory(
        **run.outcome,
        t=run.t[selection],
        q=q[selection],
        p=p[selection],
        lam=ivp.along("lam", p[selection], q[selection]) if request.multipliers else None,
        maxima=output_maxima(ivp, monitored, p, q),
        pivot=_smallest_pivot(ivp, p, q) if "manifold" in monitored else None,
        passages=passages,
        sensitivities=dae.sensitivities(run.Y[selection]) if isinstance(dae, VariedDae) else {},
    )


def _smallest_pivot(ivp: ConstrainedIvp, p: Array, q: Array) -> float:
    """Return the smallest relative pivot of G H_pp G^T over all outputs: no solver's flag tells of rank loss, this does."""
    if ivp.arrays:
        return float(np.min(ivp.along("independence", p, q)))
    rows, _ = Members(ivp, (p, q), 0.0, {}).rows("lam_and_pivot", p, q)
    return float(min(rows[:, -1].tolist()))


@dataclass(frozen=True)
class OnReducedOde(OnConstrained):
    """A tolerance-driven solver on formulation ``ode``, HLW (1.18), with the analytic Jacobian where it uses one."""

    variant: str
    """One of the solver's own methods."""
    solver: ClassVar[str]
    variants: ClassVar[Collection[str]]

    def __post_init__(self) -> None:
        if self.variant not in self.variants:
            raise unknown(f"method of {self.solver}", self.variant, self.variants)

    @property
    def name(self) -> str:
        """Name in the grammar of methods."""
        return f"{self.solver}:{self.variant}"

    @property
    def dense(self) -> bool:
        """Whether it solves with the whole Jacobian."""
        return True

    def refusal(self, ivp: ConstrainedIvp) -> str | None:
        """Return why there is no ODE to solve, as a sentence, or None: a long chain has none, every other problem has one."""
        return refused(self.name, ivp) or self.lacks(ivp)

    def lacks(self, ivp: Ivp) -> str | None:
        """Return why the solver cannot solve the ODE of a problem for another reason, as a sentence, or None."""
        return None

    def _posed(self, ivp: ConstrainedIvp) -> Dae:
        return reduced(ivp)

    @property
    def _advice(self) -> str:
        return "use a larger tol, and see whether G keeps its rank"

"""A tolerance-driven run on a constrained problem: what it needs at the start, and its trajectory from what the solver gave."""

import time
from dataclasses import replace
from typing import Any

import numpy as np

from daebench.compiler.under_way import uncollected
from daebench.diagnostics.combined import combined
from daebench.diagnostics.freedom import dependence, redundant
from daebench.errors import BadInput, DaebenchError
from daebench.methods.formulations.chain import BandedDae
from daebench.methods.formulations.constrained import Dae
from daebench.methods.formulations.variation import VariedDae, varied
from daebench.methods.monitored_errors import output_maxima
from daebench.methods.solvers.drive import Array, Driven, ToleranceMethod, check, check_record, drive
from daebench.methods.solvers.rank_monitor import COMBINED, ChainRankMonitor, RankMonitor
from daebench.runs.directions import directions
from daebench.runs.ivp import ConstrainedIvp
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
            raise BadInput(refusal)

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
            raise DaebenchError(f"{where}: G M^-1 G^T is singular there; {why}.")
        with uncollected():
            posed = combined(ivp) if mode == "least-squares" and self.combines else ivp
            mode = COMBINED if posed is not ivp else mode
            dae = self._posed(posed)
            if request.sensitivities:
                dae = varied(dae, directions(posed, request.sensitivities))
        monitors: list[RankMonitor] = []

        def make_monitor(*settings: Any) -> RankMonitor:
            monitors.append((ChainRankMonitor if isinstance(dae, BandedDae) else RankMonitor)(dae, mode, *settings))
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

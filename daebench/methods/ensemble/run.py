"""Runs of all members of an ensemble: in lanes if the scheme's kernel can be compiled for them, and otherwise one by one."""

import time
from collections.abc import Iterable
from dataclasses import replace
from typing import Any

import numpy as np

from daebench.compiler.lane_entries import DONE, RESIDUAL, STATUS, TRIED
from daebench.compiler.native import no_machine_code
from daebench.diagnostics.rank import AFTER_FAILURE, may_lose_rank, upcoming_losses
from daebench.errors import BadInput
from daebench.methods.ensemble.lanes import REFUSED, Carried, LaneRun, form_of, nested, width_for
from daebench.methods.ensemble.result import EnsembleRun, Table
from daebench.methods.fixed_step.base import FixedStepMethod
from daebench.methods.fixed_step.stepping import Linked, Run
from daebench.methods.monitored_errors import monitored_names
from daebench.runs.grid import Grid, require_memory_of_members
from daebench.runs.machine import cores
from daebench.runs.members import Members, flat
from daebench.runs.request import Request
from daebench.runs.scales import scales_of
from daebench.runs.trajectory import Array
from daebench.schemes.kernels.claims import MAPPED
from daebench.schemes.kernels.loop import ERROR_NOT_FINITE
from daebench.schemes.kernels.newton import SINGULAR
from daebench.schemes.kernels.rank import RANK_LOST


def run_members(
    method: FixedStepMethod[Any, Any], members: Members, request: Request, *, lanes: int | None = None, threads: int | None = None
) -> EnsembleRun:
    """Return the runs of all members, each equal to the bit to a single run."""
    ensemble = _Ensemble(method, members, request)
    width = ensemble.width(lanes)
    return ensemble.one_by_one() if width == 1 else ensemble.in_lanes(width, threads or cores())


def sampled_members(method: FixedStepMethod[Any, Any], members: Members, request: Request, rows: int) -> tuple[LaneRun, Array] | None:
    """Return runs of members in lanes at their start, and where H is stored in place of states, shape(rows, 1, columns).

    None is returned where members are not run in lanes.
    """
    ensemble = _Ensemble(method, members, request, ("samples",))
    if (width := ensemble.width(None)) == 1:
        return None
    samples = np.empty((rows, 1, padded(len(members), width)))
    return ensemble.begun(width, samples), samples


def padded(members: int, lanes: int) -> int:
    """Return the number of columns of so many members in whole blocks."""
    return -(-members // lanes) * lanes


class _Ensemble:
    """One method, the members, and the request for each."""

    def __init__(self, method: FixedStepMethod[Any, Any], members: Members, request: Request, watch: tuple[str, ...] | None = None) -> None:
        self.began = time.perf_counter()
        self.method, self.members, self.ivp = method, members, members.ivp
        self.request = replace(request, value=float(np.max(members.h)), every=request.every or 0)
        if request.precision != "float64" or request.raw or request.sensitivities or request.steps is None:
            raise BadInput(
                "members of an ensemble take a number of steps in float64, without stage multipliers and sensitivities.",
                "ensemble-request-unsupported",
            )
        if members.weights is not None and members.weights.shape[1] != len(method.weights):
            composed = (
                f"{method.name} takes {len(method.weights)} in a step" if len(method.weights) else f"{method.name} is not a composition"
            )
            raise BadInput(
                f"members have {members.weights.shape[1]} weights each, and {composed}; give as many, one for each substep.",
                "weights-per-member-count",
            )
        self.grid: Grid = method.grid(self.ivp, self.request)
        require_memory_of_members(self.grid.rows, self.ivp.size, len(members))
        self.watch = self.request.watched(self.ivp.state) if watch is None else watch
        self.names = monitored_names(self.watch, self.ivp)
        self._losses: Any = None
        self.mode: str = method.on_singular(self.ivp, self.request)

    def width(self, wanted: int | None) -> int:
        """Return how many members are run at once on one core."""
        if self.ivp.arrays or self.mode == "least-squares" or not self.method.compiled or no_machine_code():
            return 1
        return wanted or width_for(len(self.members))

    def _table(self, columns: int) -> Table:
        return Table(self.members, self.grid, self.names, self.method.counted, columns)

    # ---- one by one ------------------------------------------------------------------------------------------------------

    def one_by_one(self) -> EnsembleRun:
        """Run one member after another."""
        table = self._table(len(self.members))
        runs = range(len(self.members))
        self._singly(table, runs)
        return self._result(table, 1, 0.0)

    def _singly(self, table: Table, members: Iterable[int]) -> None:
        """Run some members by themselves, those too that cannot be begun: why is what such a run says."""
        for i in members:
            try:
                table.fill_one(int(i), self._alone(int(i)))
            except BadInput as error:
                table.refuse(int(i), str(error))
            if self.request.progress:
                self.request.progress((int(i) + 1) / len(self.members))

    def _alone(self, i: int) -> Run:
        """Return the run of one member at its start."""
        h = self.members.step_size(i)
        request = replace(self.request, value=h, progress=None)
        weights = self.members.weights
        method = self.method if weights is None else self.method.weighted(weights[i])
        run: Run = method.begin(self.members.member(i), request, replace(self.grid, h=h), self.watch)
        return run

    # ---- in lanes --------------------------------------------------------------------------------------------------------

    def begun(self, lanes: int, rows: Array) -> LaneRun:
        """Return the runs of all members at their start, in lanes, with rows for what is stored."""
        kernel = self.method.kernel(self.ivp, f"lanes{lanes}", self.watch, count=self.request.count, singular=self.mode)
        linked = self.method.linked(self.ivp, kernel, self.members.step_size(0))
        states, scales = self._entered(kernel)
        conserved = len(self.names) - 2 * ("manifold" in self.watch) + ("samples" in self.watch)
        carried = Carried(form_of(linked.enter(self.ivp.start)), (0.0, 0.0, 0.0) if self.mode else 0.0, conserved, len(self.names))
        run = LaneRun(linked, self.members, scales, states, carried, self.grid, rows, lanes=lanes)
        run.counts[STATUS, self._near_rank_loss()] = REFUSED
        run.begin()
        return run

    def in_lanes(self, lanes: int, threads: int) -> EnsembleRun:
        """Run all members in lanes; those at which G loses rank go on by themselves from there."""
        table = self._table(padded(len(self.members), lanes))
        run = self.begun(lanes, table.rows)
        compiled = time.perf_counter() - self.began
        run.march(threads, self.request.progress)
        table.fill(run, self._left(run.linked, run))
        self._require_energy(table)
        for i in np.flatnonzero(table.status == RANK_LOST):
            table.fill_one(int(i), self._continued(int(i), run, table))
        self._singly(table, np.flatnonzero(table.status == REFUSED))
        return self._result(table, lanes, compiled, run)

    def _entered(self, kernel: Any) -> tuple[Array, tuple[Array, Array]]:
        """Return the scheme's own state at the start of each member, NaN where it has no place there; and lengths and rates."""
        if self.method.form not in MAPPED:
            states = np.concatenate(self.members.start, axis=1)
            return states, scales_of(self.members, rated=self.method.rated)
        rows, scales = [], []
        for i in range(len(self.members)):
            ivp = self.members.member(i)
            try:
                linked = self.method.linked(ivp, kernel, self.members.step_size(i))
                rows.append(flat(linked.enter(ivp.start)))
                scales.append(linked.par[len(ivp.par)])
            except BadInput:
                rows.append([np.nan])
                scales.append((np.nan, np.nan))
        size = max(map(len, rows))
        length, rate = np.array(scales).T
        return np.array([row if len(row) == size else [np.nan] * size for row in rows]), (length, rate)

    def _left(self, linked: Linked, run: LaneRun) -> Array:
        """Return the last good states of all members."""
        size = len(flat(run.carried.x))
        ends: Array = run.numbers[:size, : run.n].T.copy()
        if self.method.form not in MAPPED:
            return ends
        result = np.concatenate(self.members.start, axis=1)
        for i in np.flatnonzero(run.counts[DONE, : run.n]):
            ivp = self.members.member(int(i))
            leave = self.method.linked(ivp, linked.kernel, self.members.step_size(int(i))).leave
            result[i] = np.asarray(leave(nested(run.carried.x, iter(ends[i].tolist()))), dtype=float)
        return result

    def _near_rank_loss(self) -> Any:
        """Return the members whose G may lose rank in their first steps, or has lost it; they are run by themselves."""
        if not self.mode:
            return np.empty(0, dtype=np.int64)
        return np.flatnonzero(may_lose_rank(self.members))

    def _continued(self, i: int, run: LaneRun, table: Table) -> Run:
        """Return the run of one member by itself, from the step before that in which G loses rank."""
        alone = self._at_end(i, run, table)
        alone.rank_pending = True
        return alone

    def _at_end(self, i: int, run: LaneRun, table: Table) -> Run:
        """Return the run of one member by itself, where its lane has stopped."""
        alone = self._alone(i)
        alone.carried = run.carried_by(i, alone.memory)
        alone.done = int(table.steps[i])
        alone.row = alone.done // self.grid.every if self.grid.every else 0
        alone.left = self.grid.every - alone.done % self.grid.every if self.grid.every else -1
        alone.work = table.work[:, i].copy()
        alone.state_rows[: alone.row] = table.rows[: alone.row, :, i]
        alone.failure = None
        return alone

    def _require_energy(self, table: Table) -> None:
        """Find members whose H is not finite at their end, where it was not monitored."""
        if "energy" in self.names:
            return
        energies = self.members.of_states("H", table.ends)
        table.status[(table.status == 0) & ~np.isfinite(energies)] = ERROR_NOT_FINITE

    def _result(self, table: Table, lanes: int, compiled: float, run: LaneRun | None = None) -> EnsembleRun:
        return EnsembleRun(
            members=self.members,
            method=self.method.name,
            index=table.index,
            states=table.states,
            ends=table.ends,
            steps=table.steps,
            status=table.status,
            maxima=dict(zip(self.names, table.maxima, strict=True)),
            pivots=table.pivots,
            work=dict(zip(self.method.counted, table.work, strict=True)) if self.request.count else {},
            seconds=table.seconds,
            compile_seconds=compiled,
            lanes=lanes,
            sentence=lambda i: table.sentences.get(i) or self._sentence(i, run, table),
        )

    def _sentence(self, i: int, run: LaneRun | None, table: Table) -> str:
        """Return why a member stopped in its lane: what its run by itself says there."""
        assert run is not None
        place, tried = run.places[RESIDUAL], int(run.counts[TRIED, i])
        report = (int(table.status[i]), *map(float, run.numbers[place : place + 2, i]))
        at_end = table.status[i] == ERROR_NOT_FINITE and table.steps[i] == self.grid.steps
        if not at_end and not self._loses_rank(table)[i] and not (self.mode and report[0] == SINGULAR):
            linked = run.linked if self.members.weights is None else replace(run.linked, weights=self.members.weights[i])
            return linked.failure(self.ivp, self.members.step_size(i), int(table.steps[i]), self.grid.steps, tried, report)
        alone = self._at_end(i, run, table)
        return str(alone.outcome()["failure"]) if at_end else alone.sentence(report, tried)

    def _loses_rank(self, table: Table) -> Any:
        """Return at which members G may lose rank after the last good state, shape(n,); a sentence says when."""
        if self._losses is None:
            self._losses = np.zeros(len(self.members), dtype=bool)
            if self.mode:
                p, q = self.ivp.vectors(table.ends)
                self._losses = ~np.isnan(upcoming_losses(self.members, p, q, AFTER_FAILURE))
        return self._losses

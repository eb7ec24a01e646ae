"""A run of IDA or CVODE with compiled callbacks: the loop over steps, and the monitor where a step is to be looked at."""

import time
from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np

from daebench.compiler import callbacks
from daebench.compiler.entry import Memory
from daebench.errors import BadInput, Stopped
from daebench.methods.formulations.chain import BandedDae
from daebench.methods.formulations.constrained import Posed
from daebench.methods.solvers.drive import MOST_STEPS, Advance, Array
from daebench.methods.solvers.monitor import Monitor
from daebench.methods.solvers.monitored import MOST_UNKNOWNS
from daebench.methods.solvers.native import loop
from daebench.methods.solvers.native.libraries import Unavailable
from daebench.methods.solvers.native.memory import ADAMS, BDF, IDA, PLAIN, Settings, Solver
from daebench.methods.solvers.native.recorder import ROWS, Recorder
from daebench.methods.solvers.rank_monitor import KEPT, RankMonitor
from daebench.methods.solvers.step_check import COLLAPSE
from daebench.methods.solvers.sundials import REASONS

__all__ = ["ADAMS", "BDF", "IDA", "PLAIN", "Settings", "begin"]

PIECE = 0.02
"""Time after which the loop comes back, s: signals, limits and progress are seen then."""

TICK = 1e-9
"""Least time that a clock tells of a piece, s."""

FIRST = 20_000
"""Steps of the first piece, of one unknown; of more unknowns as many fewer."""

LOOKED_AGAIN = 40
"""To tell how long a look takes, one step in so many is looked at again, but no more than so many of them."""


def begin(posed: Posed, family: int, tol: float, atol: Array, monitor: Monitor, settings: Settings = PLAIN) -> Advance | None:
    """Compile the functions of a run, and return how the solver is advanced over output times; None where that cannot or need not be.

    Shapes: atol (n,).
    """
    law = monitor.monitored
    compiled = law is not None and law.compiled and hasattr(posed.module, "residual_callback")
    monitor.callbacks = "python"
    why = "they are not compiled"
    try:
        if monitor.native and compiled:
            run = _Run(posed, family, tol, atol, monitor, settings)
            monitor.callbacks = "native"
            return run.outputs
    except Unavailable as error:
        why = str(error)
    if monitor.recording or settings is not PLAIN:
        what = "a record of its steps" if monitor.recording else "this method"
        raise BadInput(
            f"{what} needs compiled callbacks, and on {posed.ivp.problem} {why}; leave it out, or use another method.",
            "native-callbacks-missing",
        )
    return None


class _Run:
    """One run, between the compiled loop and the monitor."""

    def __init__(self, posed: Posed, family: int, tol: float, atol: Array, monitor: Monitor, settings: Settings) -> None:
        self.posed, self.monitor, self.family = posed, monitor, family
        self.user = np.zeros(callbacks.HEAD + len(posed.par))
        self.user[callbacks.HEAD :] = posed.par
        self.user[callbacks.UNKNOWNS], self.user[callbacks.PARAMETERS] = posed.n, len(posed.par)
        self.memory = Memory.of_unknowns(posed.n)
        self.user.view(np.uint64)[callbacks.ARENA] = self.memory.begun()
        self.solver = Solver(posed, family, tol, atol, self.user, settings)
        try:
            self._prepare()
        except BaseException:
            self.solver.free()
            raise

    def _prepare(self) -> None:
        """Write down all that the compiled loop needs to know."""
        monitor, law, words = self.monitor, self.monitor.monitored, self.user.view(np.uint64)
        assert law is not None
        limit = monitor.work_limit
        self.user[callbacks.MOST] = limit.calls if limit else np.inf
        self.user[callbacks.SLOW] = limit.slow_calls if limit else 0
        self.user[callbacks.SPAN] = monitor.t_end / limit.slow_part if limit else 0.0
        self.user[callbacks.TOLERANCE], self.user[callbacks.POSITIONS] = law.tol, law.positions
        words[callbacks.BEFORE] = self.solver.y[2].ctypes.data
        if isinstance(self.posed, BandedDae):
            self.order = np.ascontiguousarray(self.posed.order, dtype=np.uint64)
            words[callbacks.ORDER] = self.order.ctypes.data
        self.t, self.counts = np.array([0.0, 0.0, 0.0, COLLAPSE * monitor.t_end]), np.array([0, 0, 0, 1, 1, 0])
        given = [array.ctypes.data for array in (self.solver.y[0], self.solver.y[1], self.t, self.user)]
        self.calls = np.array([self.solver.step, self.solver.interpolation, law.address, *given], np.uint64)
        self.kept = np.empty((2 * KEPT + 1, self.posed.n))
        self.kept[0] = self.solver.y[0]
        self.recorder = Recorder(self.solver, self.posed, self.counts, law.tol) if monitor.recording else None
        monitor.recorder = self.recorder
        self.loop = loop.compiled()
        self._hand_over()
        self._advance(np.array([monitor.t_end]), np.empty((1, self.posed.n)), 0)  # compiled before the clock runs
        self._price(1)

    def outputs(self, times: Array) -> Iterator[Array]:
        """Go on to each of these times, and give the unknowns there as they come, some rows at once."""
        rows, given, budget = np.empty((len(times), self.posed.n)), 0, max(1, FIRST // self.posed.n)
        with self.solver, self._looks_aside():
            self.solver.end = float(times[-1])
            self.solver("SetStopTime", self.solver.end)
            while True:
                began = time.perf_counter()
                budget = min(budget, ROWS) if self.recorder else budget
                reason = self._advance(times, rows, budget)
                lasted = time.perf_counter() - began
                if self.counts[loop.OUTPUTS] > given:
                    yield self._in_blocks(rows[given : self.counts[loop.OUTPUTS]])
                    given = self.counts[loop.OUTPUTS]
                self._settle(reason, rows)
                if reason == loop.ENDED:
                    return
                self.monitor.require_time()
                if reason == loop.BUDGET:
                    budget = max(1, min(4 * budget, int(budget * PIECE / max(lasted, TICK))))

    @contextmanager
    def _looks_aside(self) -> Iterator[None]:
        """Take the time of looks at steps and outputs, which is none of the solver's, from that of the run: so many times that of one."""
        try:
            yield
        finally:
            began, steps = time.thread_time(), int(self.counts[loop.STEPS])
            price = self._price(1 + min(steps // LOOKED_AGAIN, LOOKED_AGAIN))
            self.monitor.aside += (steps + int(self.counts[loop.OUTPUTS])) * price + time.thread_time() - began

    def _price(self, times: int) -> float:
        """Return the CPU time, s, of one look at the state at which the run is, by twice as many of them in place of so many."""
        user = self.user.copy()
        user[callbacks.MODE], user[callbacks.STEADY] = callbacks.STEP, 0.0
        least = [float("inf")] * 2
        for k in (0, 1) * 3:
            began = time.thread_time()
            self.loop.look_again(self.calls[2], self.t[0], self.calls[loop.STATE_AT], np.uint64(user.ctypes.data), (k + 1) * times)
            least[k] = min(least[k], time.thread_time() - began)
        return max(0.0, least[1] - least[0]) / times

    def _advance(self, times: Array, rows: Array, budget: int) -> int:
        """Let the loop go on; return why it came back, and count what was called."""
        solver = self.solver
        record = self.recorder.memory if self.recorder else None
        state = solver.vectors, solver.y, self.t, times, rows, self.counts, self.kept, self.user
        reason = int(self.loop.advance(not self.family, self.calls, solver.mem.value, *state, record, budget))
        self.memory.require_enough()
        names = {"rhs" if self.family else "residual": callbacks.RESIDUALS, "jacobian": callbacks.JACOBIANS}
        names |= {"projection": callbacks.PROJECTIONS}
        self.monitor.calls = {name: int(self.user[place]) for name, place in names.items() if self.user[place]}
        return reason

    def _settle(self, reason: int, rows: Array) -> None:
        """Tell the monitor how far the run has come, and let it look where something is to be looked at."""
        whole = reason in (loop.ENDED, loop.BUDGET)
        self._take_over(self.t[0 if whole else 1], self.solver.y[0 if whole else 2])
        if self.recorder:
            self.recorder.take()
        if reason == loop.SUSPICIOUS:
            if isinstance(self.monitor, RankMonitor):
                self.monitor.kept, self.monitor.stride = list(self.kept[: self.counts[loop.KEPT]]), 2**62  # the loop keeps them
            self.monitor.stepped(float(self.t[0]), self._in_blocks(self.solver.y[0]))
            self._hand_over()
        elif reason == loop.OUTSIDE:
            self.monitor.require_inside(self._in_blocks(rows[self.counts[loop.OUTPUTS]]))
            raise Stopped(f"the unknowns at t = {self.t[0]:.9g} are not where they may be")
        elif reason < 0:
            if self.recorder:
                self.recorder.refuse(reason, self.solver.y[2].copy())
            self._fail(reason)
        elif self.counts[loop.SINCE] > MOST_STEPS:
            raise Stopped(REASONS[-1])

    def _fail(self, flag: int) -> None:
        """Say why the solver could not go on."""
        kind, why, when = "rhs" if self.family else "residual", self.user[callbacks.WHY], float(self.user[callbacks.WHEN])
        if why == callbacks.ILL:
            self.monitor.ill(when, float(self.user[callbacks.HEALTH]))
        if why in (callbacks.SPENT, callbacks.CRAWLING):
            self.monitor.refuse_work(kind, crawling=why == callbacks.CRAWLING)
        raise Stopped(REASONS.get(flag, f"SUNDIALS returned {flag}"))

    def _take_over(self, t: float, y: Array) -> None:
        """Write the last step that the loop noted into the monitor."""
        monitor, user = self.monitor, self.user
        monitor.steps, monitor.t, monitor.y = int(self.counts[loop.STEPS]), float(t), self._in_blocks(y)
        monitor.mark = float(self.t[2])
        monitor.latest = tuple(user[callbacks.CONSERVED :][: len(monitor.latest)].tolist())
        monitor.jumps = user[callbacks.JUMPS :][: len(monitor.jumps)].tolist()
        if isinstance(monitor, RankMonitor):
            monitor.sigma = float(user[callbacks.SIGMA])
            if monitor.crossing is None:
                monitor.largest = float(user[callbacks.LARGEST])

    def _hand_over(self) -> None:
        """Write the monitor's last step into the memory of the loop; while it follows a loss of rank it sees every step."""
        monitor, user, law = self.monitor, self.user, self.monitor.monitored
        assert law is not None
        self.counts[loop.STEPS], self.t[2], user[callbacks.LAST] = monitor.steps, monitor.mark, monitor.t
        user[callbacks.CONSERVED :][: len(monitor.latest)] = monitor.latest
        user[callbacks.JUMPS :][: len(monitor.jumps)] = monitor.jumps
        user[callbacks.STEADY] = monitor.steady and law.size <= MOST_UNKNOWNS
        user[callbacks.SIGMA] = user[callbacks.LARGEST] = 1.0
        if isinstance(monitor, RankMonitor):
            user[callbacks.SIGMA] = monitor.sigma
            user[callbacks.LARGEST] = monitor.largest if monitor.crossing is None else np.inf

    def _in_blocks(self, y: Array) -> Array:
        """Return unknowns, or rows of them, in the order of the blocks, as a copy."""
        if not isinstance(self.posed, BandedDae):
            return y.copy()
        blocks = np.empty_like(y)
        blocks[..., self.posed.order] = y
        return blocks

"""The monitor of a run: counts and times of what a solver calls, and the reasons to stop it."""

import math
import time
from collections.abc import Callable
from typing import Any, NoReturn

import numpy as np

from daebench.compiler.callbacks import SINGULAR
from daebench.errors import Stopped
from daebench.methods.solvers.monitored import NAMES, Monitored
from daebench.methods.solvers.step_check import COLLAPSE, LEAST, SUDDEN
from daebench.runs.request import WorkLimit

LEFT = "end the run earlier, and check whether the motion leaves the domain of H or g there"
"""What to do where H or g has no value."""


OVER = "end the run earlier, and check whether bodies collide there, an entry of the mass matrix vanishes, or g has a cusp"
"""What to do where a step has gone over a singularity."""


class Monitor:
    """Counts and times what the callbacks do, and stops a run that has gone on for too long.

    ``seconds`` is the time of callbacks; ``aside`` the CPU time of looking at what a solver gave, which is none of the solver's. ``native``
    says whether callbacks of IDA and CVODE are to be machine code, and ``callbacks`` what they are; ``recording`` says whether their steps
    are to be recorded, and ``recorder`` has them.
    """

    def __init__(
        self,
        t_end: float,
        limit: float,
        work_limit: WorkLimit | None = None,
        outside: Callable[[Any], str] = lambda _: "",
        monitored: Monitored | None = None,
    ) -> None:
        self.t_end, self.limit, self.deadline, self.work_limit = t_end, limit, math.inf, work_limit
        self.outside, self.monitored = outside, monitored
        self.calls: dict[str, int] = {}
        self.steps, self.t, self.seconds, self.aside = 0, 0.0, 0.0, 0.0
        self.y: Any = None
        self.steady = self.native = True
        self.recording = False
        self.recorder: Any = None
        self.callbacks: str | None = None
        self.latest: tuple[float, ...] = ()
        self.jumps: list[float] = []
        self.mark = self._slow_mark = 0.0

    def start(self) -> None:
        """Let the wall clock run from now."""
        self.deadline = time.perf_counter() + self.limit

    def begin(self, y: Any) -> None:
        """Take note of the unknowns at the start."""
        self.y = np.array(y)
        self.latest = self.values(self.y)
        self.jumps = [0.0] * len(self.latest)
        if not math.isfinite(sum(self.latest)):
            raise Stopped(f"{_wrong(self.latest)} is not finite at the start", 0.0, "check parameters and initial values")

    def called(self, kind: str, t: float, health: float, began: float) -> None:
        """Take note of one evaluation of the residual, right side or Jacobian at time t, begun at ``began`` on the wall clock."""
        self.calls[kind] = self.calls.get(kind, 0) + 1
        now = time.perf_counter()
        self.seconds += now - began
        if not health > SINGULAR:
            self.ill(t, health)
        self.require_time(now)
        if self.work_limit is not None and kind != "jacobian":
            self._require_work_limit(self.work_limit, kind, t)

    def require_time(self, now: float | None = None) -> None:
        """Stop where the wall-clock limit is reached."""
        if (time.perf_counter() if now is None else now) > self.deadline:
            raise Stopped(f"the limit of {self.limit:g} s is reached", advice="allow more time, or use a larger tol")

    def _require_work_limit(self, work_limit: WorkLimit, kind: str, t: float) -> None:
        """Stop where so many calls are too many, or have covered too little."""
        if self.calls[kind] > work_limit.calls:
            self.refuse_work(kind, crawling=False)
        if self.calls[kind] % work_limit.slow_calls == 0:
            if t - self._slow_mark < self.t_end / work_limit.slow_part:
                self.refuse_work(kind, crawling=True)
            self._slow_mark = t

    def refuse_work(self, kind: str, *, crawling: bool) -> NoReturn:
        """Stop a run that has called a function too often, or often for too little."""
        limit = self.work_limit
        assert limit is not None
        if crawling:
            raise Stopped(f"{limit.slow_calls} calls of the {kind} covered less than 1/{limit.slow_part} of the run")
        raise Stopped(f"{limit.calls} calls of the {kind} were not enough")

    def stepped(self, t: float, y: Any) -> None:
        """Take note of a step that ended at t with the unknowns y, shape(n,)."""
        began = time.thread_time()
        try:
            self._look(t, np.array(y))  # a copy: a solver's own changes
        finally:
            self.aside += time.thread_time() - began

    def _look(self, t: float, y: Any) -> None:
        """Look at a step, and keep it."""
        self.steps += 1
        values = self.require_inside(y)
        self._require_steady(t, y, values)
        self.latest = values
        h, self.t, self.y = t - self.t, t, y
        if h < LEAST * math.ulp(t) and COLLAPSE * self.t_end < t != self.t_end:
            raise Stopped(f"the step size has collapsed to {h:.1e}")
        if self.steps % 1000 == 0:
            if t - self.mark < COLLAPSE * self.t_end:
                raise Stopped(f"the step size has collapsed to {(t - self.mark) / 1000:.1e}")
            self.mark = t

    def output(self, y: Any) -> Any:
        """Return unknowns at an output as a row, if they are inside."""
        began = time.thread_time()
        try:
            self.require_inside(y)
        finally:
            self.aside += time.thread_time() - began
        return y[None]

    def values(self, y: Any) -> tuple[float, ...]:
        """Return the conserved quantities, see :meth:`daebench.methods.solvers.monitored.Monitored.values`."""
        return self.monitored.values(y) if self.monitored else ()

    def _require_steady(self, t: float, y: Any, values: tuple[float, ...]) -> None:
        """Stop where H or |G H_p| change more in a step than ever before and far more than the tolerance explains."""
        law = self.monitored
        if law is None or not self.steady:
            return
        for k in {0, len(values) - 1}:
            jump = abs(values[k] - self.latest[k])
            if jump > self.jumps[k]:
                self.jumps[k] = jump
                explained = max(law.explained(state, t - self.t)[-1 if k else 0] for state in (self.y, y))
                if jump - (0.0 if k else law.received(self.y, y)) > SUDDEN * explained > 0.0:
                    raise Stopped(
                        f"{NAMES[k]} changes by {jump:.1e} in the step to t = {t:.9g}, {jump / explained:.0f} times as much as the "
                        "tolerance explains, so that the step has gone over a singularity",
                        self.t,
                        OVER,
                    )

    def require_inside(self, y: Any) -> tuple[float, ...]:
        """Return the conserved quantities; stop where unknowns are outside of the domain, or H has no value.

        It is said at the time of the last step that was inside.
        """
        if left := self.outside(y):
            advice = "use a smaller tol, or a method whose steps stay inside, such as strang"
            raise Stopped(f"the state leaves {left} in the next step", advice=advice)
        values = self.values(y)
        if not math.isfinite(sum(values)):
            raise Stopped(f"{_wrong(values)} is not finite after the next step", advice=LEFT)
        return values

    @staticmethod
    def ill(t: float, health: float) -> NoReturn:
        """Stop where an evaluation has a bad health."""
        if math.isnan(health):
            raise Stopped(f"a value is no longer finite at t = {t:.9g}")
        why = f"G M^-1 G^T is singular at t = {t:.9g} (relative pivot {health:.1e}), so that the multiplier is not determined"
        raise Stopped(why, advice="use a formulation or scheme that does not need it there")


def _wrong(values: tuple[float, ...]) -> str:
    """Return the name of the first value that is not finite."""
    return next((name for name, value in zip(NAMES, values, strict=False) if not math.isfinite(value)), NAMES[0])

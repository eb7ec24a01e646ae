"""The monitor of a tolerance-driven run on a constrained problem: it monitors with every step whether G keeps its rank."""

import math
from typing import Any

import numpy as np

from daebench.diagnostics.passage import Crossing
from daebench.diagnostics.rank import BELIEVED, GO_ON, WITHIN, badly_scaled, loses_rank, upcoming_loss, zero_of
from daebench.errors import Stopped
from daebench.methods.formulations.constrained import Dae
from daebench.methods.solvers.drive import Array
from daebench.methods.solvers.monitor import Monitor
from daebench.methods.solvers.step_check import AHEAD, CLOSE, UNRESOLVED
from daebench.runs.trajectory import Passage
from daebench.systems.lazily import scipy

INSIDE = 0.1
"""Part of the smaller sigma at the ends of a step that it is below inside, where G loses rank; its square, of the larger one."""

EDGE = 1e-4
"""Part of a step at its ends that is not inside."""

KEPT = 64
"""Approximate number of states over a run with which a multiplier is compared."""

COMBINED = "combined"
"""What a run does whose constraints are combinations of redundant ones: it stops where they are no longer independent."""

INSTEAD = "combinations of redundant constraints are independent only up to there; use ida:ode, or a fixed-step method such as rattle"
"""What to do where it does."""

AROUND = 2.0
"""How many times as far as the place where sigma seems to be zero the way is searched for it."""

LENGTHS = tuple(10.0**-k for k in range(2, 10))
"""Parts of the run in which a loss of rank is looked for where a solver gives up."""


class RankMonitor(Monitor):
    """A monitor that stops a run before G loses rank, or notes the places where it went on.

    sigma is the root of what :func:`daebench.schemes.kernels.rank.independence` measures, and goes to zero along a line where G loses rank.
    Each step is looked at in two ways, for it may be short or long: whether the line through sigma at its ends reaches zero soon, and
    where sigma has changed much, whether it was zero inside, along the cubic through positions and velocities at the ends.
    """

    def __init__(self, dae: Dae, mode: str, *settings: Any) -> None:
        super().__init__(*settings)
        self.dae, self.mode = dae, mode
        self.steady = mode in ("stop", COMBINED)
        self.y = dae.y0.copy()
        self.sigma = self.largest = self._sigma(self.y)
        self.crossing: Crossing | None = None
        self.told = False
        self.passages: list[Passage] = []
        self.kept, self.stride = [self.y], 1

    def _look(self, t: float, y: Any) -> None:
        """Look at a step, and at the rank of G in it."""
        t0, y0, sigma0 = self.t, self.y, self.sigma
        sigma = self._sigma(y)
        if self.crossing is None and abs(sigma - sigma0) > UNRESOLVED * min(sigma, sigma0):
            zero = self._inside(t0, y0, sigma0, t, y, sigma)
            if zero is not None:
                self._lose(zero, t0, y0, sigma0)
        super()._look(t, y)
        self.sigma, self.largest = sigma, max(sigma, self.largest)
        self._keep()
        if self.crossing is not None:
            self._follow(self.crossing)
        elif sigma <= AHEAD * (sigma0 - sigma) or sigma <= CLOSE * self.largest:
            self._look_ahead(zero_of((t0, t), (sigma0**2, sigma**2)))

    def ended(self) -> tuple[Passage, ...]:
        """Return all rank-loss events, at last that which the end of the run cut short."""
        last = () if self.crossing is None else (self.crossing.passage,)
        return (*self.passages, *last)

    def reason(self) -> str:
        """Return that G is about to lose rank, as the end of a sentence, where the last state tells that and it was not told; else ""."""
        if self.told or not self.dae.ivp.m:
            return ""
        p, q = self._state(self.y)
        for part in LENGTHS:
            t = upcoming_loss(self.dae.ivp, p, q, part * self.t_end, WITHIN)
            if t is not None and loses_rank(self.dae.ivp, p, q, 0.0, AROUND * t):
                light = badly_scaled(self.dae.ivp, p, q, t)
                return f"; {light}" if light else f"; G loses rank at about t = {self.t + t:.9g}"
        return ""

    def _look_ahead(self, zero: float) -> None:
        """Believe in a loss of rank if sigma is small there on the line that the motion is on."""
        there = self.y.copy()
        there[: self.dae.d] += (zero - self.t) * self._rate(self.y)
        if self._sigma(there) <= BELIEVED * self.sigma:
            self._lose(zero, self.t, self.y, self.sigma)

    def _inside(self, t0: float, y0: Array, sigma0: float, t1: float, y1: Array, sigma1: float) -> float | None:
        """Return where in a step G loses rank, or None, by golden sections of the cubic through positions and velocities at its ends."""
        h, d = t1 - t0, self.dae.d
        q0, q1, v0, v1 = y0[:d], y1[:d], h * self._rate(y0), h * self._rate(y1)

        def sigma(x: float) -> float:
            at = y1.copy()
            at[:d] = q0 + x * (v0 + x * (3 * (q1 - q0) - 2 * v0 - v1 + x * (v0 + v1 - 2 * (q1 - q0))))
            return self._sigma(at)

        near = min((0.125, 0.375, 0.625, 0.875), key=sigma)
        if sigma(near) > 0.5 * max(sigma0, sigma1):
            return None
        minimum = scipy.optimize.minimize_scalar(sigma, bounds=(near - 0.125, near + 0.125), method="bounded", options={"xatol": 1e-6})
        x, small = float(minimum.x), max(INSIDE * min(sigma0, sigma1), INSIDE**2 * max(sigma0, sigma1))
        return t0 + h * x if EDGE < x < 1 - EDGE and minimum.fun <= small else None

    def _lose(self, zero: float, t: float, y: Array, sigma: float) -> None:
        """Stop at a state before G loses rank, or begin to follow the motion from there."""
        p, q = self._state(y)
        if badly_scaled(self.dae.ivp, p, q, zero - t) or not loses_rank(self.dae.ivp, p, q, abs(self.t - t), AROUND * abs(zero - t)):
            return  # its own error test is to tell whether the steps resolve the light mass, or how fast G turns
        if self.mode in ("stop", COMBINED):
            self.told = True
            raise Stopped(
                f"G loses rank at about t = {zero:.9g} (smallest pivot {sigma**2:.1e}{self._spike(y)})",
                t,
                GO_ON if self.mode == "stop" else INSTEAD,
            )
        self.crossing = Crossing(self.dae.ivp, zero, t, p, q, sigma**2)

    def _follow(self, crossing: Crossing) -> None:
        """Take note of a state after G lost rank, until it is known where the motion went."""
        crossing.add(self.t, *self._state(self.y), self.sigma**2)
        if crossing.over:
            self.passages.append(crossing.passage)
            self.crossing = None

    def _sigma(self, y: Array) -> float:
        if not self.dae.ivp.m:
            return 1.0
        assert self.monitored is not None
        return math.sqrt(abs(self.monitored.independence(y)))

    def _rate(self, y: Array) -> Array:
        """Return q'."""
        if self.dae.mechanical:
            return y[self.dae.d : 2 * self.dae.d]
        return self.dae.ivp.value("H_p", *self._state(y))

    def _state(self, y: Array) -> tuple[Array, Array]:
        """Return p and q."""
        q, v = self.dae.unpack(y[None])
        return self.dae.momenta(q, v)[0], q[0]

    def _keep(self) -> None:
        """Keep a state now and then, none of a chain: every other one is dropped as soon as there are too many."""
        if not self.dae.ivp.arrays and self.steps % self.stride == 0:
            self.kept.append(self.y)
            if len(self.kept) > 2 * KEPT:
                self.kept, self.stride = self.kept[::2], 2 * self.stride

    def _spike(self, y: Array) -> str:
        """Return how much larger the force of constraint G^T lam is than it was over the run, where it is; on a chain G is no matrix."""
        if self.dae.ivp.arrays:
            return ""
        now, usual = self._force(y), float(np.median([self._force(state) for state in self.kept]))
        return f"; the force of constraint, {now:.1e}, is {now / usual:.0f} times its median so far" if now > 10 * usual > 0 else ""

    def _force(self, y: Array) -> float:
        p, q = self._state(y)
        return float(np.linalg.norm(self.dae.ivp.value("lam", p, q) @ self.dae.ivp.value("G", q)))

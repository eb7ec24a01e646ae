"""States from which a code takes its step, chosen so that faults show, and how far another step is from what the code gives."""

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace
from functools import cached_property, partial

import numpy as np

from daebench.diagnostics.consistency import project
from daebench.errors import BadInput, RunFailed
from daebench.methods.fixed_step.constrained import FixedStep
from daebench.methods.outside.method import OutsideMethod
from daebench.runs.ivp import Array, ConstrainedIvp
from daebench.runs.request import Request
from daebench.studies.claims.measured_run import default_step
from daebench.studies.diagnose.kick_drift_kick import RATTLE, tangent
from daebench.studies.diagnose.mechanics import Mechanics, State, largest

Map = Callable[[Array, Array, float], State]
"""Maps p0, q0 and h to p1 and q1."""

APART = 6
"""Steps between the states of a run from which a step is taken."""

STATES = 5
"""States of that run."""

LARGE = 40.0
"""The step in units of :func:`daebench.studies.claims.check.default_step`: large, so that faults are far above rounding."""

STEPS = 12
"""Steps of the run that is compared."""

REACHED = slice(1, None, 3)
"""States of the code's own run from which it takes a single step, too: it may have left the manifold there."""

WILD = 100.0
"""States so many times as large as those of RATTLE are left out."""

REFINEMENTS = 6
"""How often a step that RATTLE cannot take is halved."""

PARTS = (1.0, 0.5, 0.125)
"""Step sizes of single steps, as parts of the largest; states take one after the other."""

SPEEDS = (0.0, 0.3, 1.0, 3.0)
"""Factors of momenta with which a multiplier of the other sign is sought."""

AWAY = 4
"""Every fourth state is a start of a run under the opposite force."""

PULLS = 1e-2
"""A multiplier has a sign where it is so large, relative to the largest."""

EPS, EPS32 = float(np.finfo(np.float64).eps), float(np.finfo(np.float32).eps)
"""Distances of one to the next number of float64 and of float32."""

SINGLE = 256 * EPS32
"""Largest deviation of single steps in float32 that are the same but for rounding, relative to the largest momentum and position."""

FAILED = float("inf")
"""Deviation of a step that has no solution."""


@dataclass(frozen=True)
class Point:
    """A step of the code."""

    h: float
    """Step size, s."""
    p: Array
    q: Array
    """State before it; shape (d,)."""
    after: State
    """Momenta and positions after it."""


@dataclass(frozen=True)
class Battery:
    """Output of a code on a problem: single steps from states of the manifold, and a run."""

    mechanics: Mechanics
    """The problem."""
    h: float
    """The larger of the two step sizes, s."""
    points: tuple[Point, ...]
    """Single steps, each from a fresh start."""
    rows: Array
    """States of a run, p and q; fewer than asked for where the code stopped; shape (k, 2 d)."""
    failures: tuple[str, ...]
    """Why the code could not take a step."""

    @cached_property
    def scales(self) -> tuple[float, float]:
        """Largest momentum and position of the states before a step: those after it may be of a run that explodes."""
        return largest(*(x.p for x in self.points)) or 1.0, largest(*(x.q for x in self.points)) or 1.0

    @cached_property
    def eps(self) -> float:
        """Relative size of a rounding of the code: that of float32 where all that it returns are numbers of float32."""
        after = np.array([point.after for point in self.points])
        return EPS32 if np.array_equal(after, after.astype(np.float32)) else EPS

    @property
    def single(self) -> bool:
        """Whether the code computes in float32."""
        return self.eps != EPS

    def rounding(self, double: float) -> float:
        """Return a bound on what is the same but for rounding, in float32 a wider one in place of that of float64."""
        return max(SINGLE, double) if self.single else double

    @cached_property
    def off_manifold(self) -> float:
        """Largest distance to the manifold of a position after a step, relative to the largest position."""
        return max(self.mechanics.distance(point.after[1]) for point in self.points) / self.scales[1]

    def distance(self, one: State, other: State) -> float:
        """Return how far a state is from the code's, relative to the largest momentum and position, or to the code's where it is larger."""
        if not np.isfinite(other).all():
            return FAILED
        return max(largest(a - b) / max(scale, largest(b)) for a, b, scale in zip(one, other, self.scales, strict=True))

    def deviation(self, step: Map, enough: float = FAILED) -> float:
        """Return how far a step is from the code's, the largest over the points; once it is more than enough, no more are asked."""
        return self.deviation_of((attempted(step, point.p, point.q, point.h) for point in self.points), enough)

    def deviation_of(self, ends: Iterable[State], enough: float = FAILED) -> float:
        """Return how far states are from those after the code's steps, the largest; once it is more than enough, no more are asked."""
        deviation = 0.0
        for end, point in zip(ends, self.points, strict=False):
            deviation = max(deviation, self.distance(end, point.after))
            if deviation > enough:
                break
        return deviation

    def deviation_of_run(self, states: Iterator[State], ahead: int = 0) -> float:
        """Return how far other states are from those of the code's run, after it the same number of steps, or some ahead."""
        d, deviation = self.mechanics.ivp.d, 0.0
        for k, state in enumerate(states):
            if 0 < k - ahead < len(self.rows):
                row = self.rows[k - ahead]
                deviation = max(deviation, self.distance(state, (row[:d], row[d:])))
        return deviation


def attempted(step: Map, p: Array, q: Array, h: float) -> State:
    """Return the state after a step, NaN where there is none."""
    try:
        with np.errstate(all="ignore"):
            return step(p, q, h)
    except (np.linalg.LinAlgError, RunFailed):
        return np.full_like(p, np.nan), np.full_like(q, np.nan)


def map_of(method: FixedStep | OutsideMethod, ivp: ConstrainedIvp, steps: int = 1) -> Map:
    """Return the map of some steps of a method, of real states; it raises RunFailed where the method has no solution."""

    def step(p: Array, q: Array, h: float) -> State:
        p1, q1 = method.flow(ivp, h, steps)(p, q)
        return np.real(np.array(p1)).astype(float), np.real(np.array(q1)).astype(float)

    return step


def uncompiled(method: FixedStep) -> FixedStep:
    """Return a scheme that runs as it is written: for a handful of steps compiling takes longer."""
    return replace(method, compiled=False)


def battery(ivp: ConstrainedIvp, code: OutsideMethod, h: float | None = None) -> Battery:
    """Return the output of a code on a problem."""
    h, states = _states(ivp, h)
    run = code.solve(ivp, Request(value=h, steps=STEPS, every=1, watch=()))
    rows = np.concatenate([run.states["p"], run.states["q"]], axis=1)
    most = WILD * largest(np.array(states))
    states += [(row[: ivp.d], row[ivp.d :]) for row in rows[REACHED] if largest(row) <= most]
    step, points = map_of(code, ivp), []
    failures = {run.failure: None} if run.failure else {}
    for k, (p, q) in enumerate(states):
        size = PARTS[k % len(PARTS)] * h
        try:
            after = step(p, q, size)
        except RunFailed as failure:
            failures[str(failure)] = None
            continue
        if np.isfinite(after).all():
            points.append(Point(size, p, q, after))
    if not points:
        raise RunFailed(
            next(iter(failures), f"{code.name} gives no finite state after a step of {h:g} on {ivp.problem}, case {ivp.case}."),
            "code-gives-no-finite-state",
        )
    return Battery(Mechanics(ivp), h, tuple(points), rows, tuple(failures))


def _states(ivp: ConstrainedIvp, h: float | None) -> tuple[float, list[State]]:
    """Return a step size, and states along a run of RATTLE with it, half of them with other momenta."""
    rattle = map_of(uncompiled(FixedStep("rattle")), ivp, APART)
    value = LARGE * default_step(ivp) if h is None else h
    for _ in range(REFINEMENTS if h is None else 1):
        try:
            states = list(_varied(ivp, _along(rattle, ivp, value)))
            return value, [*states, *_of_other_signs(ivp, states, value)]
        except RunFailed as failure:
            reason, value = failure, value / 2
    raise BadInput(
        f"RATTLE itself cannot take steps of {2 * value:g} on {ivp.problem}, case {ivp.case}; give a smaller h. ({reason})",
        "rattle-itself-fails",
    )


def _along(rattle: Map, ivp: ConstrainedIvp, h: float) -> list[State]:
    states = [(ivp.p0, ivp.q0)]
    while len(states) < STATES:
        states.append(rattle(*states[-1], h))
    return states


def _varied(ivp: ConstrainedIvp, states: list[State]) -> Iterator[State]:
    """Yield states, and each but the first with a momentum added that is as large as those of the run, tangent to the manifold."""
    draw, size = np.random.default_rng(7), float(np.sqrt(np.mean([p**2 for p, _ in states])))
    if not size:
        raise BadInput(
            f"RATTLE leaves {ivp.problem} at rest in case {ivp.case}, where codes look alike; give another case or start, such as --v0.",
            "diagnose-at-rest",
        )
    for k, (p, q) in enumerate(states):
        yield p, q
        if k:
            other, *_ = project(ivp, p + size * draw.standard_normal(len(p)), q)
            yield other, q


def _of_other_signs(ivp: ConstrainedIvp, states: list[State], h: float) -> Iterator[State]:
    """Yield states in which multipliers have signs that they have in none of the given ones."""
    mechanics = Mechanics(ivp)
    seen = [mechanics.multipliers(p, q) for p, q in states]
    missing = [(k, sign) for k in range(ivp.m) for sign in (1.0, -1.0) if not _has(seen, k, sign)]
    if not missing:
        return
    step = map_of(uncompiled(FixedStep("rattle")), ivp)
    places = [q for _, q in states] + list(_opposed(mechanics, states, h))
    speeds = [p for p, _ in states if np.any(p)]
    others = [(tangent(mechanics, s * speeds[k % len(speeds)], q), q) for k, q in enumerate(places) for s in SPEEDS]
    pulls = np.array([mechanics.multipliers(p, q) for p, q in others])
    for k, sign in missing:
        for choice in np.argsort(-sign * pulls[:, k])[:1]:
            if _has([pulls[choice]], k, sign) and _can(step, others[choice], h):
                yield others[choice]


def _has(multipliers: list[Array], k: int, sign: float) -> bool:
    return any(sign * lam[k] > PULLS * largest(lam) for lam in multipliers)


def _opposed(mechanics: Mechanics, states: list[State], h: float) -> Iterator[Array]:
    """Yield positions that are reached under the opposite force: where a rod pulls, it pushes there."""
    opposite = replace(mechanics, force=-1.0)
    for state in states[::AWAY]:
        for step in range(APART * STATES):
            state = attempted(partial(RATTLE, opposite), *state, h)
            if not np.isfinite(state).all():
                break
            if step % APART == 0:
                yield state[1]


def _can(step: Map, state: State, h: float) -> bool:
    """Return whether RATTLE can take all steps from a state."""
    try:
        return all(np.isfinite(step(*state, part * h)).all() for part in PARTS)
    except RunFailed:
        return False

"""Which steps a code agrees with: the scheme it is meant to be, faulty steps, and the schemes of daebench."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from functools import partial

import numpy as np

from daebench.errors import DaebenchError
from daebench.methods.fixed_step.constrained import FixedStep
from daebench.methods.names import CONSTRAINED, method_of
from daebench.studies.diagnose.battery import FAILED, STEPS, Battery, Map, map_of, uncompiled
from daebench.studies.diagnose.faulty_steps import FAULTY_STEPS, Step, Variants
from daebench.studies.diagnose.mechanics import State

CONFIRMED = 1e-12
"""Largest deviation of single steps that are the same but for rounding, relative to the largest momentum and position."""

RUN_CONFIRMED = 1e-10
"""Largest deviation of the states of runs that are the same but for rounding."""

NEAR = 1e-8
"""Largest deviation that may be put down to the tolerance of an iteration in the code."""

TIMES = 8.0
"""In float32 a step that is so many times further from the code's than another is not the code's."""

NOT_BY_STEPS = (
    "one_sweep",
    "loose_tolerance",
    "baumgarte",
    "force_scaled",
    "other_equations",
    "momentum_damped",
    "constraint_shifted",
    "step_size_ignored",
)
"""Faults whose steps depend on numbers of the code, which are told otherwise."""


PROJECTED = ("projected_after", "position_based")
"""Faults that put positions back on the manifold: steps that leave it are not compared with theirs."""


@dataclass(frozen=True)
class Match:
    """A step that agrees with the code's."""

    fault: str
    """Name in :data:`daebench.studies.diagnose.dictionary.FAULTS`."""
    variant: str
    """Which of its steps."""
    deviation: float
    """Largest deviation over all steps, relative to the largest momentum and position."""


def claimed_deviation(battery: Battery, scheme: FixedStep) -> tuple[float, float]:
    """Return how far a scheme of daebench is from the code in single steps, and along the run: one run, or a chain of fresh steps."""
    step = map_of(uncompiled(scheme), battery.mechanics.ivp)
    runs = chained(step, battery), _whole_run(scheme, battery)
    return battery.deviation(step), min(_of_run(battery, run) for run in runs)


def chained(step: Map, battery: Battery, h: float | None = None) -> Iterator[State]:
    """Yield the start of a run and the states after each step."""
    ivp = battery.mechanics.ivp
    state: State = (ivp.p0, ivp.q0)
    yield state
    for _ in range(STEPS + 1):
        state = step(*state, h or battery.h)
        yield state


def _whole_run(scheme: FixedStep, battery: Battery) -> Iterator[State]:
    ivp = battery.mechanics.ivp
    rows, failure = uncompiled(scheme).path(ivp, battery.h, STEPS)(ivp.p0, ivp.q0)
    for row in np.real(rows):
        yield row[: ivp.d], row[ivp.d :]
    if failure:
        yield np.full(ivp.d, np.nan), np.full(ivp.d, np.nan)


def _of_run(battery: Battery, states: Iterator[State], ahead: int = 0) -> float:
    try:
        return battery.deviation_of_run(states, ahead)
    except (DaebenchError, np.linalg.LinAlgError):
        return FAILED


def dictionary_matches(battery: Battery, others: Variants | None = None) -> list[Match]:
    """Return the faulty steps that are near the code's, those that are the same but for rounding first, in the order of the dictionary."""
    off, near, confirmed = battery.off_manifold, battery.rounding(NEAR), battery.rounding(CONFIRMED)
    pairs: Iterable[tuple[str, Variants]] = [("baumgarte", others)] if others else FAULTY_STEPS.items()
    matches = [
        Match(fault, variant, deviation)
        for fault, variants in pairs
        if others or not (fault in NOT_BY_STEPS or (fault in PROJECTED and off > near))
        for variant, step in variants.items()
        if not (battery.mechanics.ivp.m == 1 and fault == "constraint_missing" and variant.startswith(("the last", "the first")))
        if (deviation := battery.deviation(step_of(battery, step), near)) <= near
    ]
    return sorted(matches, key=lambda match: match.deviation if battery.single else max(match.deviation, confirmed))


def nearer(battery: Battery, one: float, other: float) -> bool:
    """Return whether one deviation is so much smaller than another that, in float32, only its step is the code's."""
    return battery.single and TIMES * max(one, battery.eps) < other


def nearest(battery: Battery, matches: list[Match]) -> list[Match]:
    """Return the matches; in float32, whose rounding hides small effects, those that are not much further than the nearest."""
    best = min((match.deviation for match in matches), default=0.0)
    return [match for match in matches if not nearer(battery, best, match.deviation)]


def step_of(battery: Battery, variant: Step) -> Map:
    """Return a step of a variant on the problem of a battery."""
    return partial(variant, battery.mechanics)


def resembled(battery: Battery) -> str:
    """Return the name of the scheme of daebench that the code agrees with, "" where there is none: the first, in float32 the nearest."""
    agreeing = _agreeing(battery)
    _, name = min(agreeing, default=(FAILED, "")) if battery.single else next(agreeing, (FAILED, ""))
    return name


def _agreeing(battery: Battery) -> Iterator[tuple[float, str]]:
    """Yield the schemes of daebench that the code agrees with, and how far a step is from theirs."""
    ivp, confirmed = battery.mechanics.ivp, battery.rounding(CONFIRMED)
    for listed in CONSTRAINED.listed():
        scheme = method_of(ivp, listed.name)
        if not isinstance(scheme, FixedStep) or scheme.refusal(ivp):
            continue
        deviation = battery.deviation(map_of(uncompiled(scheme), ivp), confirmed)
        if deviation <= confirmed:
            yield deviation, scheme.name


def shifted(battery: Battery, scheme: FixedStep) -> str:
    """Return how a run is a step ahead or behind a scheme's, or has steps of another size, "" where it is not."""
    step = map_of(uncompiled(scheme), battery.mechanics.ivp)
    ways = {
        "each state is that of a step later": (1, battery.h),
        "each state is that of a step before": (-1, battery.h),
    }
    sizes = ((STEPS, STEPS - 1), (STEPS - 1, STEPS), (STEPS + 1, STEPS), (STEPS, STEPS + 1))
    ways |= {f"{taken} steps are taken in the time of {right}": (0, battery.h * right / taken) for taken, right in sizes}
    for way, (ahead, h) in ways.items():
        if _of_run(battery, chained(step, battery, h), ahead) <= battery.rounding(RUN_CONFIRMED):
            return way
    return ""

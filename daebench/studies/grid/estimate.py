"""Estimated time of the runs of a study: from similar stored runs or usual values, and the compilation."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from daebench.records.code import code_version
from daebench.records.store import Store
from daebench.studies.grid.run_specification import GridRun
from daebench.studies.grid.runs_together import made_together
from daebench.studies.grid.specification import specification_of

STEP_SECONDS = 1e-6
"""What a fixed step usually costs: between 1e-7 for RATTLE on a pendulum and 1e-5 for long compositions on large problems."""

MEMBER_STEP_SECONDS = 3e-7
"""What a fixed step of a member of an ensemble usually costs, with all that is looked at after it."""

TOLERANCE_SECONDS = 0.005
"""What a second of motion usually costs a tolerance-driven method, between 1e-3 and 0.05."""

LEAST_SECONDS = 0.002
"""What a run costs at least."""

COMPILE_SECONDS = 0.02
"""What the compilation of a kernel costs, times its stages and the square of the number of positions and multipliers, or components: it
was 1.7 s at 9, 3 s at 15, 7 s at 21 and 17 s at 30."""

LEAST_COMPILE, MOST_COMPILE = 1.0, 20.0
"""What it costs at least, and at most: large problems have loops, whose length does not grow."""


@dataclass(frozen=True)
class Estimate:
    """About how long runs take."""

    seconds: float
    """In one process, s, without compilation."""
    like: int
    """Runs that are like stored ones, of the same method on the same problem."""
    runs: int
    """All of them."""
    kernels: int = 0
    """Kernels that no stored run of this version has compiled; some may be in the cache all the same."""
    compiling: float = 0.0
    """About how long their compilation takes, s."""

    def sentence(self, processes: int, where: str) -> str:
        """Return it in words, for so many processes, which are there."""
        whose = f"from stored runs for {self.like} of them, from usual values for the others"
        if self.like in (0, self.runs):
            whose = (
                "from stored runs of the same methods" if self.like else "from usual values, because none of these methods was run before"
            )
        total = (self.seconds + self.compiling) / processes
        compiled = (
            f"including {duration(self.compiling)} for the compilation of at most {self.kernels} kernels"
            if self.kernels
            else "all is compiled"
        )
        return f"about {duration(total)} {where} (an estimate {whose}; {compiled})"


def estimate(specifications: Sequence[GridRun], store: Store) -> Estimate:
    """Return about how long runs will take, by what the store has of their methods on their problem."""
    stored: dict[tuple[Any, ...], list[GridRun]] = {}
    took: dict[GridRun, float] = {}
    compiled: set[GridRun] = set()
    for stored_row in store.all():
        if stored_row.row.get("failure") and isinstance(stored_row.row["failure"], str):
            continue  # one that failed soon tells nothing of another that does not
        specification = specification_of(stored_row.specification)
        if stored_row.maker == code_version():
            compiled.add(specification.of_any_kind())
        stored.setdefault(_like(specification), []).append(specification)
        took[specification] = stored_row.took
    usual: dict[tuple[Any, ...], tuple[str, float]] = {}
    seconds, like = 0.0, 0
    for specification in specifications:
        others = stored.get(_like(specification), [])
        if _like(specification) not in usual:
            usual[_like(specification)] = _usual(specification)
        resolution, rate = usual[_like(specification)]
        rate = min((took[other] / _work(other, resolution) for other in _nearest(specification, resolution, others)), default=rate)
        seconds += max(LEAST_SECONDS, rate * _work(specification, resolution))
        like += bool(others) * specification.count
    kinds = {specification.of_any_kind(): specification for specification in specifications}
    missing = {kind: specification for kind, specification in kinds.items() if kind not in compiled}
    kernels = sum(_kernels(specification) for specification in missing.values())
    compiling = sum(map(compiling_seconds, missing.values()))
    return Estimate(seconds, like, sum(specification.count for specification in specifications), kernels, compiling)


def _like(specification: GridRun) -> tuple[Any, ...]:
    """Return the common settings of runs whose times are in proportion to their work."""
    return type(specification), specification.problem, specification.method


def _usual(specification: GridRun) -> tuple[str, float]:
    """Return a method's control parameter, and the usual cost of a step, or of a second of motion."""
    solver = specification.solver
    if solver.knob != "h":
        return solver.knob, TOLERANCE_SECONDS
    together = type(specification) is not GridRun and made_together(solver, specification.ivp)
    return "h", MEMBER_STEP_SECONDS if together else STEP_SECONDS


def _kernels(specification: GridRun) -> int:
    """Return how many kernels a run takes: with fixed steps one that monitors, and one more that is timed."""
    return 2 if specification.repeat > 0 and specification.solver.knob == "h" else 1


def compiling_seconds(specification: GridRun) -> float:
    """Return about how long the compilation of the kernels of a run takes, s."""
    ivp, solver = specification.ivp, specification.solver
    size = len(ivp.start[-1]) + ivp.m
    stages = getattr(getattr(solver, "member", None), "stages", 1)
    return _kernels(specification) * float(min(MOST_COMPILE, max(LEAST_COMPILE, COMPILE_SECONDS * stages * size**2)))


def _nearest(specification: GridRun, resolution: str, others: Sequence[GridRun]) -> Sequence[GridRun]:
    """Return the runs to whose time that of this one is in proportion: with fixed steps all, and else those with the nearest tol."""
    if resolution == "h" or not others:
        return others
    distances = [abs(math.log(other.value / specification.value)) for other in others]
    least = min(distances)
    return [other for other, distance in zip(others, distances, strict=True) if distance == least]


def _work(specification: GridRun, resolution: str) -> float:
    """Return to what the time of a run is taken as proportional: its runs times their steps, or their length where steps are chosen."""
    return (
        specification.count
        * (1 + max(0, specification.repeat))
        * (specification.t_end / specification.value if resolution == "h" else specification.t_end)
    )


def duration(seconds: float) -> str:
    """Return about how long something lasts, in words."""
    if seconds < 90:
        return f"{max(1, round(seconds))} s"
    if seconds < 5400:
        return f"{seconds / 60:.0f} min"
    return f"{seconds / 3600:.1f} h" if seconds < 2 * 86400 else f"{seconds / 86400:.3g} days"

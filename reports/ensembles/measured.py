"""Measurements of the report on ensembles: runs from many starts of one energy, at equal cost, and the cost of a start."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pandas as pd

from daebench.diagnostics.drift import FAILED
from daebench.methods.ensemble.run import run_members
from daebench.methods.initial_value_problem import initial_value_problem
from daebench.methods.names import method_of
from daebench.pages.report import Progress
from daebench.pages.report.two_processes import Job, computed
from daebench.reports.ensembles.motions import FRACTIONS, METHODS, MOTIONS, SEED, STARTS, Motion
from daebench.runs.ivp import Array
from daebench.runs.members import Members
from daebench.runs.members import members as members_of
from daebench.runs.request import Request
from daebench.starts.draw import draw_starts
from daebench.studies.ensemble.energies import ended_members, member_energies
from daebench.studies.held_verdict import held_verdicts

OUTPUTS = 400
"""Approximate number of states of each run from which the verdict on its energy is computed."""

REPEAT, TIMED = 3, 200
"""Number of timed runs, of which the best counts, and steps of each."""

FEW, LONGER = 16, 5000
"""Starts that are timed one by one, and steps of each: enough that the overhead of a run is negligible."""


MANY = 64
"""Starts for which the kernels are those of all starts."""

COMPILED = 0.4
"""Part of the work that is done when everything is compiled."""


@dataclass(frozen=True)
class Numbers:
    """The measurements of the report."""

    motions: Sequence[Motion]
    """The motions."""
    runs: pd.DataFrame
    """One row per run: motion, method, price (the divisor of the largest step), h, start (0 is the start of the case), size (largest energy
    error over the mean kinetic energy, infinite where the run stopped), verdict on its energy, and failure in short.
    """
    prices: pd.DataFrame
    """One row per motion and method: ns of CPU time per step for one start of many, "together", and relative to the first method, "ratio".
    """
    alone: pd.DataFrame
    """One row per motion: ns per step of the first method, "together" and "alone"; how many starts take the time of one."""
    starts: dict[str, str]
    """By motion, the distribution of its starts."""


def measure(tell: Progress, motions: Sequence[Motion] = MOTIONS, starts: int = STARTS) -> Numbers:
    """Return the numbers. Starts are drawn and kernels compiled before, in two processes; what is timed is timed alone."""
    runs, prices, alone, about = [], [], [], {}
    jobs: list[Job] = [(prepared, (motion, starts)) for motion in motions]
    ready = dict(computed(jobs, lambda done, doing: tell(COMPILED * done, "starts and kernels"), "prepared"))
    for k, motion in enumerate(motions):
        tell(COMPILED + (1 - COMPILED) * k / len(motions), motion.title)
        start, about[motion.key] = ready[prepared, (motion, starts)]
        some = members_of(initial_value_problem(motion.problem, motion.case), start, motion.h, {})
        ratios = priced(motion, some)
        prices.append(ratios)
        alone.append(by_itself(motion, some, float(ratios["together"].iloc[0])))
        for method, ratio in zip(ratios["method"], ratios["ratio"], strict=True):
            runs += [measured(motion, some, method, fraction, ratio) for fraction in FRACTIONS]
    return Numbers(motions, pd.concat(runs, ignore_index=True), pd.concat(prices, ignore_index=True), pd.DataFrame(alone), about)


def prepared(motion: Motion, starts: int) -> tuple[tuple[Array, ...], str]:
    """Have the kernels of a motion compiled; return its starts, positions and momenta of shape(starts, d), and their distribution."""
    compile_kernels(motion)
    some, about = drawn(motion, starts)
    return some.start, about


def compile_kernels(motion: Motion) -> None:
    """Have the kernels of a motion compiled, by runs of no consequence that are like those that are timed and those that are measured."""
    ivp = initial_value_problem(motion.problem, motion.case)
    some, timed = members_of(ivp, tuple(np.repeat([x], MANY, axis=0) for x in ivp.start), motion.h, {}), timed_request(motion.h, 1)
    for method in METHODS:
        for asked in (timed, energy_request(motion.h, 1, 1)):
            run_members(method_of(ivp, method), some, asked, threads=1)
    run_members(method_of(ivp, METHODS[0]), some, timed, lanes=1)


def timed_request(h: float, steps: int) -> Request:
    """Return the request of runs that keep and monitor nothing."""
    return Request(value=h, steps=steps, every=0, watch=(), count=False)


def energy_request(h: float, steps: int, every: int) -> Request:
    """Return the request of runs whose energy is monitored."""
    return Request(value=h, steps=steps, every=every, watch=("energy",), count=False)


def drawn(motion: Motion, starts: int) -> tuple[Members, str]:
    """Return the start of the case and others of its energy, and their distribution."""
    ivp = initial_value_problem(motion.problem, motion.case)
    starts_of_energy = draw_starts(ivp, "energy", members=starts - 1, h=motion.h, seed=SEED)
    both = zip(ivp.start, starts_of_energy.members.start, strict=True)
    return replace(
        starts_of_energy.members, start=tuple(np.concatenate([[start], others]) for start, others in both)
    ), starts_of_energy.about


def priced(motion: Motion, some: Members) -> pd.DataFrame:
    """Return the cost of a step of each method, and the factor by which its steps are longer at equal cost."""
    together = [nanoseconds(some, method, TIMED) for method in METHODS]
    ratios = [max(1, round(time / together[0])) for time in together]
    return pd.DataFrame({"motion": motion.key, "method": METHODS, "together": together, "ratio": ratios})


def nanoseconds(some: Members, method: str, steps: int, **settings: Any) -> float:
    """Return the CPU time of a step and start, ns."""
    asked = timed_request(float(some.h), steps)
    runs = [run_members(method_of(some.ivp, method), some, asked, threads=1, **settings) for _ in range(REPEAT)]
    return 1e9 * min(float(run.seconds / run.steps.sum()) for run in runs)


def by_itself(motion: Motion, some: Members, together: float) -> dict[str, object]:
    """Return the cost of a step of the first method for one start of many, and for a single start."""
    alone = nanoseconds(some.some(np.arange(min(len(some), FEW))), METHODS[0], LONGER, lanes=1)
    return {"motion": motion.key, "together": together, "alone": alone, "starts": alone / together}


def measured(motion: Motion, some: Members, method: str, fraction: int, ratio: int) -> pd.DataFrame:
    """Return the rows of the runs of a method from all starts."""
    h = ratio * motion.h / fraction
    steps = int(motion.t_end / h + 1e-9)
    asked = energy_request(h, steps, max(1, steps // OUTPUTS))
    solver = method_of(some.ivp, method)
    run = run_members(solver, replace(some, h=h), asked)
    sizes, verdicts, ended = np.full(len(some), np.inf), np.full(len(some), FAILED, dtype="U12"), ended_members(run)
    if len(ended):
        with np.errstate(all="ignore"):  # a motion that is lost may have squares that overflow
            columns = member_energies(run, ended)
        energy_sizes = np.array(columns["energy_size"], dtype=float)
        sizes[ended] = np.where(np.isfinite(energy_sizes), energy_sizes, np.inf)
        verdicts[ended] = held_verdicts(columns["energy_verdict"], run, ended, solver, asked)
    return pd.DataFrame(
        {"motion": motion.key, "method": method, "price": fraction, "h": h, "start": np.arange(len(some)), "size": sizes}
        | {"verdict": verdicts, "failure": [run.reason(i) for i in range(len(some))]}
    )

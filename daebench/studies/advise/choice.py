"""The work that advice takes: what errors are against, the search over methods, and the choice among those that reach the accuracy."""

import math
import os
import time
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from operator import attrgetter, itemgetter

import numpy as np

from daebench.errors import BadInput, DaebenchError
from daebench.records.store import Store
from daebench.runs.request import Told
from daebench.studies.advise.advice import RUNNERS_UP, Choice
from daebench.studies.advise.evidence import Kept, OverStarts, keeps, over_starts
from daebench.studies.advise.question import LONGER, Question
from daebench.studies.advise.search import Found, Row, error_of, resolutions_of, search
from daebench.studies.grid.estimate import compiling_seconds
from daebench.studies.grid.reference import certified_of, own_of
from daebench.studies.grid.run_specification import GridRun
from daebench.studies.grid.runs import computed
from daebench.studies.grid.specification import key_of

PATIENCE = 75.0
"""CPU time after which no further method is tried, s; those that are kept in the store take none."""

EACH, COMPILED = 0.3, 1.5
"""CPU time of the runs of a method, s, and that of its compilation, its source included, over that of its kernels alone."""

AFTERWARDS, KERNELS = 8.0, 2.0
"""CPU time of what comes after the search on a manifold, s, and that of its compilation over that of the simplest method, about."""

GOOD = 1 / 3
"""Part of the accuracy that the error of a reference may be."""

FINER = 6
"""Values of a method that are looked at closely, and from other starts, at most."""

OTHERS = "other starts"

BUSY = 1.2
"""Processes that compute, this one included, for each processor, from which on it is said that they wait for each other."""

NOT_KEPT = "was not found to keep"
"""What is said of a method that loses a quantity that is asked for in a run, or of which that cannot be measured."""

NEAR = 2.0
"""Times the budget up to which a run is timed again: first timings may be too long."""

EXCLUDED = "which the budget excludes"

AGAIN, SPENT = (3, 40), 0.05
"""Fewest and most runs that are timed of those methods that come into question, of which the best counts, and the time they take, s."""


@dataclass
class Work:
    """Runs of a question, each made once."""

    question: Question
    """What is asked."""
    store: Store
    """Where rows are kept."""
    progress: Told | None
    """Told how far it is."""
    searching: float = 0.8
    """Part of the time that the search is expected to take."""
    began: float = field(default_factory=time.process_time)

    def make(self, specification: GridRun) -> Row:
        """Return the row of a run."""
        (row,) = computed([specification], self.store).values()
        return row

    def from_starts(self, method: str, value: float) -> OverStarts:
        """Return the errors of a method from other starts."""
        return over_starts(partial(self.question.from_starts, method, value), self.question.part, self.make)

    def tell(self, fraction: float, what: str) -> None:
        """Say how far it is."""
        if self.progress:
            self.progress(fraction, what)

    def tell_after(self, fraction: float, what: str) -> None:
        """Say how far it is with what comes after the search."""
        self.tell(self.searching + (1 - self.searching) * fraction, what)

    @property
    def out_of_time(self) -> bool:
        """Whether no further method is begun."""
        return time.process_time() - self.began > PATIENCE


def reference_of(question: Question, method: str) -> tuple[str, float]:
    """Return the reference of the errors and its own bound; refuse a reference that is not good enough."""
    run = question.run(method, question.apart)
    if certified := certified_of(run):
        bound = float(np.max(certified.bound[question.part][certified.t <= question.t_end]))
        words = f"certified {question.problem}-{question.case}"
    else:
        try:
            solution = own_of(run, np.linspace(0.0, question.t_end, question.outputs + 1))
        except DaebenchError as error:
            raise BadInput(f"there is no reference to measure errors against: {error}", "no-reference-for-errors") from error
        words, bound = solution.words, float(np.max(solution.bound[question.part]))
    if not bound <= GOOD * question.accuracy:
        raise BadInput(
            f"the reference, {words}, may be wrong by {bound:.1e}, and an accuracy of {question.accuracy:g} needs at most "
            f"{GOOD * question.accuracy:.1e}; ask for less accuracy, or an earlier end.",
            "reference-too-coarse",
        )
    return words, bound


def tried(work: Work, name: str) -> bool:
    """Return whether the search of a method has begun before, so that the store has its first run."""
    return key_of(_first_run(work.question, name)) in work.store


def _first_run(question: Question, name: str) -> GridRun:
    """Return the run with which the search of a method begins."""
    resolutions = resolutions_of(question, name)
    return question.run(name, resolutions.value(resolutions.first(question.accuracy)))


def plan(work: Work, names: Sequence[str]) -> tuple[str, list[float]]:
    """Return the plan of the runs with their time, as a sentence; and the CPU time of each method, s."""
    asked = work.question
    new = {name: COMPILED * compiling_seconds(_first_run(asked, name)) for name in names if not tried(work, name)}
    kernels = {(name.partition("/")[0], "/" in name): name for name in reversed(names)}  # all compositions of a method have those of one
    prices = [EACH + (new.get(name, 0.0) if name in kernels.values() else 0.0) for name in names]
    search, after = min(PATIENCE + max(prices) / 2, sum(prices)), EACH * len(names)
    if new and asked.ivp.on_manifold:
        after += AFTERWARDS + KERNELS * min(new.values())
    work.searching = search / (search + after)
    runs = f"{len(names)} methods, {len(new)} of them new, at finer and finer steps or tolerances"
    moved = f"{asked.starts} other starts, {LONGER:g} times the horizon, a coarser step, and changed parameters"
    return f"{runs}; then {moved}: about {search + after:.0f} s of CPU time{_at_load(search + after)}", prices


def _at_load(seconds: float) -> str:
    """Return how long a CPU time takes beside others on this machine, as part of a sentence; "" if there are none, or it is not known."""
    busy = (1 + os.getloadavg()[0]) / (os.cpu_count() or 1) if hasattr(os, "getloadavg") else 0.0
    return f", {busy * seconds:.0f} s where others use the machine as they do now" if busy > BUSY else ""


def searched(work: Work, names: Sequence[str], left_out: dict[str, str]) -> list[Found]:
    """Return the result of each method that there is time for."""
    results: list[Found] = []
    sentence, expected = plan(work, names)
    work.tell(0.0, f"plan: {sentence}")
    for k, name in enumerate(names):
        if work.out_of_time and not tried(work, name):
            left_out[name] = f"{name} was not tried, to save time; ask again to include it"
            continue
        work.tell(work.searching * sum(expected[:k]) / sum(expected), name)
        results.append(search(work.question, name, work.make, _longest(work.question, results)))
    return results


def _longest(question: Question, results: Sequence[Found]) -> float:
    """Return the CPU time up to which a further method is followed, s: the budget counts once it is known what reaches the accuracy."""
    prices = [some.seconds for some in reaching(results)]
    named = prices[RUNNERS_UP] if len(prices) > RUNNERS_UP else math.inf
    return min(named, max(NEAR * question.budget, prices[0])) if prices else named


def reaching(results: Iterable[Found]) -> list[Found]:
    """Return the results of methods that reach the accuracy, the cheapest first."""
    return sorted((some for some in results if some.row), key=attrgetter("seconds"))


def chosen_of(work: Work, results: Sequence[Found], left_out: dict[str, str]) -> list[tuple[Choice, Mapping[str, Kept]]]:
    """Return the choice and the next methods, with what they keep; those that lose what is asked are left out."""
    again = _again(work, results, left_out)
    chosen: list[tuple[Choice, Mapping[str, Kept]]] = []
    for choice in sorted(again, key=lambda choice: choice.seconds):
        conserved: Mapping[str, Kept] = {}
        if not chosen or work.question.keep:
            work.tell_after(0.4, f"what {choice.method} keeps")
            conserved = keeps(work.question, choice.method, choice.value, work.make)
        if lost := [name for name in work.question.keep if name not in conserved or not conserved[name].kept]:
            left_out[choice.method] = f"{choice.method} {NOT_KEPT} {', '.join(lost).replace('_', '-')}"
        elif choice.seconds > work.question.budget:
            left_out[choice.method] = f"{choice.method} takes {choice.seconds:.2g} s, {EXCLUDED}"
        else:
            chosen.append((choice, conserved))
        if len(chosen) > RUNNERS_UP:
            break
    return chosen


def _again(work: Work, results: Sequence[Found], left_out: dict[str, str]) -> list[Choice]:
    """Return the cheapest methods, timed again and run from other starts: twice as many as are named where some may not keep something."""
    again: list[Choice] = []
    for some in reaching(results):
        dearest = sorted(choice.seconds for choice in again)[RUNNERS_UP:]
        enough = work.question.share and not work.question.keep and dearest and some.seconds > dearest[0]
        if enough or len(again) >= 2 * (1 + RUNNERS_UP):
            break
        if some.seconds > NEAR * work.question.budget:
            left_out[some.method] = f"{some.method} takes {some.seconds:.2g} s, {EXCLUDED}"
        elif choice := _settled(work, some, left_out):
            again.append(choice)
    return again


def _settled(work: Work, result: Found, left_out: dict[str, str]) -> Choice | None:
    """Return the choice that a method is, timed again and looked at at more times, and from other starts: finer where errors are larger."""
    work.tell_after(0.0, f"{result.method} from other starts" if work.question.share else f"{result.method} again")
    question, value, starts = work.question, result.value, OverStarts()
    resolutions, repeat = resolutions_of(question, result.method), min(max(math.ceil(SPENT / result.seconds), AGAIN[0]), AGAIN[1])
    for _ in range(FINER):
        row = work.make(question.closely(result.method, value, repeat=repeat))
        if (error := error_of(row, question.part)) <= question.accuracy and question.share:
            starts = work.from_starts(result.method, value)
            error = starts.reached(question.share)
            within = f"with {result.knob} = {value:.3g} {sum(off <= question.accuracy for off in starts.errors)} of {starts.number}"
            left_out[result.method] = f"{result.method}: {within} {OTHERS} are within the accuracy"
        if error <= question.accuracy:
            left_out.pop(result.method, None)
            return Choice.of(result.knob, row, question.part, starts)
        if starts.failure and not starts.errors:
            left_out[result.method] = f"{result.method}: errors from {OTHERS} are not known: {starts.failure}"
            break
        value = resolutions.value(resolutions.finer(resolutions.number(value), error, question.accuracy))
    return None


def why_nothing(question: Question, results: Sequence[Found], left_out: Mapping[str, str]) -> str:
    """Return why nothing does what is asked, and what the best is."""
    reached, budget = reaching(results), question.budget
    asked = f"an error of {question.accuracy:g}" + (f" in {budget:g} s" if budget < math.inf else "")
    asked += f" for {100 * question.share:g} % of starts" if question.share and reached else ""
    if not reached:
        return f"no method tried reaches {asked}; {_nearest(question, results)}"
    cheapest, methods = reached[0], {some.method for some in reached}
    if cheapest.seconds > budget:
        run = f"{cheapest.method} with {cheapest.knob} = {cheapest.value:.4g}"
        return f"no method tried reaches {asked}: the cheapest run within the accuracy, {run}, takes {cheapest.seconds:.2g} s, {EXCLUDED}"
    reasons = [why for name, why in left_out.items() if name in methods]
    if few := "; ".join(why for why in reasons if OTHERS in why):
        return f"no method tried reaches {asked}: {few}; with a share of 0 the start of the case alone counts"
    return f"no method tried does all that is requested: {'; '.join(reasons) or _nearest(question, results)}"


def _nearest(question: Question, results: Sequence[Found]) -> str:
    """Return the most accurate run, whatever it takes, and whether the budget excludes it as well, as a clause."""
    rows = [(error_of(row, question.part), row) for some in results for row in some.rows]
    error, best = min(rows, key=itemgetter(0), default=(math.inf, {}))
    if error == math.inf:
        stopped = next((f": {str(row['failure']).rstrip('.')}" for some in results for row in reversed(some.rows) if row["failure"]), "")
        return f"none reaches its end{stopped}"
    price = float(best["seconds"])
    excluded = f", {EXCLUDED}" if price > question.budget else ""
    return f"the best is {best['method']} with {float(best['value']):.3g}: error {error:.2g}, {price:.2g} s{excluded}"

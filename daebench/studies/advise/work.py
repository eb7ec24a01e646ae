"""The work that advice takes: what errors are against, the search over methods, and the choice among those that reach the accuracy."""

import math
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from daebench.errors import BadInput, DaebenchError
from daebench.studies.advise.advice import RUNNERS_UP, Choice
from daebench.studies.advise.keeps import Kept, keeps
from daebench.studies.advise.question import LONGER, Question
from daebench.studies.advise.search import Found, Row, error_of, resolutions_of, search
from daebench.studies.grid.against import certified_of, own_of
from daebench.studies.grid.run_specification import GridRun
from daebench.studies.grid.runs import computed
from daebench.studies.grid.specification_key import key_of
from daebench.studies.grid.store import Store

Progress = Callable[[float, str], None]
"""Called with the fraction of the work done and a label of the current task."""

PATIENCE = 75.0
"""CPU time after which no further method is tried, s; those that are kept in the store take none."""

EACH, AFTERWARDS = 6.0, 15.0
"""CPU time that a method takes that is new, compilation included, and what comes after the search, s, about."""

GOOD = 1 / 3
"""Part of the accuracy that the error of a reference may be."""

FINER = 4
"""Values of a method that are looked at closely, at most."""

NOT_KEPT = "was not found to keep"
"""What is said of a method that loses a quantity that is asked for in a run, or of which that cannot be measured."""

AGAIN, SPENT = (3, 40), 0.05
"""Fewest and most runs that are timed of those methods that come into question, of which the best counts, and the time they take, s."""


@dataclass
class Work:
    """Runs of a question, each made once.

    Parameters
    ----------
    question : Question
        What is asked.
    store : Store
        Where rows are kept.
    progress : callable, optional
        Told how far it is.
    """

    question: Question
    store: Store
    progress: Progress | None
    began: float = field(default_factory=time.process_time)

    def make(self, specification: GridRun) -> Row:
        """Return the row of a run."""
        (row,) = computed([specification], self.store).values()
        return row

    def tell(self, fraction: float, what: str) -> None:
        """Say how far it is."""
        if self.progress:
            self.progress(fraction, what)

    @property
    def out_of_time(self) -> bool:
        """Whether no further method is begun."""
        return time.process_time() - self.began > PATIENCE


def reference_of(question: Question, method: str) -> tuple[str, float]:
    """Return what errors are against and what that may be wrong by; refuse a reference that is not good enough."""
    run = question.run(method, question.apart)
    if certified := certified_of(run):
        bound = float(np.max(certified.bound[question.part][certified.t <= question.t_end]))
        words = f"certified {question.problem}-{question.case}"
    else:
        try:
            own = own_of(run, np.linspace(0.0, question.t_end, question.outputs + 1))
        except DaebenchError as error:
            raise BadInput(f"there is no reference to measure errors against: {error}") from error
        words, bound = own.words, float(np.max(own.bound[question.part]))
    if not bound <= GOOD * question.accuracy:
        raise BadInput(
            f"the reference, {words}, may be wrong by {bound:.1e}, and an accuracy of {question.accuracy:g} needs at most "
            f"{GOOD * question.accuracy:.1e}; ask for less accuracy, or an earlier end."
        )
    return words, bound


def tried(work: Work, name: str) -> bool:
    """Return whether the search of a method has begun before, so that the store has its first run."""
    resolutions = resolutions_of(work.question, name)
    return key_of(work.question.run(name, resolutions.value(resolutions.first(work.question.accuracy)))) in work.store


def plan(work: Work, names: Sequence[str]) -> str:
    """Return what is going to be run, and how long it takes, as a sentence."""
    new, asked = sum(not tried(work, name) for name in names), work.question
    moved = f"{asked.starts} other starts, {LONGER:g} times the horizon, a coarser step, and changed parameters"
    most = AFTERWARDS + min(PATIENCE, EACH * new)
    return f"{len(names)} methods, {new} of them new, at finer and finer steps or tolerances; then {moved}: about {most:.0f} s of CPU time"


def searched(work: Work, names: Sequence[str], left_out: dict[str, str]) -> list[Found]:
    """Return what is found of each method that there is time for."""
    found: list[Found] = []
    work.tell(0.0, plan(work, names))
    for k, name in enumerate(names):
        if work.out_of_time and not tried(work, name):
            left_out[name] = f"{name} was not tried, to save time; ask again to include it"
            continue
        work.tell(0.75 * k / len(names), name)
        prices = sorted(float(some.row["seconds"]) for some in found if some.row)
        found.append(search(work.question, name, work.make, prices[RUNNERS_UP] if len(prices) > RUNNERS_UP else math.inf))
    return found


def chosen_of(work: Work, found: Sequence[Found], left_out: dict[str, str]) -> list[tuple[Choice, Mapping[str, Kept]]]:
    """Return the choice and the next methods, with what they keep; they are timed again, and those that lose what is asked are left out."""
    reaching = sorted((some for some in found if some.row), key=lambda some: float(some.row["seconds"]) if some.row else math.inf)
    again = [choice for some in reaching[: 2 * (1 + RUNNERS_UP)] if (choice := _timed_again(work, some))]
    chosen: list[tuple[Choice, Mapping[str, Kept]]] = []
    for choice in sorted(again, key=lambda choice: choice.seconds):
        kept: Mapping[str, Kept] = {}
        if not chosen or work.question.keep:
            work.tell(0.78, f"what {choice.method} keeps")
            kept = keeps(work.question, choice.method, choice.value, work.make)
        if lost := [name for name in work.question.keep if name not in kept or not kept[name].kept]:
            left_out[choice.method] = f"{choice.method} {NOT_KEPT} {', '.join(lost).replace('_', '-')}"
        elif choice.seconds > work.question.budget:
            left_out[choice.method] = f"{choice.method} takes {choice.seconds:.2g} s"
        else:
            chosen.append((choice, kept))
        if len(chosen) > RUNNERS_UP:
            break
    return chosen


def _timed_again(work: Work, found: Found) -> Choice | None:
    """Return the choice that a method is, timed again and looked at at more times: a little finer where its error is larger there."""
    assert found.row is not None
    question, value = work.question, float(found.row["value"])
    resolutions, part = resolutions_of(question, found.method), question.part
    repeat = min(max(math.ceil(SPENT / float(found.row["seconds"])), AGAIN[0]), AGAIN[1])
    for _ in range(FINER):
        row = work.make(question.closely(found.method, value, repeat=repeat))
        if (error := error_of(row, part)) <= question.accuracy:
            return Choice.of(found.knob, row, part)
        value = resolutions.value(resolutions.finer(resolutions.number(value), error, question.accuracy))
    return None


def why_nothing(question: Question, found: Sequence[Found], left_out: Mapping[str, str]) -> str:
    """Return why nothing does what is asked, and what the best is."""
    rows = [row for some in found for row in some.rows if float(row["seconds"]) <= question.budget]
    best = min(rows, key=lambda row: error_of(row, question.part), default=None)
    asked = f"an error of {question.accuracy:g}" + (f" in {question.budget:g} s" if question.budget < math.inf else "")
    reaching = sorted((float(some.row["seconds"]), some.method) for some in found if some.row)
    if best is None or not math.isfinite(error_of(best, question.part)):
        quickest = f"the quickest that does, {reaching[0][1]}, takes {reaching[0][0]:.2g} s" if reaching else ""
        return f"no method tried reaches {asked}; {quickest or 'none reaches its end'}"
    if not question.budget < math.inf and any(some.row for some in found):
        lost = "; ".join(why for name, why in left_out.items() if NOT_KEPT in why)
        return f"no method tried conserves what is requested: {lost}"
    price = f"{float(best['seconds']):.2g} s"
    found_best = f"{best['method']} with {float(best['value']):.3g}: error {error_of(best, question.part):.2g}, {price}"
    return f"no method tried reaches {asked}; the best is {found_best}"

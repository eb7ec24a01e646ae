"""An answer: a method with its step size or tolerance, its cost, the next methods, conserved quantities, and failures under changes."""

import shlex
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, ClassVar

from daebench.methods.outside.read import is_outside
from daebench.runs.result import Result
from daebench.studies.advise.conserved import Kept
from daebench.studies.advise.question import Question
from daebench.studies.advise.search import Found, Row, error_of
from daebench.studies.advise.sensitivity import Change, OverStarts
from daebench.systems.lazily import pandas as pd

INTERVAL = "Clopper-Pearson, 95 %"

RUNNERS_UP = 2
"""Number of other methods that are named."""


def _number(x: float) -> str:
    """Return all digits of a number."""
    return repr(float(x)).removesuffix(".0")


@dataclass(frozen=True)
class Choice:
    """A run that reaches the accuracy.

    Parameters
    ----------
    method, knob : str
        The method, and the name of its resolution: "h" or "tol".
    value : float
        Its step size, s, or tolerance.
    error, seconds : float
        Largest error at the outputs, and CPU time of the run, s.
    starts : OverStarts
        Its errors from other starts; none where they have not been measured.
    """

    method: str
    knob: str
    value: float
    error: float
    seconds: float
    starts: OverStarts = field(default_factory=OverStarts)

    @classmethod
    def of(cls, knob: str, row: Row, part: str, starts: OverStarts) -> "Choice":
        """Return the choice of a row."""
        return cls(str(row["method"]), knob, float(row["value"]), error_of(row, part), float(row["seconds"]), starts)

    def plain(self) -> dict[str, Any]:
        """Return it for JSON."""
        return {"method": self.method, self.knob: self.value, "error": self.error, "seconds": self.seconds}


@dataclass(frozen=True)
class Advice(Result):
    """An answer to a question.

    Parameters
    ----------
    question : Question
        The question.
    choice : Choice or None
        The chosen run; None if no run meets the request.
    runners_up : tuple of Choice
        The next methods by cost.
    kept : mapping of str to Kept
        Conserved quantities of the choice, by name.
    starts : OverStarts
        Errors of the choice from other starts.
    changes : tuple of Change
        The choice as it is, and the effects of changes, the worst first.
    found : tuple of Found
        Results of the search, by method.
    left_out : mapping of str to str
        Reasons why methods were not tried, or were left out.
    reference : str
        The reference of the errors.
    bound : float
        Error bound of the reference.
    why : str
        Why there is no choice, and the best run; "" if there is a choice.
    """

    drawn_by: ClassVar[str] = "daebench.studies.advise.figure"

    question: Question
    choice: Choice | None
    runners_up: tuple[Choice, ...]
    kept: Mapping[str, Kept]
    starts: OverStarts
    changes: tuple[Change, ...]
    found: tuple[Found, ...]
    left_out: Mapping[str, str]
    reference: str
    bound: float
    why: str = ""

    @property
    def table(self) -> "pd.DataFrame":
        """All runs of the search, one row each."""
        return pd.DataFrame([row for found in self.found for row in found.rows])

    @property
    def outside(self) -> dict[str, str]:
        """Sentences on integrators from outside that are not chosen, by name."""
        named = {choice.method for choice in (self.choice, *self.runners_up) if choice}
        return {some.method: self._became(some) for some in self.found if is_outside(some.method) and some.method not in named}

    def _became(self, some: Found) -> str:
        if some.row is None:
            return some.why
        value, seconds = float(some.row["value"]), float(some.row["seconds"])
        longer = f", {seconds / self.choice.seconds:.2g} times as long" if self.choice else ""
        return f"with {some.knob} = {value:.4g} it reaches {error_of(some.row, self.question.part):.1e} in {1e3 * seconds:.3g} ms{longer}"

    @property
    def holds(self) -> str:
        """Say for which share of starts the error of the choice is at most the accuracy, and what was measured."""
        asked = self.question
        if not asked.share:
            return "from this start only"
        words = f"for {100 * asked.share:g} % of starts"
        if self.choice is None:
            return words
        within, some = self.starts.within(asked.accuracy), self.starts.number
        measured = f"measured {100 * within.value:.3g} % of {some}: {100 * within.low:.3g} to {100 * within.high:.3g} % of all"
        return f"{words} ({measured}{'' if within.low >= asked.share else '; these are too few to confirm it'})"

    @property
    def command(self) -> str:
        """The command that makes the run of the choice; "" without one."""
        if self.choice is None:
            return ""
        asked, choice = self.question, self.choice
        words = ["daebench", "run", asked.problem, "--case", asked.case]
        words += [word for name, value in asked.parameters.items() for word in ("--param", f"{name}={_number(value)}")]
        words += ["--method", choice.method, f"--{choice.knob}", _number(choice.value), "--t-end", _number(asked.t_end)]
        words += ["--anyway"] if asked.anyway and not self._poisson_integrator else []
        words += ["--on-singular", asked.on_singular] if asked.on_singular else []
        return shlex.join(words)

    @property
    def python(self) -> str:
        """The call that makes the run of the choice; "" without one."""
        if self.choice is None:
            return ""
        asked = self.question
        parameters = f", parameters={dict(asked.parameters)}" if asked.parameters else ""
        more = ", anyway=True" if asked.anyway and not self._poisson_integrator else ""
        more += f", on_singular={asked.on_singular!r}" if asked.on_singular else ""
        steered = f"{self.choice.knob}={self.choice.value!r}"
        return (
            f"daebench.run({asked.problem!r}, case={asked.case!r}{parameters}, method={self.choice.method!r}, {steered}, "
            f"t_end={_number(asked.t_end)}{more})"
        )

    @property
    def _poisson_integrator(self) -> bool:
        return "two_form" in self.kept

    def summary(self) -> dict[str, Any]:
        """Return the answer for JSON."""
        asked, accuracy = self.question, self.question.accuracy
        about = {"problem": asked.problem, "case": asked.case, "parameters": dict(asked.ivp.parameters), "accuracy": accuracy}
        about |= {"share": asked.share}
        about |= {"t_end": asked.t_end, "keep": list(asked.keep), "budget": None if asked.budget == float("inf") else asked.budget}
        answer: dict[str, Any] = self.choice.plain() if self.choice else {"method": None, "error": None, "seconds": None}
        answer |= {"why": self.why or None, "runners_up": [other.plain() for other in self.runners_up]}
        answer |= {"keeps": [name for name, kept in self.kept.items() if kept.kept]}
        answer |= {"kept": {name: kept.plain() for name, kept in self.kept.items()}}
        within = self.starts.within(accuracy)
        answer |= {
            "starts": {
                "number": self.starts.number,
                "error": {name: self.starts.quantile(part) for name, part in (("q05", 0.05), ("q50", 0.5), ("q95", 0.95))},
                "within": {"share": within.value, "low": within.low, "high": within.high, "interval": INTERVAL},
                "confirmed": within.low >= asked.share if asked.share else None,
                "reference": self.starts.words,
            }
        }
        answer |= {
            "breaks": [{"change": change.what, "factor": change.factor(accuracy), "why": change.found.failure} for change in self.changes]
        }
        answer |= {"reference": self.reference, "bound": self.bound, "command": self.command, "python": self.python}
        return about | answer | {"left_out": dict(self.left_out), "outside": self.outside}

"""An answer: a method with its step size or tolerance, its cost, the next methods, conserved quantities, and failures under changes."""

import shlex
from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass, field
from operator import attrgetter
from typing import TYPE_CHECKING, Any, ClassVar

from daebench.draw.figures import BLACK, QUIET, drawing, grid_of_axes
from daebench.draw.methods import curve_of
from daebench.errors import BadInput, DaebenchError
from daebench.methods.outside.read import is_outside
from daebench.runs.ivp import Ivp
from daebench.runs.result import Result, Table
from daebench.studies.advise.evidence import Change, Kept, OverStarts
from daebench.studies.advise.question import Question
from daebench.studies.advise.search import Found, Row, error_of
from daebench.studies.work_precision.study import front
from daebench.systems.lazily import pandas as pd

if TYPE_CHECKING:
    from matplotlib.figure import Figure

INTERVAL = "Clopper-Pearson, 95 %"

RUNNERS_UP = 2
"""Number of other methods that are named."""

HIGHEST = 10.0
"""Errors up to this are drawn."""

BELOW = 1e-3
"""The error of the reference is drawn where it is more than this part of the least error."""

NAMED = 5
"""Methods that are drawn in colours: the choice, and those whose cost is nearest to its cost."""

QUANTILES = {"q05": 0.05, "q50": 0.5, "q95": 0.95}
"""Quantiles of the errors from other starts, by name."""


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

    @property
    def words(self) -> str:
        """The step size or tolerance, to four digits."""
        return f"{self.knob} = {self.value:.4g}"

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
    found : tuple of Found
        Results of the search, by method.
    left_out : mapping of str to str
        Reasons why methods were not tried, or were left out.
    reference : str
        The reference of the errors.
    bound : float
        Error bound of the reference.
    chosen : tuple of Choice
        The chosen run, and the next methods by cost; none if no run meets the request.
    kept : mapping of str to Kept
        Conserved quantities of the choice, by name.
    starts : OverStarts
        Errors of the choice from other starts.
    changes : tuple of Change
        The choice as it is, and the effects of changes, the worst first.
    why : str
        Why there is no choice, and the best run; "" if there is a choice.
    """

    stem: ClassVar[str] = "advise"
    generates: ClassVar[bool] = True
    fails_if: ClassVar[str] = "no run meets the request"

    question: Question
    found: tuple[Found, ...]
    left_out: Mapping[str, str]
    reference: str
    bound: float
    chosen: tuple[Choice, ...] = ()
    kept: Mapping[str, Kept] = field(default_factory=dict)
    starts: OverStarts = field(default_factory=OverStarts)
    changes: tuple[Change, ...] = ()
    why: str = ""

    @property
    def choice(self) -> Choice | None:
        """The chosen run; None if no run meets the request."""
        return self.chosen[0] if self.chosen else None

    @property
    def runners_up(self) -> tuple[Choice, ...]:
        """The next methods by cost."""
        return self.chosen[1:]

    @property
    def ivp(self) -> Ivp:
        """The problem."""
        return self.question.ivp

    @property
    def origin(self) -> Mapping[str, str]:
        """Accuracy and seed."""
        return {"Accuracy": f"{self.question.accuracy:g}", "Seed": str(self.question.seed)}

    @property
    def status(self) -> int:
        """1 if no run meets the request."""
        return int(not self.chosen)

    @property
    def table(self) -> "pd.DataFrame":
        """All runs of the search, one row each."""
        return pd.DataFrame([row for some in self.found for row in some.rows])

    @property
    def outside(self) -> dict[str, str]:
        """Sentences on integrators from outside that are not chosen, by name."""
        named = {choice.method for choice in self.chosen}
        return {some.method: self._became(some) for some in self.found if is_outside(some.method) and some.method not in named}

    def _became(self, some: Found) -> str:
        if some.row is None:
            return some.why
        run = Choice.of(some.knob, some.row, self.question.part, OverStarts())
        longer = f", {run.seconds / self.choice.seconds:.2g} times as long" if self.choice else ""
        return f"with {run.words} it reaches {run.error:.1e} in {1e3 * run.seconds:.3g} ms{longer}"

    @property
    def _where(self) -> str:
        asked = self.question
        return f"{asked.problem}, case {asked.case}, to t = {asked.t_end:g} s"

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
    def _anyway(self) -> bool:
        """Whether the choice runs only on demand: it is no Poisson integrator of the problem."""
        return self.question.anyway and "two_form" not in self.kept

    @property
    def command(self) -> str:
        """The command that makes the run of the choice; "" without one."""
        if self.choice is None:
            return ""
        asked, choice = self.question, self.choice
        words = ["daebench", "run", asked.problem, "--case", asked.case]
        words += [word for name, value in asked.parameters.items() for word in ("--param", f"{name}={_number(value)}")]
        words += ["--method", choice.method, f"--{choice.knob}", _number(choice.value), "--t-end", _number(asked.t_end)]
        words += ["--anyway"] * self._anyway + (["--on-singular", asked.on_singular] if asked.on_singular else [])
        return shlex.join(words)

    @property
    def python(self) -> str:
        """The call that makes the run of the choice; "" without one."""
        if self.choice is None:
            return ""
        asked, choice = self.question, self.choice
        parameters = f", parameters={dict(asked.parameters)}" if asked.parameters else ""
        more = ", anyway=True" * self._anyway + (f", on_singular={asked.on_singular!r}" if asked.on_singular else "")
        return (
            f"daebench.run({asked.problem!r}, case={asked.case!r}{parameters}, method={choice.method!r}, {choice.knob}={choice.value!r}, "
            f"t_end={_number(asked.t_end)}{more})"
        )

    def to_generate(self) -> tuple[Mapping[str, Any], str]:
        """Return the arguments of :func:`daebench.generate` for the cheapest choice with a fixed step."""
        if self.choice is None:
            return {}, ""
        asked, fixed = self.question, next((some for some in self.chosen if some.knob == "h"), None)
        steers = f"{self.choice.method} chooses its own steps"
        if fixed is None:
            raise BadInput(f"{steers}, so that it cannot be generated; name schemes with --methods.", "search-not-generated")
        named = {name: getattr(asked, name) for name in ("problem", "case", "parameters", "anyway", "on_singular")}
        note = "" if fixed is self.choice else f"{steers}; generated is {fixed.method}."
        return {**named, "method": fixed.method, "h": fixed.value}, note

    def summary(self) -> dict[str, Any]:
        """Return the answer for JSON."""
        asked, starts, within = self.question, self.starts, self.starts.within(self.question.accuracy)
        return {
            **{name: getattr(asked, name) for name in ("problem", "case")},
            "parameters": dict(asked.ivp.parameters),
            **{name: getattr(asked, name) for name in ("accuracy", "share", "t_end")},
            "keep": list(asked.keep),
            "budget": None if asked.budget == float("inf") else asked.budget,
            **(self.choice.plain() if self.choice else dict.fromkeys(("method", "error", "seconds"))),
            "why": self.why or None,
            "runners_up": [other.plain() for other in self.runners_up],
            "keeps": [name for name, kept in self.kept.items() if kept.kept],
            "kept": {name: {"kept": kept.kept, **asdict(kept)} for name, kept in self.kept.items()},
            "starts": {
                "number": starts.number,
                "error": {name: starts.quantile(part) for name, part in QUANTILES.items()},
                "within": {"share": within.value, "low": within.low, "high": within.high, "interval": INTERVAL},
                "confirmed": within.low >= asked.share if asked.share else None,
                "reference": starts.words,
            },
            "breaks": [
                {"change": change.what, "factor": change.factor(asked.accuracy), "why": change.found.failure} for change in self.changes
            ],
            **{name: getattr(self, name) for name in ("reference", "bound", "command", "python")},
            "left_out": dict(self.left_out),
            "outside": self.outside,
        }

    def printed(self) -> Iterator[str | Table]:
        """Yield the choice with the next methods, its conserved quantities, its failures under changes, and how to run it."""
        asked, choice = self.question, self.choice
        wanted = "error" if choice else "wanted: error"
        yield f"{self._where}, {wanted} of {asked.part} at most {asked.accuracy:g} {self.holds}"
        yield f"errors are against: {self.reference}, which may be wrong by {self.bound:.1e}"
        if choice is None:
            yield self.why
            return
        rows = [
            [what, x.method, x.words, f"{x.error:.1e}", f"{1e3 * x.seconds:.3g} ms", f"{x.seconds / choice.seconds:.2g}"]
            for what, x in zip(("take", "or", "or"), self.chosen, strict=False)
        ]
        yield Table(["", "method", "with", "error", "CPU time", "times as long"], rows)
        yield self._from_starts()
        answers = ("no", "yes")
        conserved = [
            [name.replace("_", "-"), answers[kept.kept], answers[kept.claimed], f"{kept.value:.1e}, {kept.words}"]
            for name, kept in self.kept.items()
        ]
        yield Table(["keeps", "", "claimed", "measured"], conserved)
        changes = [[change.what, change.effect(asked.accuracy)] for change in self.changes]
        yield Table(["what breaks first", "error over the accuracy"], changes)
        yield from (self.command, self.python, *(f"{name}: {became}" for name, became in self.outside.items()))
        if self.left_out:
            yield f"not tried, or left out: {', '.join(self.left_out)}; --json says why"

    def _from_starts(self) -> str:
        """Return a sentence on the error of the choice from other starts."""
        starts, accuracy = self.starts, self.question.accuracy
        if not starts.errors:
            return f"from other starts nothing is known: {starts.failure or 'their references are not good enough'}"
        within, (low, middle, high) = starts.within(accuracy), map(starts.quantile, QUANTILES.values())
        return (
            f"from {starts.number} other starts: error {middle:.1e} in the median, {low:.1e} to {high:.1e} (5 to 95 %); "
            f"{100 * within.value:.3g} % of them within {accuracy:g} [{100 * within.low:.3g} to {100 * within.high:.3g} of all]"
        )

    def plot(self) -> "Figure":
        """Return a figure of cost against accuracy of all runs, their Pareto front, and the choice."""
        error, table, accuracy = f"error_{self.question.part}", self.table, self.question.accuracy
        shown = table[(table["failure"] == "") & table["seconds"].notna() & (table[error] < HIGHEST)]
        if shown.empty:
            raise DaebenchError("there is nothing to draw: no run of the search has an error and a time.", "advise-nothing-to-draw")
        by_cost = sorted((some for some in self.found if some.row), key=attrgetter("seconds"))
        named = list(dict.fromkeys([*(choice.method for choice in self.chosen), *(some.method for some in by_cost)]))[:NAMED]
        curves = {str(method): rows.sort_values("value", ascending=False) for method, rows in shown.groupby("method", sort=False)}
        with drawing():
            figure, axes = grid_of_axes(1, 1, 4.2, x="CPU time of a run [s]", y=f"largest error of {self.question.part}")
            axis = axes[0, 0]
            axis.set(xscale="log", yscale="log")
            for method in sorted(curves, key=lambda name: named.index(name) if name in named else -1):
                style = {"color": "#c4c4c4", "linewidth": 0.7, "zorder": 1}
                if method in named:
                    style = {"zorder": 3, **curve_of(method), "linestyle": "-", "linewidth": 1.1}
                axis.plot(curves[method]["seconds"], curves[method][error], **style)
            best = front(shown, error, "seconds")
            axis.plot(best["seconds"], best[error], color=BLACK, linewidth=0.8, zorder=2, label="front of all runs")
            axis.axhline(accuracy, color=QUIET, linewidth=1.0, linestyle="--", label=f"accuracy asked for, {accuracy:g}")
            if self.bound > BELOW * float(shown[error].min()):
                axis.axhline(self.bound, color=QUIET, linewidth=1.0, linestyle=":", label="error of the reference")
            if self.choice:
                axis.plot([self.choice.seconds], [self.choice.error], "o", markersize=11, markerfacecolor="none", color=BLACK, zorder=4)
            axis.legend(loc="upper left", bbox_to_anchor=(1.02, 1.0), frameon=False, fontsize=8)
            figure.suptitle(self._title(), fontsize="medium", x=0.02, ha="left")
        return figure

    def _title(self) -> str:
        """Return the answer in two lines."""
        where = f"{self._where}, error at most {self.question.accuracy:g} {self.holds.partition(' (')[0]}"
        if (choice := self.choice) is None:
            return f"{where}:\nno run meets this"
        answer = f"Take {choice.method} with {choice.knob} = {choice.value:.3g} (circle)"
        return f"{answer}: error {choice.error:.1e} in {choice.seconds:.2g} s\n{where}"

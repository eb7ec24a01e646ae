"""A question to ``advise``, and the runs of its answer."""

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np

from daebench.errors import BadInput, InconsistentStart, positive, real, unknown, whole
from daebench.methods.initial_value_problem import initial_value_problem
from daebench.methods.names import methods_of
from daebench.reference.solution import certified_for
from daebench.runs.ivp import Ivp
from daebench.studies.grid.claimed import THINGS
from daebench.studies.grid.run_specification import FEWEST, GridRun, StartRuns

OUTPUTS = 48
"""Times at which errors are taken, about; a number with many divisors, for numbers of steps that come to some of these times."""

STARTS, SHARE = 128, 0.95
"""Number of other starts, and the share that has to be within the accuracy: of 128, 127 within confirm 95 %, and 72 of 72 would."""

MOST_OUTPUTS = 96
"""Stored times of a certified reference that are used, at most."""

TIMED = 3
"""Runs of the search that are timed, of which the best counts; one that is long is timed once."""

CALLS = 400_000
"""Calls of the right side or residual after which a tolerance-driven run is given up."""

LONGER = 10.0
"""How many times as long a run is on which it is seen what is kept, and what breaks."""

FINEST = 16
"""Parts of the distance of outputs that a reference's step is a third of, where the method has no step size."""


@dataclass(frozen=True, kw_only=True)
class Question:
    """A question: an accuracy at a horizon, and quantities to be conserved.

    Parameters
    ----------
    problem, case : str
        Names; a problem may be the path of a file.
    accuracy : float
        Largest error of a position, or of a component of a Poisson system's state, in its unit.
    t_end : float
        Horizon, s.
    keep : tuple of str
        Quantities to be conserved: "energy", "constraints", "casimirs", "two_form".
    budget : float
        Largest CPU time of a run, s; infinite where none is given.
    starts : int
        Number of other starts from which errors are measured.
    share : float
        Share of these starts that has to be within the accuracy; 0 if only the start of the case has to be.
    parameters : mapping of str to float
        Values of the problem's parameters.
    seed : int
        Seeds the starts.
    anyway : bool
        Whether a scheme may be run on a Poisson system outside of the class for which it is a Poisson integrator.
    on_singular : str, optional
        What to do where G loses rank: "stop", "continue" or "least-squares"; by default what the case declares.

    Raises
    ------
    BadInput
        If a number is not positive, or a quantity is unknown or the problem does not have it.
    """

    problem: str
    case: str
    accuracy: float
    t_end: float
    keep: tuple[str, ...] = ()
    budget: float = float("inf")
    starts: int = STARTS
    share: float = SHARE
    parameters: Mapping[str, float] = field(default_factory=dict)
    seed: int = 0
    anyway: bool = False
    on_singular: str | None = None

    def __post_init__(self) -> None:
        positive("accuracy", self.accuracy)
        positive("t_end", self.t_end)
        if self.budget != float("inf"):
            positive("budget", self.budget)
        if whole("starts", self.starts) < 1 or whole("seed", self.seed) < 0:
            raise BadInput(f"starts = {self.starts} must be at least 1, and seed = {self.seed} at least 0.", "advise-starts-or-seed")
        if not 0 <= real("share", self.share) < 1:
            raise BadInput(
                f"share = {self.share:g} must be at least 0 and less than 1: no number of starts shows that all are within.",
                "share-out-of-range",
            )
        for name in self.keep:
            if name not in THINGS:
                raise unknown("thing to keep", name, THINGS)
        has = {"constraints": bool(self.ivp.m), "casimirs": bool(self.ivp.casimirs)}
        if absent := [name for name in sorted(self.keep) if not has.get(name, True)]:
            raise BadInput(f"{self.problem} has no {' and no '.join(absent)} to conserve; leave that out.", "nothing-to-conserve")

    @cached_property
    def ivp(self) -> Ivp:
        """The initial value problem."""
        return initial_value_problem(self.problem, self.case, dict(self.parameters), on_singular=self.on_singular)

    @property
    def size(self) -> float:
        """Size of the motion: the largest position, or component of y, at its start."""
        return float(np.max(np.abs(self.ivp.start[-1])))

    @property
    def part(self) -> str:
        """Part of the state that the accuracy refers to: "q" or "y"."""
        return self.ivp.state.position

    @cached_property
    def outputs(self) -> int:
        """Number of times at which errors are taken: stored times of the certified reference where there is one."""
        reference = certified_for(self.ivp, self.t_end)
        if reference is None:
            return OUTPUTS
        stored = self.t_end / float(reference.t[1])
        count = round(stored)
        if abs(stored - count) > 1e-9 * stored:
            return OUTPUTS
        apart = next(k for k in range(1, count + 1) if count % k == 0 and count // k <= MOST_OUTPUTS)
        return count // apart if count // apart >= OUTPUTS / 2 else OUTPUTS

    @property
    def apart(self) -> float:
        """Distance of these times, s."""
        return self.t_end / self.outputs

    def solver(self, method: str) -> Any:
        """Return a method."""
        return methods_of(self.ivp, [method], anyway=self.anyway)[0]

    def run(self, method: str, value: float, *, repeat: int = TIMED, times: float = 1.0, metrics: Sequence[str] = ()) -> GridRun:
        """Return one run: of a method, with a step size or tolerance, to a multiple of the horizon; timed ``repeat`` times."""
        by_steps = self.solver(method).knob == "h"
        outputs = math.gcd(round(self.t_end / value), self.outputs) if by_steps else self.outputs
        return GridRun(**self._fields(method, value, times), metrics=tuple(metrics) or self.metrics, outputs=outputs, repeat=repeat)

    def closely(self, method: str, value: float, *, repeat: int) -> GridRun:
        """Return one run that is looked at at as many times as its steps have in common with the horizon."""
        run = self.run(method, value, repeat=repeat)
        return replace(run, outputs=_outputs(round(self.t_end / value))) if self.solver(method).knob == "h" else run

    def from_starts(self, method: str, value: float) -> StartRuns:
        """Return the runs from starts beside that of the case."""
        return self._start_runs(method, value, 1.0, {"members": self.starts, "seed": self.seed})

    def changed(self, method: str, value: float, *, times: float = 1.0, parameters: Mapping[str, float] | None = None) -> StartRuns:
        """Return the run from the start of the case, to a multiple of the horizon, or with another value of a parameter.

        A start that is off the manifold with this parameter is moved onto it.
        """
        ivp, settings, fields = self.ivp, {}, {}
        try:
            ivp = initial_value_problem(self.problem, self.case, {**dict(self.parameters), **(parameters or {})})
            fields["parameters"] = tuple({**dict(self.parameters), **(parameters or {})}.items())
        except InconsistentStart:
            settings["parameters"] = {name: [at] for name, at in (parameters or {}).items()}
        settings["values"] = {f"{self.part}1": [float(ivp.start[-1][0])]}
        return self._start_runs(method, value, times, fields | {"members": 1, "distribution": "grid", "settings": json.dumps(settings)})

    def _start_runs(self, method: str, value: float, times: float, starts: Mapping[str, Any]) -> StartRuns:
        fields = self._fields(method, value, times) | {"metrics": (self.part,), "repeat": 0, **starts}
        if self.solver(method).knob != "h":
            return StartRuns(**fields, outputs=self.outputs, finest=self.apart / FINEST)
        steps = _whole(times * self.t_end / value)
        h = times * self.t_end / steps
        return StartRuns(**{**fields, "value": h}, outputs=_outputs(steps), finest=h)

    @property
    def metrics(self) -> tuple[str, ...]:
        """Metrics of every run."""
        return (self.part, "energy", self.ivp.state.conserved)

    def _fields(self, method: str, value: float, times: float) -> dict[str, Any]:
        named = {"problem": self.problem, "case": self.case, "method": method, "value": value, "t_end": times * self.t_end}
        named |= {"parameters": tuple(self.parameters.items()), "anyway": self.anyway, "on_singular": self.on_singular or ""}
        return named | {"calls": int(CALLS * times)}


def _whole(steps: float) -> int:
    """Return about so many steps: if there are many and their number is not whole, a number with many divisors."""
    nearest = max(FEWEST, round(steps))
    return nearest if abs(steps - nearest) <= 1e-6 * steps or steps < OUTPUTS else 16 * round(steps / 16)


def _outputs(steps: int) -> int:
    """Return the largest number of outputs up to :data:`OUTPUTS` that a number of steps is a multiple of; all of few steps."""
    if steps <= OUTPUTS:
        return steps
    return max(k for k in range(1, OUTPUTS + 1) if steps % k == 0)

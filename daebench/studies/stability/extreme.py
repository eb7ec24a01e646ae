"""The motion and the methods that are driven to an extreme.

An extreme is a module with five functions: ``refusal(asked)`` returns why a problem has no such extreme, or ""; ``specifications(asked)``
the runs that are known beforehand; ``measure(asked, runs)`` makes the runs and returns their table; ``says(table)`` returns sentences; and
``draw(out, stem, table)`` writes the picture as SVG, PNG and CSV, and returns the path of the SVG.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from itertools import product
from typing import Any

from daebench.errors import BadInput, positive
from daebench.methods.initial_value_problem import initial_value_problem
from daebench.methods.names import method_of
from daebench.reference.keep.record import Reference
from daebench.runs.ivp import Ivp
from daebench.runs.own_start import OwnStart, given
from daebench.runs.state import CONSTRAINED, POISSON
from daebench.studies.grid.claimed import feasible, installed, usual
from daebench.studies.grid.reference import reference_of, usual_end
from daebench.studies.grid.run_specification import GridRun

METHODS = {
    CONSTRAINED: (
        *("symplectic_euler", "rattle", "lobatto3", "rattle/kahan_li8", "rk4", "rk4+proj", "generalized_alpha"),
        *("ida:index3", "ida:index2", "ida:index1", "ida:ggl"),
    ),
    POISSON: ("symplectic_euler", "strang", "strang/kahan_li8", "midpoint", "rk4", "ida:ode"),
}
"""Methods where none are given, with fixed steps and driven by a tolerance, by the state of the problem."""


@dataclass(frozen=True, kw_only=True)
class Asked:
    """The motion and the methods that are driven to an extreme.

    Parameters
    ----------
    problem : str
        Name, or path of a file.
    case : str, optional
        Named initial values; by default the problem's first.
    methods : sequence of str
        Names; some of each family by default.
    t_end : float, optional
        End of all runs, s; by default 10, or that of the reference.
    h : sequence of float
        Step sizes; chosen by each extreme by default.
    parameters : mapping of str to sequence of float
        Values of the parameter that is varied; chosen by each extreme by default.
    near : float
        Value that the parameter approaches; pictures show the distance from it.
    anyway : bool
        Whether a scheme may be run on a Poisson system outside of the class for which it is a Poisson integrator.
    on_singular : str, optional
        What to do where G loses rank: "stop", "continue" or "least-squares"; by default what the case declares.
    """

    problem: str
    case: str | None = None
    methods: Sequence[str] = ()
    t_end: float | None = None
    h: Sequence[float] = ()
    parameters: Mapping[str, Sequence[float]] = field(default_factory=dict)
    near: float = 0.0
    anyway: bool = False
    on_singular: str | None = None

    @cached_property
    def ivp(self) -> Ivp:
        """The problem with the numbers of its case."""
        return initial_value_problem(self.problem, self.case, on_singular=self.on_singular)

    @cached_property
    def reference(self) -> Reference | None:
        """The certified reference, if there is one."""
        try:
            return reference_of(self.problem, self.ivp.case)
        except BadInput:
            return None

    @cached_property
    def end(self) -> float:
        """End of all runs, s."""
        return usual_end(self.reference) if self.t_end is None else self.t_end

    @cached_property
    def _chosen(self) -> list[str]:
        if self.methods:
            names, _ = installed(self.methods)
            for name in names:
                if refusal := method_of(self.ivp, name, anyway=self.anyway).refusal(self.ivp):
                    raise BadInput(refusal, "method-refuses-problem")
            return names
        return feasible(self.ivp, usual(METHODS, self.ivp), anyway=self.anyway)[0]

    @property
    def left_out(self) -> dict[str, str]:
        """Packages that given methods need and that are not installed, as sentences."""
        return installed(self.methods)[1]

    def knob(self, method: str) -> str:
        """Return "h" or "tol"."""
        return str(method_of(self.ivp, method, anyway=self.anyway).knob)

    @cached_property
    def fixed(self) -> list[str]:
        """Methods with fixed steps."""
        return [name for name in self._chosen if self.knob(name) == "h"]

    @cached_property
    def tolerant(self) -> list[str]:
        """Methods driven by a tolerance."""
        return [name for name in self._chosen if self.knob(name) == "tol"]

    def resolutions(self, steps: Sequence[float], tolerances: Sequence[float]) -> list[tuple[str, float]]:
        """Return each method with each of its step sizes or tolerances."""
        return [*product(self.fixed, steps), *product(self.tolerant, tolerances)]

    def specification(self, method: str, value: float, metrics: Sequence[str], **more: Any) -> GridRun:
        """Return one run."""
        settings: dict[str, Any] = {"problem": self.problem, "case": self.ivp.case, "t_end": self.end}
        settings |= {"anyway": self.anyway, "on_singular": self.on_singular or ""}
        return GridRun(method=method, value=value, metrics=tuple(metrics), **settings | more)


def asked_of(
    problem: str,
    case: str | None,
    methods: Sequence[str] | None,
    h: Sequence[float] | None,
    t_end: float | None,
    *,
    start: OwnStart,
    on_singular: str | None,
    **more: Any,
) -> Asked:
    """Return the motion and methods of a command; refuse steps and ends that are not positive."""
    end = None if t_end is None else positive("--t-end", t_end)
    if given(start):
        case = initial_value_problem(problem, case, on_singular=on_singular, **start).case
    more |= {"methods": methods or (), "t_end": end, "h": [positive("--h", value) for value in h or ()]}
    return Asked(problem=problem, case=case, on_singular=on_singular, **more)


def uncertified(asked: Asked) -> str:
    """Return why errors are unknown: there is no certified reference, or it ends before the runs; "" if they are known."""
    if asked.reference and asked.end <= asked.reference.horizon:
        return ""
    if asked.reference:
        return f"{asked.reference.name} ends at t = {asked.reference.horizon:g}, before t_end = {asked.end:g}"
    return f"there is no certified reference of {asked.problem}, case {asked.ivp.case}, and errors against anything else are not known"

"""Runs of a study, one or several that are made together: all that decides them, as plain values that can be hashed, stored and sent."""

import json
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, fields, replace
from functools import lru_cache
from typing import Any, Self

from daebench.compiler.number_types import number_type
from daebench.errors import BadInput, whole
from daebench.methods.fixed_step.constrained import FixedStep
from daebench.methods.initial_value_problem import initial_value_problem
from daebench.methods.names import method_of
from daebench.methods.outside.read import content_of, is_outside
from daebench.runs.ivp import Ivp
from daebench.runs.request import Request, WorkLimit
from daebench.schemes.kernels.language import ROUNDINGS
from daebench.starts.members import neighbour

COLUMNS = frozenset(
    {"problem", "case", "method", "knob", "value", "precision", "compensated", "sweeps", "newton", "t_end", "start"}
    | {
        "reference",
        "made_for",
        "steps",
        "seconds",
        "callback_seconds",
        "t_reached",
        "failure",
        "n_steps",
        "n_newton",
        "n_solve",
        "n_rhs",
        "n_residual",
        "n_jacobian",
    }
)
"""Columns that a row has in any case, or where its method counts such work; parameters and options have columns of their own names."""

Row = dict[str, Any]
"""What a run gave, by column."""

OUTPUTS = 64
"""Times at which a run is looked at, its start apart."""

FEWEST = 3
"""Fewest states that a number is taken from: two are a start and an end, and tell nothing of what is between."""


@dataclass(frozen=True, kw_only=True)
class RunSpecification:
    """A problem and a method for it, as plain values.

    Parameters
    ----------
    problem, case, method : str
        Names; a problem may be the path of a file.
    parameters, options : tuple of (str, float)
        The problem's parameters that differ from the case's, and the method's free numbers.
    precision : str
        "float64", "mixed" or "float32".
    compensated : bool
        Whether sums over steps are compensated.
    anyway : bool
        Whether a scheme may run where it is not a Poisson integrator.
    on_singular : str
        What is done where G loses rank; "" for what the case says.
    """

    problem: str
    case: str
    method: str
    parameters: tuple[tuple[str, float], ...] = ()
    options: tuple[tuple[str, float], ...] = ()
    precision: str = "float64"
    compensated: bool = False
    anyway: bool = False
    on_singular: str = ""

    @property
    def ivp(self) -> Ivp:
        """The problem with its numbers."""
        return ivp_of(self.problem, self.case, self.parameters, self.on_singular)

    @property
    def solver(self) -> Any:
        """The method."""
        return method_of(self.ivp, self.method, dict(self.options), compensated=self.compensated, anyway=self.anyway)

    @property
    def code(self) -> str:
        """Digest of the files of a method from outside; "" of one of daebench, whose code is that of the package."""
        return content_of(self.method) if is_outside(self.method) else ""

    def plain(self) -> dict[str, Any]:
        """Return the fields as JSON has them."""
        pairs = {name: [list(pair) for pair in getattr(self, name)] for name in ("parameters", "options")}
        return {field.name: getattr(self, field.name) for field in fields(self)} | pairs


Where = tuple[str, str, tuple[tuple[str, float], ...], str, int, float]
"""What decides an initial value problem: problem, case, parameters, what is done where G loses rank, number of its start, and spread."""


@dataclass(frozen=True, kw_only=True)
class GridRun(RunSpecification):
    """One run: beside :class:`RunSpecification` its step size or tolerance, its end, and what is measured.

    Parameters
    ----------
    value : float
        Step size or tolerance of the method.
    t_end : float
        End of the run, s.
    metrics : tuple of str
        What is measured, see :data:`daebench.studies.grid.metrics.METRICS`.
    outputs : int
        States looked at, about.
    repeat : int
        Runs that are timed, of which the best counts; 0 where time is not asked for.
    sweeps : int
        Sweeps after which Newton's iteration is ended, converged or not; 0 for convergence.
    newton : float
        Relative increment that ends Newton's iteration; 0 for that of round-off.
    calls : int
        Calls of the right side or residual after which a tolerance-driven run is given up; 0 for never.
    beside : bool
        Whether it is timed while others may run beside it, on this machine or a cluster: such times are no times of a run alone.
    start : int
        Number of its start: 0 is that of the case, others are neighbours of it, seeded by their number.
    spread : float
        How far neighbours are, see :func:`daebench.starts.members.neighbour`; 0 where all runs start as the case says.
    """

    value: float
    t_end: float
    metrics: tuple[str, ...]
    outputs: int = OUTPUTS
    repeat: int = 0
    sweeps: int = 0
    newton: float = 0.0
    calls: int = 0
    beside: bool = False
    start: int = 0
    spread: float = 0.0

    @property
    def ivp(self) -> Ivp:
        """The problem with its numbers."""
        return ivp_of(*self.where)

    @property
    def where(self) -> Where:
        """The values that decide its initial value problem."""
        return self.problem, self.case, self.parameters, self.on_singular, self.start, self.spread if self.start else 0.0

    @property
    def solver(self) -> Any:
        """The method.

        Raises
        ------
        BadInput
            If Newton's iteration is to be ended early and the method has none that can be.
        """
        method = super().solver
        if not self.sweeps and not self.newton:
            return method
        if not isinstance(method, FixedStep):
            raise BadInput(
                f"Newton's iteration is ended early in fixed-step methods for constrained problems alone, not in {self.method}.",
                "newton-ended-early-elsewhere",
            )
        return replace(method, sweeps=self.sweeps, roundings=max(ROUNDINGS, self.newton / number_type(self.precision).spacing))

    def asked(self, resolution: str) -> Request:
        """Return the request for a run of this resolution with everything monitored."""
        every, points = (self._every, None) if resolution == "h" else (None, max(FEWEST, self.outputs + 1))
        work_limit = WorkLimit(self.calls, self.calls + 1, 1) if self.calls else None
        return Request(value=self.value, t_end=self.t_end, precision=self.precision, every=every, points=points, work_limit=work_limit)

    @property
    def count(self) -> int:
        """How many runs it is."""
        return 1

    @property
    def _every(self) -> int:
        steps = self.t_end / self.value if self.value > 0 else 0.0
        return max(1, int(steps / self.outputs + 0.5)) if steps < 1e15 else 1

    @classmethod
    def of_plain(cls, given: Mapping[str, Any]) -> Self:
        """Return the run with these fields, as :meth:`plain` gives them."""
        known = {field.name for field in fields(cls)}
        if extra := set(given) - known:
            raise BadInput(f"a run has no {', '.join(sorted(extra))}; this store is of another version.", "run-column-unknown")
        pairs = {name: tuple((str(k), float(v)) for k, v in given[name]) for name in ("parameters", "options") if name in given}
        values = {"values": tuple(map(float, given["values"]))} if "values" in given else {}
        others: dict[str, Any] = {name: tuple(value) if isinstance(value, list) else value for name, value in given.items()}
        return cls(**others | pairs | values)

    def rows(self, row: Mapping[str, Any]) -> Iterator[Mapping[str, Any]]:
        """Give the row of each run that it is, of the stored row."""
        yield row

    def of_any_kind(self) -> Self:
        """Return the run without what compiles nothing anew: numbers, outputs and metrics."""
        nothing: dict[str, Any] = {"parameters": (), "options": (), "metrics": (), "case": "", "outputs": 0, "calls": 0, "beside": False}
        return replace(self, value=1.0, t_end=1.0, repeat=min(1, max(0, self.repeat)), **nothing)

    def at(self, value: float) -> "GridRun":
        """Return the same run with another step size or tolerance."""
        return replace(self, value=value)


@lru_cache(maxsize=64)
def ivp_of(
    problem: str, case: str, parameters: tuple[tuple[str, float], ...], on_singular: str, start: int = 0, spread: float = 0.0
) -> Ivp:
    """Return a problem with its numbers from plain values; the last ones that were asked for are at hand."""
    ivp = initial_value_problem(problem, case, dict(parameters), on_singular=on_singular or None)
    return neighbour(ivp, spread, start) if start else ivp


def defined_by(ivp: Ivp) -> tuple[str, ...]:
    """Return the exact definition of a motion: the equations, the parameters and the start.

    Of a file outside of the package the equations are what it gave when it was run, and not its text: see ``mathematics`` of a definition.
    """
    source = ivp.source
    equations = f"{source.facts.MATHEMATICS} {source.algebra}" if source.outside else source.key
    return equations, *(float(x).hex() for x in (*ivp.par, *(x for part in ivp.start for x in part)))


MEASURED = {"energy": ("energy_error", "energy_size", "energy_scale", "energy_verdict"), "manifold": ("g", "Gv"), "jump": ("jump",)}
"""What is measured of them, by the name of the metric, and the columns of it that are kept."""

ALWAYS = ("steps", "failure")
"""Columns that are kept in any case."""


@dataclass(frozen=True, kw_only=True)
class ParameterRuns(GridRun):
    """Runs of one method with one step size over values of a parameter."""

    varied: str
    """Name of the parameter."""
    values: tuple[float, ...]
    """Its values, one for each run."""

    def __post_init__(self) -> None:
        if others := set(self.metrics) - set(MEASURED):
            raise BadInput(
                f"{', '.join(sorted(others))} of runs that are made together is not measured; there are {', '.join(MEASURED)}.",
                "not-measured-together",
            )

    @property
    def count(self) -> int:
        """How many runs these are."""
        return len(self.values)

    @property
    def columns(self) -> tuple[str, ...]:
        """Names of the columns with an entry for each run."""
        return (*ALWAYS, *(name for metric in self.metrics for name in MEASURED[metric]))

    def of_any_kind(self) -> Self:
        """Return the runs without what compiles nothing anew."""
        return replace(super().of_any_kind(), varied="", values=())

    def run(self, i: int) -> GridRun:
        """Return one of the runs by itself."""
        fields = {name: value for name, value in vars(self).items() if name in GridRun.__dataclass_fields__}
        return GridRun(**fields | {"parameters": (*self.parameters, (self.varied, self.values[i]))})

    def rows(self, row: Mapping[str, Any]) -> Iterator[dict[str, Any]]:
        """Give the row of each run, of what was computed for all of them."""
        common = {name: value for name, value in row.items() if name not in self.columns}
        for i, value in enumerate(self.values):
            yield {**common, self.varied: value, **{name: row[name][i] for name in self.columns}}


ERRORS = ("q", "p", "y")
"""What is measured of them: errors of parts of the state."""


@dataclass(frozen=True, kw_only=True)
class StartRuns(GridRun):
    """Runs of one method with one step size or tolerance from many starts.

    The errors are those at ``outputs`` equidistant times, the same for all methods.
    """

    members: int
    """Number of starts; fewer of them are the first of more."""
    distribution: str = "neighbourhood"
    """What they are drawn from, see :func:`daebench.starts.draw.draw_starts`."""
    settings: str = "{}"
    """Its settings, as JSON."""
    seed: int = 0
    """Seeds them."""
    finest: float
    """Smallest step size of the study, s, of which a reference takes a third where heyoka does not make it."""

    def __post_init__(self) -> None:
        whole("members", self.members, 1)
        if others := set(self.metrics) - set(ERRORS):
            raise BadInput(
                f"{', '.join(sorted(others))} of runs from many starts is not measured; there are {', '.join(ERRORS)}.",
                "not-measured-over-starts",
            )

    @property
    def drawn(self) -> dict[str, Any]:
        """Settings of the distribution by name."""
        settings: dict[str, Any] = json.loads(self.settings)
        return settings

    @property
    def count(self) -> int:
        """How many runs these are."""
        return self.members

    def of_any_kind(self) -> Self:
        """Return the runs without what compiles nothing anew."""
        return replace(super().of_any_kind(), members=1, distribution="", settings="", seed=0, finest=1.0)

    def rows(self, row: Mapping[str, Any]) -> Iterator[dict[str, Any]]:
        """Give the row of each run, of what was computed for all of them."""
        for i in range(self.members):
            yield {"member": i} | {name: value[i] if isinstance(value, list) else value for name, value in row.items()}

"""A study: a declared grid of runs, read as one long table."""

from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, field
from itertools import product
from typing import TYPE_CHECKING, Any

from daebench.errors import BadInput, positive, unknown, whole
from daebench.methods.initial_value_problem import initial_value_problem
from daebench.methods.names import free_numbers, methods_of
from daebench.records.store import Store
from daebench.runs.ivp import Ivp
from daebench.runs.request import PRECISIONS
from daebench.studies.grid.metrics import metrics_of
from daebench.studies.grid.run_specification import OUTPUTS, GridRun
from daebench.studies.grid.runs import Tell, runs_of
from daebench.studies.grid.specification import key_of, require_possible

if TYPE_CHECKING:
    import pandas as pd


@dataclass(frozen=True, kw_only=True)
class Study:
    """A grid of runs: every method on every case, with every step size or tolerance and every value of the parameters.

    Parameters
    ----------
    problem : str
        Name in the catalogue, or path of a problem file.
    methods : sequence of str
        Names in the grammar of :mod:`daebench.methods.names`.
    values : mapping of str to sequence of float
        Step sizes under "h" and tolerances under "tol"; under a method's name those of this method only.
    t_end : float
        End of all runs, s.
    cases : sequence of str, optional
        Named initial values; by default the problem's first.
    parameters : mapping of str to sequence of float, optional
        Values of parameters of the problem.
    options : mapping of str to float, optional
        Free numbers of the methods; each is passed to the methods that have it.
    metrics : sequence of str
        Names of metrics, see :data:`daebench.studies.grid.metrics.METRICS`.
    precisions : sequence of str
        "float64", "float32", "mixed" for forces in float32, "compensated" for float64 with compensated sums over steps; "sweeps=2" for
        Newton's iteration ended after two iterations, "newton=1e-6" for one ended by this relative increment.
    outputs : int
        Approximate number of outputs of each run.
    repeat : int
        Number of timed runs, of which the best counts; 0 for no times.
    calls : int
        Calls of the right side or residual after which a tolerance-driven run is given up; 0 for never.
    beside : bool
        Whether timed runs may run beside others; this is stored with their times, which then include the load.
    anyway : bool
        Whether schemes may run where they are not Poisson integrators.
    on_singular : str
        Action where G loses rank; "" for the declaration of the case.
    starts : sequence of int
        Numbers of starts: 0 is the start of the case, others are random starts near it, see
        :func:`daebench.starts.members.neighbour`, which they seed.
    spread : float
        Distance of these starts, relative to the largest position or momentum.

    Raises
    ------
    BadInput
        If a value is unknown, missing, given twice, or not used by any method.
    """

    problem: str
    methods: Sequence[str]
    values: Mapping[str, Sequence[float]]
    t_end: float
    cases: Sequence[str] = ()
    parameters: Mapping[str, Sequence[float]] = field(default_factory=dict)
    options: Mapping[str, float] = field(default_factory=dict)
    metrics: Sequence[str] = ("energy",)
    precisions: Sequence[str] = ("float64",)
    outputs: int = OUTPUTS
    repeat: int = 0
    calls: int = 0
    beside: bool = False
    anyway: bool = False
    on_singular: str = ""
    starts: Sequence[int] = (0,)
    spread: float = 0.01

    def __post_init__(self) -> None:
        positive("t_end", self.t_end)
        positive("spread", self.spread)
        whole("repeat", self.repeat, 0)
        metrics_of(self.metrics)
        axes: dict[str, Sequence[object]] = {name: getattr(self, name) for name in ("methods", "cases", "metrics", "precisions", "starts")}
        axes |= {f"values of {name}": axis for name, axis in (*self.values.items(), *self.parameters.items())}
        for name, values in axes.items():
            if isinstance(values, str) or not isinstance(values, Sequence | range):
                raise BadInput(f"{name} of a study must be several, in a list, not {values!r}.", "study-entry-not-a-list")
            if name == "starts" and any(not isinstance(k, int) or k < 0 for k in values):
                raise BadInput(f"starts of a study are numbers 0, 1, 2, ..., not {list(values)!r}.", "study-starts-not-numbers")
            if len(set(values)) < len(values):
                twice = next(value for k, value in enumerate(values) if value in values[:k])
                raise BadInput(f"{name} of a study has {twice!r} twice; leave one out.", "study-entry-twice")
            if not values and name != "cases":
                raise BadInput(f"{name} of a study is empty; give some.", "study-entry-empty")
        for precision in self.precisions:
            computed_in(precision)

    def specifications(self) -> list[GridRun]:
        """Return the runs, all of them checked.

        Raises
        ------
        BadInput
            If one cannot be made or measured; the message is of the first.
        """
        specifications = list(self._specifications())
        measured: set[tuple[object, ...]] = set()
        # All of one method before the next, while its initial value problem is at hand: it takes longer to make than to use.
        for specification in specifications:
            require_possible(specification)
            if (kind := (specification.method, specification.case, specification.parameters)) not in measured:
                self._require_measurable(specification, specifications)
                measured.add(kind)
            key_of(specification)
        return specifications

    def _require_measurable(self, specification: GridRun, specifications: Sequence[GridRun]) -> None:
        """Refuse a metric that a run cannot be measured by, unless it is not for its method and is for another of the study."""
        one_a_method = {grid_run.method: grid_run for grid_run in specifications}.values()
        for metric in metrics_of(self.metrics):
            for_others = not metric.measures(specification.solver) and any(metric.measures(grid_run.solver) for grid_run in one_a_method)
            if not for_others and (why := metric.refusal(specification)):
                raise BadInput(why, "study-not-measurable")

    def _specifications(self) -> Iterator[GridRun]:
        # With values of the parameters, without which a start of one's own may be off the manifold.
        first = {name: values[0] for name, values in self.parameters.items()}
        ivp = initial_value_problem(self.problem, self.cases[0] if self.cases else None, first)
        solvers = methods_of(ivp, self.methods, self.options, anyway=self.anyway)
        resolutions = [self._values_of(name, solver.knob) for name, solver in zip(self.methods, solvers, strict=True)]
        if useless := set(self.values) - set(self.methods) - {solver.knob for solver in solvers}:
            raise BadInput(
                f"values of {', '.join(sorted(useless))} are not used by {', '.join(self.methods)}; leave them out.", "values-unused"
            )
        grids = [[(name, float(x)) for x in values] for name, values in self.parameters.items()]
        options = [self._options_of(ivp, solver) for solver in solvers]
        for case, given, (name, method_options, values), precision, start in product(
            self.cases or [ivp.case], product(*grids), zip(self.methods, options, resolutions, strict=True), self.precisions, self.starts
        ):
            for value in values:
                yield GridRun(
                    problem=self.problem,
                    case=case,
                    method=name,
                    value=float(value),
                    t_end=float(self.t_end),
                    metrics=tuple(self.metrics),
                    parameters=tuple(given),
                    options=method_options,
                    anyway=self.anyway,
                    on_singular=self.on_singular,
                    outputs=self.outputs,
                    repeat=self.repeat,
                    calls=self.calls,
                    beside=self.beside and self.repeat > 0,
                    start=int(start),
                    spread=float(self.spread) if any(self.starts) else 0.0,
                    **computed_in(precision),
                )

    def _options_of(self, ivp: Ivp, solver: Any) -> tuple[tuple[str, float], ...]:
        known = free_numbers(solver)
        return tuple((key, number) for key, number in self.options.items() if key in known)

    def _values_of(self, method: str, resolution: str) -> Sequence[float]:
        values = self.values.get(method, self.values.get(resolution))
        if values is None:
            raise BadInput(f"{method} needs values of {resolution}; give values={{{resolution!r}: [...]}}.", "values-missing")
        return [positive(resolution, value) for value in values]

    def table(self, store: Store, *, executor: Executor | None = None, tell: Tell | None = None) -> "pd.DataFrame":
        """Return one row per run; stored rows are taken from the store, and the others are computed and stored.

        Parameters
        ----------
        store : Store
            Store of the rows, see :func:`daebench.records.store.opened`.
        executor : Executor, optional
            Executor of runs side by side, see :func:`daebench.studies.grid.schedulers.local_processes`; by default they are made in turn.
        tell : callable, optional
            Called with the number of finished runs, the number of all runs, and the last run.

        Returns
        -------
        DataFrame
            The fields of the run, one column each for its parameters; steps, t_reached (s), seconds (CPU time of stepping), failure and
            counts of work ``n_...``; and the columns of every metric. A run that stopped early has its row, with NaN where nothing was
            measured.

        Raises
        ------
        BadInput
            As :meth:`specifications`.
        StoreFull
            If rows cannot be written; stored rows are intact.
        """
        return runs_of(store, executor=executor, tell=tell)(self.specifications())


def computed_in(precision: str) -> dict[str, Any]:
    """Return the fields of a run for one of the words that ``precisions`` of a study has; raise BadInput for any other."""
    fixed: dict[str, dict[str, Any]] = {name: {"precision": name} for name in PRECISIONS} | {"compensated": {"compensated": True}}
    if precision in fixed:
        return fixed[precision]
    name, _, value = precision.partition("=")
    if name == "sweeps" and value.isdecimal() and int(value) > 0:
        return {"sweeps": int(value)}
    if name == "newton" and 0 < _float(value) < 1:
        return {"newton": float(value)}
    raise unknown("precision", precision, (*fixed, "sweeps=1", "newton=1e-6"))


def _float(text: str) -> float:
    try:
        return float(text)
    except ValueError:
        return float("nan")

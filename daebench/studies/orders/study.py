"""The orders of methods, measured: errors against step size for each component separately, and their slope.

Errors are measured at the common times t = T k/8, k = 1, ..., 8, which every step size reaches exactly: h = T/(8 n) with whole n. The
error of a component at one time is the Euclidean norm over its entries, in the problem's own units; that of a run is the largest
over the common times. A stage multiplier that belongs to grid points is taken at those that are common times; one that belongs to
times inside of a step in the steps that begin at a common time, against the reference at the very time it belongs to.

By default the step sizes depend on the claimed order, because a method of high order reaches round-off in a few halvings from T/8, while a
method of order 1 may show it at very small steps only. Methods of order 5 and more are given three step sizes between the halvings, at
which stage multipliers are not measured. Refinement ends where q and p - or y, of a Poisson system - have not fallen any more for two step
sizes, near round-off or below what the reference is good for, and after a run of more than a second.
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar, Unpack

from daebench.errors import BadInput, positive
from daebench.methods.initial_value_problem import initial_value_problem
from daebench.methods.names import Code, kind_of, methods_of, several
from daebench.reference.solution import ReferenceSolution, reach, reference_solution
from daebench.runs.ivp import Ivp
from daebench.runs.own_start import OwnStart
from daebench.runs.request import Method, Told
from daebench.runs.result import Result, Table, tabular
from daebench.studies.measurable import claimed_order, measured
from daebench.studies.orders.bench import BENCHES
from daebench.studies.orders.series import COMMON, Series, step_sizes
from daebench.systems.lazily import pandas as pd

if TYPE_CHECKING:
    from daebench.systems.constrained import ConstrainedHamiltonian
    from daebench.systems.poisson import PoissonSystem

LONG, LONGEST = 256, 2.0**10
"""The default end time is at most so many steps of DOP853 at 1e-13, and at most so long, s: what is at rest has no time of its own."""


@dataclass(frozen=True)
class Orders(Result):
    """Orders of several methods on one initial value problem."""

    drawn_by: ClassVar[str] = "daebench.studies.orders.figure"
    stem: ClassVar[str] = "order"
    table_files: ClassVar[tuple[str, ...]] = ("orders.csv",)
    fails_if: ClassVar[str] = "a method fails at every step size"

    ivp: Ivp
    """What was solved."""
    t_end: float
    """End time, s."""
    reference_solution: ReferenceSolution
    """The reference at the common times."""
    series: tuple[Series, ...]
    """One for each method and component."""

    @property
    def table(self) -> "pd.DataFrame":
        """One row for each method and component, as :meth:`Series.row` gives them."""
        return pd.DataFrame([series.row() for series in self.series]).astype({"claimed": "Int64"})

    @property
    def drawn(self) -> "pd.DataFrame":
        """One row for each method, component and step size."""
        return pd.DataFrame([row for series in self.series for row in series.rows()])

    @property
    def status(self) -> int:
        """1 if a method fails at every step size."""
        return int(any(all(point.failure for point in series.points) for series in self.series))

    def summary(self) -> dict[str, Any]:
        """Return all measurements, for JSON."""
        return {
            **self.posed,
            "t_end": self.t_end,
            "times": self.reference_solution.t,
            "error": "largest Euclidean norm over the times",
            "reference": {"kind": self.reference_solution.kind, "bound": dict(self.reference_solution.bound)},
            "series": [series.plain() for series in self.series],
        }

    def printed(self) -> Iterator[str | Table]:
        """Yield the orders, a row a method and component, the reference, and why runs failed."""
        columns = ("method", "component", "claimed", "order", "standard error", "points", "dropped", "note")
        yield Table(columns, [series.line() for series in self.series])
        where = f"{self.ivp.problem}, case {self.ivp.case}, T = {self.t_end:g}"
        yield f"{where}: largest Euclidean norm of the error over t = T k/8, k = 1..8."
        bounds = ", ".join(f"{name} {bound:.1e}" for name, bound in self.reference_solution.bound.items())
        yield f"Reference: {self.reference_solution.kind}, good for {bounds}."
        yield from dict.fromkeys(point.failure for series in self.series for point in series.points if point.failure)


@tabular
def order(
    problem: "str | ConstrainedHamiltonian | PoissonSystem",
    *,
    methods: Sequence[Code | Method[Any, Any]],
    case: str | None = None,
    t_end: float | None = None,
    h: float | None = None,
    halvings: int | None = None,
    parameters: Mapping[str, float] | None = None,
    options: Mapping[str, float] | None = None,
    anyway: bool = False,
    on_singular: str | None = None,
    progress: Told | None = None,
    **start: Unpack[OwnStart],
) -> Orders:
    """Measure the orders of methods.

    Errors of q, p, lam and stage multipliers are measured separately; for a Poisson system, errors of y. They are Euclidean norms, the
    largest over t = T k/8, k = 1..8.

    Parameters
    ----------
    problem : str, ConstrainedHamiltonian or PoissonSystem
        Name in the catalogue, the path of a problem file, which is executed, or a definition.
    methods : sequence of str or callable
        Names of fixed-step methods; FILE.py:NAME, LIBRARY.so:NAME and exec:PROGRAM are executed.
    case : str, optional
        Named initial values; by default the problem's first.
    t_end : float, optional
        Time T at which errors are taken, s; by default the power of two that 256 steps of DOP853 at 1e-13 just reach, at most 1024.
    h : float, optional
        Largest step size, s, rounded down to T/(8 n). By default it depends on the order that a method claims.
    halvings : int, optional
        Number of halvings. By default until round-off is reached.
    parameters, options : mapping of str to float, optional
        Values of the problem's parameters, and free numbers of the methods.
    anyway : bool
        Whether schemes may run on Poisson systems for which they are not Poisson integrators.
    on_singular : str, optional
        What happens where G loses rank, see :func:`daebench.run`; by default what the case declares.
    progress : callable, optional
        Called with the fraction done and a label of the current task.
    **start : OwnStart
        A start of one's own in place of the case's: q0, p0, v0, y0 and project, as for :func:`daebench.initial_value_problem`.

    Returns
    -------
    DataFrame
        Columns method, component, claimed, order, order_error (its standard error), used, points, dropped, note. The order is the slope
        of log error against log h over the ``used`` of ``points`` that are asymptotic, see
        :func:`daebench.diagnostics.order.fit_order`.

    Raises
    ------
    BadInput
        If a name, time or step size is invalid.
    RunFailed
        If there is no reference for the runs.

    Examples
    --------
    >>> import daebench
    >>> table = daebench.order("planar_pendulum", methods=["rattle"])
    >>> table[["component", "claimed", "order"]].round(1).head(3).values.tolist()
    [['q', 2, 2.0], ['p', 2, 2.0], ['lam', 2, 2.0]]
    """
    ivp = initial_value_problem(problem, case, parameters, on_singular=on_singular, **start)
    return study(ivp, methods_of(ivp, methods, options, anyway=anyway), t_end=t_end, h=h, halvings=halvings, began=progress)


def study(
    ivp: Ivp,
    methods: Sequence[Code | Method[Any, Any]],
    *,
    t_end: float | None = None,
    h: float | None = None,
    halvings: int | None = None,
    counts: Sequence[int] | None = None,
    began: Told | None = None,
) -> Orders:
    """Return the errors and orders of several methods on one initial value problem; all requests are checked before the first run."""
    chosen = [measured(method, ivp, "and has no order in h") for method in several(methods, kind=kind_of(ivp))]
    if not chosen:
        raise BadInput("an order study needs at least one method, for example rattle.", "orders-without-method")
    end = positive("t_end", t_end) if t_end is not None else min(LONGEST, 2.0 ** math.floor(math.log2(reach(ivp, LONG))))
    sequences = [list(counts) if counts else step_sizes(end, claimed_order(method), h, halvings) for method in chosen]
    known = reference_solution(ivp, [end * k / COMMON for k in range(1, COMMON + 1)])
    bench: Any = BENCHES[ivp.state]
    series: list[Series] = []
    for k, (method, sequence) in enumerate(zip(chosen, sequences, strict=True)):
        if began:
            began(k / len(chosen), f"{method.name} on {ivp.problem}")
        series += bench(ivp, method, known).series(sequence, stop=halvings is None and not counts)
    return Orders(ivp, end, known, tuple(series))

"""``daebench.ensemble``: one fixed-step method on many starts at once, in pieces of a store where one is given."""

from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import replace
from typing import TYPE_CHECKING, Annotated, Any, Unpack

import numpy as np

from daebench.errors import BadInput, whole
from daebench.methods.ensemble.result import EnsembleRun
from daebench.methods.ensemble.run import run_members
from daebench.methods.initial_value_problem import initial_value_problem
from daebench.methods.names import fixed_step_method_of
from daebench.methods.plan import plan
from daebench.records.store import Store
from daebench.runs.grid import require_memory_of_members
from daebench.runs.ivp import Ivp
from daebench.runs.members import Members
from daebench.runs.option import Option
from daebench.runs.own_start import OwnStart, parted
from daebench.runs.request import Progress, Request
from daebench.starts.draw import distribution_of, draw_starts
from daebench.starts.members import Grid
from daebench.studies.ensemble.result import Ensemble
from daebench.studies.grid.member_runs import MemberRuns, joined, packed
from daebench.studies.grid.runs import computed
from daebench.studies.grid.specification import key_of

if TYPE_CHECKING:
    from daebench.runs.ivp import InitialValueProblem
    from daebench.starts.members import Distribution
    from daebench.systems.constrained import ConstrainedHamiltonian
    from daebench.systems.poisson import PoissonSystem


PIECE = 256
"""Members of a piece at most: whole vectors, and little lost with what computes it."""

NUMBERS = 2**20
"""Numbers of states of a piece, about."""

MOST_NUMBERS = 2**26
"""Numbers of states of one member that a row of a store can have."""


def stored_run(
    store: Store, executor: Executor | None, settings: Mapping[str, Any], some: Members, asked: Request, method: Any
) -> EnsembleRun:
    """Return the runs of all members, each to the bit as :func:`daebench.methods.ensemble.run.run_members` has it."""
    pieces = list(_pieces(settings, some, asked))
    tell = _telling(asked.progress, len(pieces))
    rows = computed(pieces, store, executor=executor, tell=tell)
    return joined(method.name, some, [rows[key_of(piece)] for piece in pieces])


def _telling(progress: Progress | None, pieces: int) -> Any:
    return (lambda done, of, _: progress(done / of)) if progress else None


def _pieces(settings: Mapping[str, Any], some: Members, asked: Request) -> Iterator[MemberRuns]:
    """Give the members piece by piece."""
    n = len(some)
    assert asked.steps is not None
    stored = asked.steps // asked.every if asked.every else 1
    of_one = some.ivp.size * (stored + 1)
    if of_one > MOST_NUMBERS:
        raise BadInput(
            f"{of_one} numbers of states of each member are more than a row of a store can have; take fewer --points.",
            "member-points-too-many",
        )
    h = np.broadcast_to(some.h, (n,))
    numbers = np.concatenate([*(vectors.T for vectors in some.start), h[None], *(values[None] for values in some.parameters.values())])
    watch = asked.watched(some.ivp.state)
    size = max(1, min(PIECE, NUMBERS // of_one))
    for first in range(0, n, size):
        part = slice(first, min(n, first + size))
        value = float(np.max(h[part]))
        yield MemberRuns(
            **settings,
            value=value,
            t_end=asked.steps * value,
            metrics=(),
            first=first,
            members=part.stop - first,
            differing=tuple(some.parameters),
            numbers=packed(numbers[:, part]),
            every=asked.every or 0,
            steps=asked.steps,
            watch=tuple(watch),
            work=asked.count,
        )


def settings_of(problem: Any, case: str, method: str, given: Mapping[str, Any]) -> dict[str, Any]:
    """Return the fields that name problem and method, of settings of :func:`daebench.run`."""
    if not isinstance(problem, str):
        raise BadInput("a stored ensemble needs a problem of the catalogue or in a file; give its name or path.", "stored-ensemble-unnamed")
    pairs = {name: tuple((given.get(name) or {}).items()) for name in ("parameters", "options")}
    plain = {name: given[name] for name in ("compensated", "anyway") if name in given}
    known = {*pairs, *plain, "on_singular", "watch", "count", "case"}
    if others := sorted(name for name in given if name not in known and given[name] is not None):
        raise BadInput(f"{', '.join(others)} cannot be given for a stored ensemble.", "not-of-stored-ensemble")
    return {"problem": problem, "case": case, "method": method, "on_singular": given.get("on_singular") or "", **pairs, **plain}


class EnsembleSettings(OwnStart, total=False):
    """Settings of the runs of an ensemble, beside where they start from."""

    watch: Sequence[str] | None
    """Monitored quantities."""
    count: bool
    """Whether work is counted."""


MEMBERS = 1024
"""Default number of members of an ensemble."""

POINTS = 101
"""Default number of stored states per member, including the start; approximate."""


def ensemble(
    problem: "str | ConstrainedHamiltonian | PoissonSystem | InitialValueProblem",
    *,
    method: str,
    h: float | None = None,
    t_end: float | None = None,
    steps: int | None = None,
    members: int | None = None,
    starts: "str | Distribution" = "neighbourhood",
    drawn: Annotated[Mapping[str, Any] | None, Option("--grid")] = None,
    vary: Mapping[str, tuple[float, float]] | None = None,
    weights: Annotated[Any, Option(command=False)] = None,
    case: str | None = None,
    parameters: Mapping[str, float] | None = None,
    options: Mapping[str, float] | None = None,
    seed: int = 0,
    points: int = POINTS,
    compensated: bool = False,
    on_singular: str | None = None,
    anyway: bool = False,
    lanes: Annotated[int | None, Option(command=False)] = None,
    threads: Annotated[int | None, Option(command=False)] = None,
    progress: Progress | None = None,
    store: Store | None = None,
    executor: Executor | None = None,
    **settings: Unpack[EnsembleSettings],
) -> Ensemble:
    """Run one method on many starts at once, several in the vectors of each core.

    Each run is equal to the bit to a single one. With a store, members that are in it are not run again, and an interrupted ensemble loses
    little. A member that fails keeps its last good state and the reason, and the others continue::

        >>> import daebench
        >>> swings = daebench.ensemble("spherical_pendulum", case="fig1.2", method="rattle", h=0.01, t_end=1, members=64)
        >>> swings.q.shape
        (101, 64, 3)
        >>> len(swings.run.failed)
        0
        >>> bool(swings.run.maxima["g"].max() < 1e-14)
        True

    Parameters
    ----------
    problem : str, ConstrainedHamiltonian, PoissonSystem or InitialValueProblem
        Name in the catalogue, the path of a problem file, which is executed, a definition, or an initial value problem.
    method : str
        Name of a fixed-step method, for example "rattle" or "lobatto3/suzuki4".
    h : float, optional
        Step size, s, if it is not in a grid.
    t_end : float, optional
        End time, s.
    steps : int, optional
        Number of steps, in place of ``t_end``.
    members : int, optional
        Number of starts; by default 1024, or the size of a grid.
    starts : str or Distribution
        Distribution of the starts: "neighbourhood" of the case, "liouville" or "energy" for the measure that the flow preserves, in a
        box or at one energy, or "grid", see :func:`daebench.starts.draw.draw_starts`.
    drawn : mapping of str, optional
        Settings of the distribution: ``size``, ``box``, ``E``, ``values``.
    vary : mapping of str to (float, float), optional
        Bounds of parameters that differ from member to member, each uniform between two values, gravity=5:15.
    weights : array_like, shape(n, s), optional
        Weights of the s substeps of a composition, of each member, as 3 of "rattle/triple_jump4"; they sum to 1. Those of the composition
        itself if left out.
    case : str, optional
        Named initial values; by default the problem's first.
    parameters, options : mapping of str to float, optional
        Parameters of the problem, and free numbers of the method.
    seed : int
        Seed of starts and parameters.
    points : int
        Approximate number of stored states per member.
    compensated : bool
        Whether sums over steps are compensated.
    on_singular : str, optional
        What happens where G loses rank, see :func:`daebench.run`; by default what the case declares.
    anyway : bool
        Whether a scheme may run on a structure matrix for which it is not a Poisson integrator.
    lanes : int, optional
        Number of members at once on one core, 1 for one after another; by default the fastest for the processor.
    threads : int, optional
        Number of cores; by default all.
    progress : callable, optional
        Called with the fraction done.
    store : Store, optional
        Store for pieces of up to 256 members, see :func:`daebench.records.store.opened`: stored pieces are not run again, and an
        interrupted ensemble continues to the same bits.
    executor : Executor, optional
        Executor of stored pieces: processes on this machine, or a Dask cluster, see
        :func:`daebench.studies.grid.schedulers.local_processes` and :func:`daebench.studies.grid.schedulers.dask_cluster`; by default this
        process.
    **settings : EnsembleSettings
        A start of one's own in place of the case's, as for :func:`daebench.initial_value_problem`; and ``watch`` and ``count`` of
        :func:`daebench.run`.

    Returns
    -------
    Ensemble

    Raises
    ------
    BadInput
        If the request cannot be met, the method has no fixed steps, there is no member, or states do not fit into memory; or there is an
        executor without a store.
    """
    _require(points, store, executor, weights)
    distribution = distribution_of(starts, drawn or {})
    start, others = parted(settings)
    given = {"options": options, "compensated": compensated, "on_singular": on_singular, "anyway": anyway, **others}
    where = initial_value_problem(problem, case, parameters, **start)
    fixed_step_method_of(where, method, options, anyway=anyway)
    numbers = {"h": _largest_step(distribution, h, steps), "t_end": t_end, "steps": steps, "progress": progress}
    solver, ivp, asked = _prepared(where, method, points, numbers | given)
    members = members if members is not None else distribution.size if isinstance(distribution, Grid) else MEMBERS
    require_memory_of_members(solver.grid(ivp, asked).rows, ivp.size, whole("members", members))
    drawn_starts = draw_starts(ivp, distribution, members=members, h=h, vary=vary, seed=seed)
    some = drawn_starts.members if weights is None else drawn_starts.members.weighted(weights)
    if store is None:
        run = run_members(solver, some, asked, lanes=lanes, threads=threads)
    else:
        fields = settings_of(problem, ivp.case, method, {"parameters": parameters, **given})
        run = stored_run(store, executor, fields, some, asked, solver)
    return Ensemble(run, drawn_starts.about, seed, solver, asked)


def _largest_step(distribution: Any, h: float | None, steps: int | None) -> float | None:
    """Return the step size, or the largest in a grid of them."""
    sizes = distribution.values.get("h") if isinstance(distribution, Grid) else None
    if sizes is not None and (h is not None or steps is None):
        raise BadInput(
            "with h in the grid give a number of steps, and no other h: members then end at different times.", "grid-h-without-steps"
        )
    return h if sizes is None else float(max(sizes))


def _prepared(where: Ivp, method: str, points: int, numbers: Mapping[str, Any]) -> tuple[Any, Ivp, Request]:
    """Return method, problem and the request for a number of states, about."""
    planned = plan(where, method=method, every=0, **{"count": False, **numbers})
    solver, ivp, request = planned.method, planned.ivp, replace(planned.request, progress=numbers.get("progress"))
    steps = solver.grid(ivp, request).steps
    return solver, ivp, replace(request, t_end=None, steps=steps, every=max(1, steps // (points - 1)) if points > 1 else 0)


def _require(points: int, store: Store | None, executor: Executor | None, weights: Any) -> None:
    if whole("points", points) < 1:
        raise BadInput(f"points = {points} must be at least 1, which stores the start and the end.", "points-not-positive")
    if store is not None and weights is not None:
        raise BadInput("weights of members cannot be stored; leave out either weights or the store.", "weights-not-stored")
    if executor is not None and store is None:
        raise BadInput("an executor needs a stored ensemble; give a store.", "executor-without-store")

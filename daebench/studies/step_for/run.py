"""``daebench.step_for``: the largest step size whose statistics over many starts agree with those of half of it."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import partial
from typing import TYPE_CHECKING, Any, Unpack

import numpy as np

from daebench.diagnostics.equivalence import EQUIVALENT, FEWEST, LEVEL, equivalence
from daebench.errors import BadInput, positive, unknown, whole
from daebench.methods.ensemble.result import EnsembleRun
from daebench.methods.ensemble.run import run_members
from daebench.methods.fixed_step.base import FixedStepMethod
from daebench.methods.initial_value_problem import initial_value_problem
from daebench.methods.names import fixed_step_method_of
from daebench.runs.grid import require_memory_of_members
from daebench.runs.ivp import Array, Ivp
from daebench.runs.members import Members
from daebench.runs.own_start import OwnStart
from daebench.runs.request import Progress, Request
from daebench.starts.box import columns
from daebench.starts.draw import draw_starts
from daebench.starts.mechanics import Mechanics
from daebench.studies.step_for.result import STOPPED, StepFor, Tried

if TYPE_CHECKING:
    from daebench.runs.ivp import InitialValueProblem
    from daebench.starts.members import Distribution
    from daebench.systems.constrained import ConstrainedHamiltonian
    from daebench.systems.poisson import PoissonSystem


Quantity = Callable[[Members, Array], Array]
"""From members and one state of each, shape(n, c), to one number of each."""


def _of(name: str, take: Callable[[Array], Array] = np.asarray) -> Quantity:
    return lambda members, states: take(members.of_states(name, states))


def _largest(values: Array) -> Array:
    return np.asarray(np.max(np.abs(values), axis=1))


def _component(i: int) -> Callable[[Array], Array]:
    return lambda values: values[:, i]


def _coordinate(column: int, members: Members, states: Array) -> Array:
    return states[:, column]


def _potential(members: Members, states: Array) -> Array:
    return Mechanics(members).U(members.ivp.vectors(states)[1].T)


def _kinetic(members: Members, states: Array) -> Array:
    received = np.sum(members.ivp.vectors(states)[0][:, members.ivp.moving :], axis=1)  # by a system in time, with the other sign
    return np.asarray(members.of_states("H", states) - _potential(members, states) - received)


def known(ivp: Ivp) -> Mapping[str, Quantity]:
    """Return the quantities of a problem by name.

    They are ``energy``; ``kinetic`` and ``potential`` energy where H is quadratic in p, of a system in time if M and U are given; ``g`` and
    ``Gv``, the largest moduli of what vanishes on the manifold; coordinates, as q1, p2 or y1; and the problem's first integrals and Casimir
    functions by their names.
    """
    quantities: dict[str, Quantity] = {"energy": _of("H")}
    if ivp.on_manifold:
        if ivp.facts.QUADRATIC and not (ivp.facts.EXTENDED and ivp.facts.EXPLICIT):
            quantities |= {"kinetic": _kinetic, "potential": _potential}
        quantities |= {name: _of(name, _largest) for name in ("g", "Gv")}
    quantities |= {name: partial(_coordinate, column) for name, column in columns(ivp).items()}
    quantities |= {name: _of("integrals", _component(i)) for i, name in enumerate(ivp.integrals)}
    return quantities | {name: _of("casimirs", _component(i)) for i, name in enumerate(ivp.casimirs)}


def quantity(ivp: Ivp, name: Any) -> Quantity:
    """Return a quantity by name."""
    if ivp.arrays:
        raise BadInput(
            f"statistics take vectors of few numbers, and those of {ivp.problem} are arrays; choose fewer bodies or sites.",
            "statistics-of-arrays",
        )
    quantities = known(ivp)
    if name not in quantities:
        raise unknown(f"statistic of {ivp.problem}", str(name), quantities)
    return quantities[name]


def means(run: EnsembleRun, of: Quantity) -> Array:
    """Return the mean of a quantity over the stored states behind the start, shape(n,); NaN of a member that stopped early."""
    rows = [of(run.members, states) for states in run.states[1:]]
    average: Array = np.mean(rows, axis=0)
    return np.where(run.status == 0, average, np.nan)


MEMBERS = 1024
"""Starts, where their number is not said."""

HALVINGS = 6
"""Step sizes that are tried at most, each half of the one before."""

MOST_HALVINGS = 32
"""Step sizes that may be asked for: the last of them takes 4e9 times the steps of the first."""

POINTS = 200
"""Times that a mean is taken over: from so many up to twice as many, or all steps where these are fewer."""


def step_for(
    problem: "str | ConstrainedHamiltonian | PoissonSystem | InitialValueProblem",
    *,
    statistic: str,
    margin: float,
    method: str,
    h: float,
    t_end: float,
    members: int = MEMBERS,
    halvings: int = HALVINGS,
    level: float = LEVEL,
    starts: "str | Distribution" = "neighbourhood",
    drawn: Mapping[str, Any] | None = None,
    case: str | None = None,
    parameters: Mapping[str, float] | None = None,
    options: Mapping[str, float] | None = None,
    anyway: bool = False,
    on_singular: str | None = None,
    seed: int = 0,
    threads: int | None = None,
    progress: Progress | None = None,
    **start: Unpack[OwnStart],
) -> StepFor:
    """Find the largest step size whose statistic agrees with that of half of it.

    The steps h, h/2, h/4, ... are tried; whether the half of the one that passes agrees with the exact motion is not tested.

    In chaos a trajectory is lost long before its end with any step, but means over time and over starts are not. Each member gives
    one number, the mean of a quantity over time; the members at h and at h/2 have the same starts. The step passes if the mean and three
    quantiles of this number over the members differ by less than the margin, in an equivalence test, see
    :func:`daebench.diagnostics.equivalence.equivalence`: the absence of a visible difference is not enough to pass. ``halvings`` tests are
    planned, each at level / halvings, so that the probability of passing any step that differs by the margin or more is at most ``level``.
    The search ends with the first step that passes::

        >>> import daebench
        >>> asked = {"statistic": "energy", "margin": 0.005, "method": "rattle", "h": 0.02, "t_end": 5}
        >>> found = daebench.step_for("double_pendulum", case="horizontal", drawn={"size": 1e-3}, **asked)
        >>> [row.verdict for row in found.tried], found.h
        (['different', 'equivalent'], 0.01)

    The margin is to be seen beside the spread over the starts: a quantile may be shifted by a part of the members that is as small as the
    part of them within a margin of it, and of these the sample must have some ten. Where it has fewer the verdict is undecided, and says
    how many members would decide. The smaller the spread of the starts, the fewer these are.

    Parameters
    ----------
    problem : str, ConstrainedHamiltonian, PoissonSystem or InitialValueProblem
        Name in the catalogue, the path of a problem file, which is executed, a definition, or an initial value problem.
    statistic : str
        Name of a quantity: "energy", "kinetic", "potential", "g", "Gv", a coordinate such as "q1", or a first integral, see
        :func:`daebench.studies.step_for.run.known`.
    margin : float
        Margin of equivalence, in the unit of the quantity.
    method : str
        Name of a fixed-step method, for example "rattle".
    h : float
        The largest step size, s.
    t_end : float
        Time of each run, s.
    members : int
        Number of starts, at least 32.
    halvings : int
        Largest number of step sizes to try.
    level : float
        Probability that the search passes a step size that differs from its half by the margin or more.
    starts : str or Distribution
        Distribution of the starts, see :func:`daebench.starts.draw.draw_starts`.
    drawn : mapping of str, optional
        Settings of the distribution: ``size``, ``box``, ``E``.
    case : str, optional
        Named initial values; by default the problem's first.
    parameters, options : mapping of str to float, optional
        Parameters of the problem, and free numbers of the method.
    anyway : bool
        Whether a scheme may run on a structure matrix for which it is not a Poisson integrator.
    on_singular : str, optional
        What happens where G loses rank, see :func:`daebench.run`; by default what the case declares.
    seed : int
        Seed of the starts.
    threads : int, optional
        Number of cores; by default all.
    progress : callable, optional
        Called with the fraction of the tests done.
    **start : OwnStart
        A start of one's own in place of the case's: q0, p0, v0, y0 and project, as for :func:`daebench.initial_value_problem`.

    Returns
    -------
    StepFor

    Raises
    ------
    BadInput
        If the request cannot be met, the method has no fixed steps, the quantity is unknown, or states do not fit into memory.
    """
    ivp = initial_value_problem(problem, case, parameters, on_singular=on_singular, **start)
    solver = fixed_step_method_of(ivp, method, options, anyway=anyway)
    of = quantity(ivp, statistic)
    positive("margin", margin)
    _require_numbers(halvings, members, level)
    require_memory_of_members(2 * POINTS, ivp.size, members)
    begun = draw_starts(ivp, starts, members=members, h=positive("h", h), seed=seed, **(drawn or {}))
    search = _Search(solver, begun.members, t_end, threads)
    search.check(halvings)
    tried: list[Tried] = []
    run = _averaged(search.run(0), of)
    for k in range(halvings):
        half = _averaged(search.run(k + 1), of)
        tried.append(_tested(run, half, margin, level / halvings))
        if progress:
            progress((k + 1) / halvings)
        if tried[-1].verdict == EQUIVALENT:
            break
        run = half
    return StepFor(ivp, solver.name, statistic, margin, level, halvings, search.steps * float(h), begun.about, members, seed, tuple(tried))


def _require_numbers(halvings: int, members: int, level: float) -> None:
    if not 1 <= whole("halvings", halvings) <= MOST_HALVINGS or whole("members", members) < FEWEST or not 0 < level < 0.5:
        raise BadInput(
            f"a search needs 1 to {MOST_HALVINGS} halvings, at least {FEWEST} members, and a level between 0 and 0.5.",
            "search-numbers-out-of-range",
        )


@dataclass(frozen=True)
class _Averaged:
    """Numbers of the runs at one step size for a test, so that their states need not be kept."""

    h: float
    """The step size."""
    means: Array
    """Mean of the quantity over time, one a member; shape (n,)."""
    stopped: str
    """How many members stopped early, and why the first of them did; "" where none did."""


def _averaged(run: EnsembleRun, of: Quantity) -> _Averaged:
    h, averages, stopped = float(run.members.h), means(run, of), ""
    if len(run.failed):
        stopped = f"{len(run.failed)} of {len(averages)} members stopped at h = {h:g}: {run.reason(int(run.failed[0]))}"
    return _Averaged(h, averages, stopped)


def _tested(run: _Averaged, half: _Averaged, margin: float, level: float) -> Tried:
    """Return the test of the statistics at a step against those at its half."""
    if why := run.stopped or half.stopped:
        return Tried(run.h, STOPPED, None, why)
    test = equivalence(run.means, half.means, margin, level=level)
    return Tried(run.h, test.verdict, test, test.lacking)


class _Search:
    """The runs of all members at h, h/2, h/4, ..., with states at the same times."""

    def __init__(self, method: FixedStepMethod[Any, Any], members: Members, t_end: float, threads: int | None) -> None:
        self.method, self.members, self.threads = method, members, threads
        steps = method.grid(members.ivp, Request(value=members.h, t_end=t_end, every=0)).steps
        self.every = max(1, steps // POINTS)
        self.steps = steps // self.every * self.every

    def _request(self, k: int) -> Request:
        return Request(value=self.members.h / 2**k, steps=self.steps * 2**k, every=self.every * 2**k, watch=(), count=False)

    def check(self, halvings: int) -> None:
        """Refuse, before the runs, more steps than can be counted."""
        self.method.grid(self.members.ivp, self._request(halvings))

    def run(self, k: int) -> EnsembleRun:
        """Return the runs at h / 2^k."""
        some = replace(self.members, h=self.members.h / 2**k)
        return run_members(self.method, some, self._request(k), threads=self.threads)

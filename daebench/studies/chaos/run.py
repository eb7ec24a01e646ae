"""``daebench.chaos``: Lyapunov exponents and a fast indicator over a plane of starts."""

from collections.abc import Mapping
from typing import TYPE_CHECKING, Annotated, Unpack

import numpy as np

from daebench.diagnostics.lyapunov import FEWEST
from daebench.errors import BadInput, positive, whole
from daebench.methods.ensemble.tangents import tangent_growth, tangent_vectors
from daebench.methods.initial_value_problem import initial_value_problem
from daebench.methods.names import fixed_step_method_of
from daebench.runs.members import Members
from daebench.runs.option import Option
from daebench.runs.own_start import OwnStart
from daebench.runs.request import Progress, Request
from daebench.runs.scales import constrained_scales_of
from daebench.runs.trajectory import Array
from daebench.studies.chaos.plane import energy_in, plane_in, plane_of, section_of, surface
from daebench.studies.chaos.result import Chaos

if TYPE_CHECKING:
    from daebench.runs.ivp import InitialValueProblem
    from daebench.systems.constrained import ConstrainedHamiltonian
    from daebench.systems.poisson import PoissonSystem

CELLS = 64
"""Cells along a side."""

INTERVALS = 1000
"""Intervals of time, after each of which the tangent vector is brought back to length 1: from so many up to twice as many, or all steps
where these are fewer."""


def chaos(
    problem: "str | ConstrainedHamiltonian | PoissonSystem | InitialValueProblem",
    *,
    method: str,
    h: float,
    t_end: float | None = None,
    steps: int | None = None,
    plane: Annotated[Mapping[str, tuple[float, float] | None] | None, Option(read=plane_in)] = None,
    cells: int = CELLS,
    energy: Annotated[float | str | None, Option(read=energy_in)] = None,
    section: Mapping[str, float] | None = None,
    case: str | None = None,
    parameters: Mapping[str, float] | None = None,
    options: Mapping[str, float] | None = None,
    anyway: bool = False,
    on_singular: str | None = None,
    seed: int = 0,
    threads: int | None = None,
    progress: Progress | None = None,
    **start: Unpack[OwnStart],
) -> Chaos:
    """Find the chaotic starts of a plane by the tangent map of the scheme.

    For each start this is the largest Lyapunov exponent and the fast indicator MEGNO. Regular means that no exponential growth was observed
    in this time t: an exponent below about 10/t cannot be distinguished from zero.

    A tangent vector of random direction is propagated along each motion by the derivative of the scheme's own steps, exact to round-off.
    See :mod:`daebench.diagnostics.lyapunov` for the indicator, and :func:`daebench.diagnostics.lyapunov.exponents` for the verdict and for
    how often it is wrong on starts with known answers::

        >>> import daebench
        >>> map = daebench.chaos(
        ...     "double_pendulum", case="horizontal", method="rattle", h=0.01, t_end=50, plane={"q2": (0.5, 0.9), "q4": (0.6, 1.2)}, cells=3
        ... )
        >>> map.verdict.tolist()[0]
        ['chaotic', 'chaotic', 'chaotic']
        >>> map.exponent.shape
        (3, 3)

    Parameters
    ----------
    problem : str, ConstrainedHamiltonian, PoissonSystem or InitialValueProblem
        Name in the catalogue, the path of a problem file, which is executed, a definition, or an initial value problem.
    method : str
        Name of a fixed-step method, for example "rattle" or "lobatto3/suzuki4".
    h : float
        Step size, s.
    t_end : float, optional
        Time of each run, s.
    steps : int, optional
        Number of steps, in place of ``t_end``.
    plane : mapping of str to (float, float) or None, optional
        Two coordinates with bounds, q1=-1:1,p2=-2:2, or without, q1,p2, for bounds about the start; by default the first two independent
        ones, see :func:`daebench.studies.chaos.plane.plane_of`.
    cells : int
        Number of cells along a side of the plane.
    energy : float or "case", optional
        Energy of all starts, or "case" for the energy of the case; by default it is not prescribed.
    section : mapping of str to float, optional
        A position and its value in all starts, where a Poincare section of some motions is taken: for problems of two degrees of
        freedom, with an energy.
    case : str, optional
        Named initial values, from which starts are sought; by default the problem's first.
    parameters, options : mapping of str to float, optional
        Parameters of the problem, and free numbers of the method.
    anyway : bool
        Whether a scheme may run on a structure matrix for which it is not a Poisson integrator.
    on_singular : str, optional
        What happens where G loses rank, see :func:`daebench.run`; by default what the case declares.
    seed : int
        Seed of the directions of the tangent vectors.
    threads : int, optional
        Number of cores; by default all.
    progress : callable, optional
        Called with the fraction done.
    **start : OwnStart
        A start of one's own in place of the case's: q0, p0, v0, y0 and project, as for :func:`daebench.initial_value_problem`.

    Returns
    -------
    Chaos

    Raises
    ------
    BadInput
        If the request cannot be met, the method has no fixed steps, there are too few steps, or no start is on the plane.
    """
    ivp = initial_value_problem(problem, case, parameters, on_singular=on_singular, **start)
    solver = fixed_step_method_of(ivp, method, options, anyway=anyway)
    grid = solver.grid(ivp, Request(value=positive("h", h), t_end=t_end, steps=steps, every=0, sensitivities=()))
    if grid.steps < FEWEST:
        raise BadInput(
            f"an exponent needs at least {FEWEST} steps, and {grid.steps} are requested; give a larger t_end.", "exponent-of-few-steps"
        )
    whole("seed", seed, 0)
    every = max(1, grid.steps // INTERVALS)
    cut = surface(ivp, section, plane, energy)
    starts = plane_of(ivp, plane, cells=cells, h=h, energy=energy, cut=cut)
    units = _units(starts.members)
    vectors = tangent_vectors(starts.members, units, seed)
    intervals = grid.steps // every
    growth = tangent_growth(solver, starts.members, vectors, units, every=every, intervals=intervals, threads=threads, progress=progress)
    crossings = section_of(solver, starts, cut, every * intervals, threads) if cut else None
    return Chaos(starts, solver.name, growth, every * intervals, seed, crossings)


def _units(members: Members) -> Array:
    """Return the factors of the entries of tangent vectors in their length, which makes numbers of them.

    It is one over the root mean square of the starts, and for momenta at least over that of mass times length times rate, as in
    :func:`daebench.runs.scales.constrained_scales`, since starts may be at rest.
    """
    sizes = [float(np.sqrt(np.mean(vector**2))) for vector in members.start]
    if members.ivp.on_manifold:
        length, rate = constrained_scales_of(members, rated=True)
        mass = np.max(np.abs(members.along("mass", *members.start)), axis=(1, 2))
        sizes[0] = max(sizes[0], float(np.median(mass * length * rate)))
    return np.repeat([1 / (size or 1.0) for size in sizes], [vector.shape[1] for vector in members.start])

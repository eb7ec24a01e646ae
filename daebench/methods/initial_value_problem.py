"""The one constructor of initial value problems: from a name, the path of a file, a definition, or an initial value problem."""

import os
from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any, Unpack, cast, overload

import numpy as np

from daebench.compiler.definition import source_in, source_of
from daebench.diagnostics.consistency import require_consistent
from daebench.diagnostics.freedom import require_freedom
from daebench.diagnostics.second_order import require_motion
from daebench.errors import BadInput, unknown
from daebench.methods.catalogue import find_problem, whole_structure
from daebench.methods.own_start import started
from daebench.runs.ivp import ConstrainedIvp, InitialValueProblem, Ivp
from daebench.runs.make_ivp import Start, first_case, make_ivp, require_constraints
from daebench.runs.own_start import BY_NAME, PROJECT, OwnStart, base, given, joined, read, written
from daebench.runs.request import ON_SINGULAR
from daebench.systems.files.read import Problem

if TYPE_CHECKING:
    from daebench.systems.constrained import ConstrainedHamiltonian
    from daebench.systems.poisson import PoissonSystem


@overload
def initial_value_problem(
    problem: "ConstrainedHamiltonian | ConstrainedIvp",
    case: str | None = None,
    parameters: Mapping[str, float] | None = None,
    *,
    algebra: str = "",
    on_singular: str | None = None,
    consistent: bool = True,
    **start: Unpack[OwnStart],
) -> ConstrainedIvp: ...
@overload
def initial_value_problem(
    problem: "str | os.PathLike[str] | ConstrainedHamiltonian | PoissonSystem | InitialValueProblem",
    case: str | None = None,
    parameters: Mapping[str, float] | None = None,
    *,
    algebra: str = "",
    on_singular: str | None = None,
    consistent: bool = True,
    **start: Unpack[OwnStart],
) -> Ivp: ...
def initial_value_problem(
    problem: "str | os.PathLike[str] | ConstrainedHamiltonian | PoissonSystem | InitialValueProblem",
    case: str | None = None,
    parameters: Mapping[str, float] | None = None,
    *,
    algebra: str = "",
    on_singular: str | None = None,
    consistent: bool = True,
    **start: Unpack[OwnStart],
) -> Ivp:
    """Return a problem of any kind with the parameters and initial values of a case.

    ::

        >>> ivp = initial_value_problem("planar_pendulum", "horizontal", {"gravity": 1.62})
        >>> ivp.q0.tolist(), ivp.parameters["gravity"]
        ([1.0, 0.0], 1.62)
        >>> initial_value_problem(ivp, q0=[0.0, -1.0]).parameters["gravity"]
        1.62

    Parameters
    ----------
    problem : str, PathLike, ConstrainedHamiltonian, PoissonSystem or InitialValueProblem
        Name in the catalogue, the path of a problem file, which is executed, a definition, or an initial value problem, whose case,
        parameters and initial values are kept unless others are given.
    case : str, optional
        Named parameters and initial values; by default the problem's first.
    parameters : mapping of str to float, optional
        Values of the problem's parameters.
    algebra : str
        Form of vectors: "values" or "arrays", for a chain of nodes; "" to choose by the problem's size.
    on_singular : str, optional
        What to do where G loses rank: "stop", "continue" or "least-squares"; by default what the case declares.
    consistent : bool
        Whether initial values off the manifold, or without any freedom there, are an error.
    **start : OwnStart
        Initial values in place of the case's, see :class:`daebench.runs.own_start.OwnStart`: positions ``q0``; momenta ``p0`` or velocities
        ``v0``; or the state ``y0`` of a Poisson system; with ``project`` moved to the nearest ones on the manifold.

    Returns
    -------
    InitialValueProblem
        The problem with its numbers. Its case is named with the start, as "horizontal[q0=0.6,-0.8;p0=0,0]", which is a case, too.

    Raises
    ------
    BadInput
        If a name or value is invalid, or constraints leave no freedom at the start.
    InconsistentStart
        If the initial values are off the manifold and ``project`` is false.
    """
    if case is not None:
        case, written_there = read(case)
        start = joined(written_there, start)
    if start.get("p0") is not None and start.get("v0") is not None:
        raise BadInput("p0 and v0 both give the velocities of the start; leave out one of them.", "p0-beside-v0")
    project, vectors = bool(start.get(PROJECT)), given(start)
    whole = {name: values for name, values in vectors.items() if name not in BY_NAME or not isinstance(values, Mapping)}
    begun = _singular_as(_unchecked(problem, case, parameters, whole, algebra), on_singular)
    ivp = started(begun, start)
    if vectors or not all(map(np.array_equal, begun.start, ivp.start)):
        # All numbers of an initial value problem, whose others need not be those of its case.
        if isinstance(problem, InitialValueProblem) and case is None:
            vectors = dict(zip(ivp.state.starts, ivp.start, strict=True))
        ivp = replace(ivp, case=written(base(ivp.case), vectors, project=project))
    if not (ivp.on_manifold and ivp.m):
        return ivp
    if consistent and not project:
        require_consistent(ivp)
    if project or consistent:
        require_freedom(ivp)
        require_motion(ivp)
    return ivp


def declared_ivps(problem: str, case: str | None = None, parameters: Mapping[str, float] | None = None) -> list[Ivp]:
    """Return the initial value problems of all cases of a problem, or of one, with these values of parameters, without checks."""
    file = find_problem(problem)
    if case is not None and read(case)[1]:
        return [initial_value_problem(problem, case, parameters, consistent=False)]
    first = _from_file(file, case, parameters, {}, "")
    return [first] if case is not None else [_from_file(file, name, parameters, {}, "") for name in first.facts.CASES]


def _unchecked(
    problem: "str | os.PathLike[str] | ConstrainedHamiltonian | PoissonSystem | InitialValueProblem",
    case: str | None,
    parameters: Mapping[str, float] | None,
    start: Start,
    algebra: str,
) -> Ivp:
    """Return an initial value problem whose initial values have not been checked for consistency."""
    if isinstance(problem, str | os.PathLike):
        file = find_problem(os.fspath(problem))
        ivp = _from_file(file, case, parameters, start, algebra)
        if not file.own:
            from daebench.diagnostics.problem.check import require_sound  # SymPy, which problems of daebench's own do without

            require_sound(ivp)
        return ivp
    if isinstance(problem, InitialValueProblem):
        if algebra:
            raise BadInput(
                f"the form of the vectors of {problem.problem} was chosen with the initial value problem; leave out algebra.",
                "algebra-chosen-before",
            )
        return _with_other_values(cast("Ivp", problem), case, parameters or {}, start)
    if not hasattr(problem, "fingerprint"):
        raise BadInput(
            f"a problem is a name, a ConstrainedHamiltonian or a PoissonSystem, or the path of a file, not {problem!r}.", "not-a-problem"
        )
    return make_ivp(source_of(problem, algebra=algebra), case, parameters, **start)


def _singular_as(ivp: Ivp, on_singular: str | None) -> Ivp:
    """Return an initial value problem with what to do where G loses rank; None keeps what it has."""
    if on_singular is None:
        return ivp
    if on_singular not in ON_SINGULAR:
        raise unknown("on_singular", on_singular, ON_SINGULAR)
    why = "which has no constraints that could lose rank; leave out on_singular"
    return replace(require_constraints(ivp, why), on_singular=on_singular)


def _from_file(file: Problem, case: str | None, parameters: Mapping[str, float] | None, start: Start, algebra: str) -> Ivp:
    """Return the initial value problem of a case of a problem file; structural parameters decide its source."""
    structure, others = whole_structure(file, parameters or {})
    source = source_in(file, structure, algebra)
    case = first_case(source, start) if case is None else case
    # A case may ask for another size, which only the facts of a definition of some size can say: it may take two sources to find out.
    of_case = source.facts.CASES.get(case, {"parameters": {}})["parameters"]
    declared = {name: int(value) for name, value in of_case.items() if name in file.structure and name not in structure}
    if declared:
        source = source_in(file, structure | declared, algebra)
    return make_ivp(source, case, others, **start)


def _with_other_values(ivp: Ivp, case: str | None, parameters: Mapping[str, float], start: Start) -> Ivp:
    """Return an initial value problem with another case, or with other parameters or initial values."""
    if case is not None:
        return make_ivp(ivp.source, case, parameters, **start)
    replaced: dict[str, Any] = {**dict(zip(ivp.state.starts, ivp.start, strict=True)), **start}
    moved = make_ivp(ivp.source, base(ivp.case), {**ivp.parameters, **parameters}, **replaced)
    return replace(ivp, parameters=moved.parameters).at(*moved.start)

"""What can be said of a definition before any number is put in: its parts are what they must be, and H and g have second derivatives."""

from collections.abc import Iterable
from typing import Any

import sympy as sp
from sympy.core.function import AppliedUndef

from daebench.errors import InvalidProblem
from daebench.systems.definition_parts import check_cases, check_coordinates, check_functions, check_parameters, check_real, several

Problem = Any
"""A ConstrainedHamiltonian. Its class calls these functions when it is made, so that its type cannot be imported here."""

KINKED: tuple[type, ...] = (
    sp.Abs,
    sp.sign,
    sp.Max,
    sp.Min,
    sp.Piecewise,
    sp.Heaviside,
    sp.DiracDelta,
    sp.floor,
    sp.ceiling,
    sp.frac,
    sp.Mod,
)
KINKED += (sp.re, sp.im, sp.arg, sp.conjugate)
"""Functions that have no second derivative somewhere, or of whose second derivative SymPy makes a distribution."""

OPEN: tuple[type, ...] = (sp.Derivative, sp.Subs, sp.Integral, sp.Sum, sp.Product, sp.Limit)
"""Operations that SymPy has not carried out."""


def check_parts(problem: Problem) -> None:
    """Accept a definition whose parts are of the right types; InvalidProblem names the part, and what it is instead."""
    for name, symbols in (("q", problem.q), ("p", problem.p)):
        check_coordinates(name, symbols)
    check_time_and_force(problem)
    check_parameters(problem.parameters)
    check_cases(problem.cases, "Case", ("q", "p"), problem.parameters)
    check_functions("integral", problem.integrals)
    check_real("g", several("g", problem.g))
    for name, expression in {"H": problem.H, "U": problem.U}.items():
        if expression is not None:
            check_real(name, [expression])
    if problem.M is not None:
        check_mass(problem.M)
    for name, kind in (("kinetic_flow", "KineticFlow"), ("chart", "Chart"), ("picture", "Picture")):
        given = getattr(problem, name)
        if given is not None and type(given).__name__ != kind:
            raise InvalidProblem(f"{name} is a {type(given).__name__}; it must be a {kind}, or be left out.")
    if problem.closed_form is not None and not callable(problem.closed_form):
        raise InvalidProblem(f"closed_form is a {type(problem.closed_form).__name__}; it must be a function, or be left out.")


def check_time_and_force(problem: Problem) -> None:
    """Accept a time, velocities and forces of the right types and sizes; InvalidProblem names the part."""
    check_coordinates("t", [] if problem.t is None else [problem.t])
    check_coordinates("v", problem.v or [])
    check_real("force", several("force", problem.force or []))
    for name, values in (("force", problem.force), ("v", problem.v)):
        if values is not None and len(values) != len(problem.q):
            raise InvalidProblem(f"{name} has {len(values)} entries, but there are {len(problem.q)} positions; give one for each.")


def check_mass(M: Any) -> None:
    """Accept a matrix of real expressions in which no position is without mass; InvalidProblem names the entry."""
    if not isinstance(M, sp.MatrixBase):
        raise InvalidProblem(f"the mass matrix M must be a SymPy Matrix, and is a {type(M).__name__}.")
    check_real("M", list(M))
    for k in range(min(M.shape)):
        if not any(M.row(k)):
            why = f"row {k + 1} is 0, so that position {k + 1} has no mass"
            raise InvalidProblem(f"the mass matrix M is singular: {why}; give it one, or take its momentum out with another choice of q.")


def check_second_derivatives(problem: Problem) -> None:
    """Accept a definition whose H, or M and U, and g are made of functions that are twice differentiable."""
    state = {*problem.q, *problem.p, problem.t, *(problem.v or ())}
    parts = {f"g[{k}]": constraint for k, constraint in enumerate(problem.g)} | {"M": problem.M, "H": problem.H, "U": problem.U}
    parts |= {f"force[{k}]": force for k, force in enumerate(problem.force or ())}
    parts |= {f"integral {name}": integral for name, integral in problem.integrals.items()}
    for name, expression in parts.items():
        if expression is not None:
            check_smooth(name, expression, state)


def check_smooth(name: str, expression: Any, state: Iterable[sp.Symbol]) -> None:
    """Accept an expression of known functions that are twice differentiable in the state; InvalidProblem names any other function."""
    functions = sp.sympify(expression).atoms(AppliedUndef, *OPEN, *KINKED)
    for function in sorted(functions, key=lambda one: (one.count_ops(), str(one))):
        if isinstance(function, AppliedUndef):
            raise InvalidProblem(f"{name} contains {function}, a function that is not defined; write out what it is.")
        if isinstance(function, OPEN):
            raise InvalidProblem(f"{name} contains {function}, which SymPy has not carried out; call doit(), or write out its value.")
        if function.free_symbols & set(state):
            raise InvalidProblem(
                f"{name} contains {function}, which is not twice differentiable; write {name} with smooth functions alone."
            )


def strange(where: str, extra: Iterable[sp.Symbol], known: Iterable[sp.Symbol]) -> InvalidProblem:
    """Return the error for symbols that an expression may not depend on; one may have the name of a declared one, and not be it."""
    if same := {str(symbol) for symbol in set(extra) - set(known)} & {str(symbol) for symbol in known}:
        names = ", ".join(sorted(same))
        return InvalidProblem(
            f"{where} contains {names} with other assumptions than those declared; use one and the same symbol throughout."
        )
    names, remedy = ", ".join(sorted(map(str, extra))), "declare it"
    if {str(symbol) for symbol in extra} <= {"t", "time"}:
        remedy = "declare the time with t="
    elif where == "force":
        remedy = "a force is a function of q, v or p, t and parameters, and not of multipliers, as dry friction is"
    return InvalidProblem(f"{where} contains {names}, which it may not depend on; {remedy}.")

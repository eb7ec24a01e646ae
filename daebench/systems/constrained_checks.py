"""Checks of a definition before numbers are inserted: types and sizes of its parts, and existence of second derivatives of H and g."""

from collections.abc import Iterable
from typing import Any

import sympy as sp
from sympy.core.function import AppliedUndef

from daebench.errors import InvalidProblem
from daebench.systems.definition_parts import check_cases, check_coordinates, check_functions, check_parameters, check_real, several

Problem = Any
"""A ConstrainedHamiltonian. Its class calls these functions when it is constructed, so its type cannot be imported here."""

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
"""Functions without a second derivative at some point, or whose second derivative is a distribution in SymPy."""

OPEN: tuple[type, ...] = (sp.Derivative, sp.Subs, sp.Integral, sp.Sum, sp.Product, sp.Limit)
"""Operations that SymPy leaves unevaluated."""


def check_parts(problem: Problem) -> None:
    """Check that the parts of a definition are of the right types; InvalidProblem names the part, and its type."""
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
        # By name, because the classes import this file.
        if given is not None and type(given).__name__ != kind:
            raise InvalidProblem(f"{name} is a {type(given).__name__}; it must be a {kind}, or be left out.", "part-of-wrong-type")
    if problem.closed_form is not None and not callable(problem.closed_form):
        raise InvalidProblem(
            f"closed_form is a {type(problem.closed_form).__name__}; it must be a function, or be left out.", "closed-form-not-function"
        )


def check_time_and_force(problem: Problem) -> None:
    """Check that time, velocities and forces are of the right types and sizes; InvalidProblem names the part."""
    check_coordinates("t", [] if problem.t is None else [problem.t])
    check_coordinates("v", problem.v or [])
    check_real("force", several("force", problem.force or []))
    check_real("velocity", several("velocity", problem.velocity))
    if len(problem.velocity) and not problem.v:
        raise InvalidProblem(
            "velocity has constraints on velocities, but v does not name these; give v=, one symbol for each position.",
            "velocity-without-v",
        )
    for name, values in (("force", problem.force), ("v", problem.v)):
        if values is not None and len(values) != len(problem.q):
            raise InvalidProblem(
                f"{name} has {len(values)} entries, but there are {len(problem.q)} positions; give one for each.",
                "entries-not-per-position",
            )


def check_mass(M: Any) -> None:
    """Check that a mass matrix has real entries and that every position has mass; InvalidProblem names the entry."""
    if not isinstance(M, sp.MatrixBase):
        raise InvalidProblem(f"the mass matrix M must be a SymPy Matrix, but is a {type(M).__name__}.", "mass-matrix-type")
    check_real("M", list(M))
    for k in range(min(M.shape)):
        # A row of zeros is found here without numbers; all other singular matrices are left to the check of the start.
        if not any(M.row(k)):
            why = f"row {k + 1} is 0, so that position {k + 1} has no mass"
            raise InvalidProblem(
                f"the mass matrix M is singular: {why}; give it one, or eliminate it by another choice of q.", "mass-matrix-singular"
            )


def check_second_derivatives(problem: Problem) -> None:
    """Check that H, or M and U, and g are made of functions that are twice differentiable."""
    state = {*problem.q, *problem.p, problem.t, *(problem.v or ())}
    words = [f" ({what})" for what in problem.parts.constraints] if problem.parts else [""] * len(problem.g)
    parts = {f"g[{k}]{words[k]}": constraint for k, constraint in enumerate(problem.g)} | {"M": problem.M, "H": problem.H, "U": problem.U}
    parts |= {f"velocity[{k}]": constraint for k, constraint in enumerate(problem.velocity)}
    parts |= {f"force[{k}]": force for k, force in enumerate(problem.force or ())}
    parts |= {f"integral {name}": integral for name, integral in problem.integrals.items()}
    for name, expression in parts.items():
        if expression is not None:
            check_smooth(name, expression, state)


def check_smooth(name: str, expression: Any, state: Iterable[sp.Symbol]) -> None:
    """Check that an expression consists of known functions that are twice differentiable in the state; InvalidProblem names any other."""
    functions = sp.sympify(expression).atoms(AppliedUndef, *OPEN, *KINKED)
    if name.startswith("g[") and (rates := [function for function in functions if isinstance(function, sp.Derivative)]):
        raise nonholonomic(rates)
    # Sorted, so that the message names the same function in every process: the order of a set changes.
    for function in sorted(functions, key=lambda function: (function.count_ops(), str(function))):
        if isinstance(function, AppliedUndef):
            raise InvalidProblem(
                f"{name} contains {function}, a function that is not defined; write out its definition.", "function-undefined"
            )
        if isinstance(function, OPEN):
            raise InvalidProblem(
                f"{name} contains {function}, which SymPy has left unevaluated; call doit(), or write out its value.",
                "function-unevaluated",
            )
        if function.free_symbols & set(state):
            raise InvalidProblem(
                f"{name} contains {function}, which is not twice differentiable; write {name} with smooth functions only.",
                "function-not-differentiable",
            )


def nonholonomic(symbols: Iterable[Any]) -> InvalidProblem:
    """Return the error for constraints on positions that contain velocities or momenta."""
    names = ", ".join(sorted(map(str, symbols)))
    return InvalidProblem(
        f"g contains {names}; give a constraint on velocities (nonholonomic) as velocity=[...] with v=..., and leave out the derivative of "
        "a constraint on positions: G q' = 0 follows from g = 0.",
        "velocity-in-constraint",
    )


def check_linear(problem: Problem) -> None:
    """Check that constraints on velocities are linear or affine in them, and contain them; InvalidProblem names any other."""
    v = list(problem.v or ())
    for k, row in enumerate(problem.velocity):
        rates = [sp.diff(row, symbol) for symbol in v]
        # Simplified only where there is a doubt, which may take minutes.
        if any(rate.free_symbols & {*v} and sp.simplify(rate).free_symbols & {*v} for rate in rates):
            raise InvalidProblem(
                f"velocity[{k}] is {row}, which is not linear in the velocities; only A(q, t) v + a(q, t) is supported.",
                "velocity-not-linear",
            )
        if not any(rates):
            remedy = "give a constraint on positions in g" if row else "leave it out"
            raise InvalidProblem(f"velocity[{k}] is {row}, which contains no velocity; {remedy}.", "velocity-absent")


def strange(where: str, extra: Iterable[sp.Symbol], known: Iterable[sp.Symbol]) -> InvalidProblem:
    """Return the error for symbols that an expression may not contain; one may differ from a declared symbol in its assumptions only."""
    if same := {str(symbol) for symbol in set(extra) - set(known)} & {str(symbol) for symbol in known}:
        names = ", ".join(sorted(same))
        return InvalidProblem(
            f"{where} contains {names} with other assumptions than those declared; use one and the same symbol throughout.",
            "symbol-assumptions-differ",
        )
    names, remedy = ", ".join(sorted(map(str, extra))), "declare it"
    if {str(symbol) for symbol in extra} <= {"t", "time"}:
        remedy = "declare the time with t="
    elif where == "g":
        remedy = "declare it as a parameter; if it is a velocity, give the constraint as velocity=[...], and name velocities by v="
    elif where == "velocity" and {*extra} & {*known}:
        remedy = "a constraint on velocities is a function of v, q, t and parameters; write momenta as velocities, p = M v"
    elif where == "force":
        remedy = "a force is a function of q, v or p, t and parameters, and not of multipliers, as dry friction is"
    return InvalidProblem(f"{where} contains {names}, which it may not depend on; {remedy}.", "symbol-undeclared")

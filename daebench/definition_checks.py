"""What can be said of a definition before any number is put in: its parts are what they must be, and H and g have second derivatives."""

from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import sympy as sp
from sympy.core.function import AppliedUndef

from daebench.errors import InvalidProblem

if TYPE_CHECKING:
    from daebench.problem import ConstrainedHamiltonian

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


def check_parts(problem: "ConstrainedHamiltonian") -> None:
    """Accept a definition whose parts are of the types that they must be.

    Raises
    ------
    InvalidProblem
        Naming the part, and what it is instead.
    """
    for name, symbols in (("q", problem.q), ("p", problem.p), ("the parameters", problem.parameters)):
        for each in _several(name, symbols):
            if not isinstance(each, sp.Symbol):
                raise InvalidProblem(f"{name} contains {each!r}, which is no SymPy Symbol.")
    if problem.M is not None and not isinstance(problem.M, sp.MatrixBase):
        raise InvalidProblem(f"the mass matrix M must be a SymPy Matrix, and is a {type(problem.M).__name__}.")
    check_real("g", _several("g", problem.g))
    for name, expression in _scalars(problem).items():
        check_real(name, [expression])
    _check_cases(problem.cases)


def _check_cases(cases: Mapping[str, Any]) -> None:
    for name, case in cases.items():
        if type(case).__name__ != "Case":
            raise InvalidProblem(f"case {name!r} is a {type(case).__name__}; it must be a Case(q=..., p=...).")
        for part, values in (("q", case.q), ("p", case.p)):
            check_real(f"{part} of case {name!r}", _several(f"{part} of case {name!r}", values))


def check_second_derivatives(problem: "ConstrainedHamiltonian") -> None:
    """Accept a definition whose H, or M and U, and g are made of functions that are twice differentiable.

    Raises
    ------
    InvalidProblem
        Naming the function and where it is.
    """
    state = {*problem.q, *problem.p}
    parts = {f"g[{k}]": each for k, each in enumerate(problem.g)} | {"M": problem.M} | _scalars(problem)
    for name, expression in parts.items():
        if expression is not None:
            check_smooth(name, expression, state)


def check_smooth(name: str, expression: Any, state: Iterable[sp.Symbol]) -> None:
    """Accept an expression of functions that are twice differentiable in the state, and known.

    Raises
    ------
    InvalidProblem
        Naming the function and where it is.
    """
    found = sp.sympify(expression).atoms(AppliedUndef, *OPEN, *KINKED)
    for each in sorted(found, key=lambda one: (one.count_ops(), str(one))):
        if isinstance(each, AppliedUndef):
            raise InvalidProblem(f"{name} contains {each}, a function that is not defined; write out what it is.")
        if isinstance(each, OPEN):
            raise InvalidProblem(f"{name} contains {each}, which SymPy has not carried out; call doit(), or write out its value.")
        if each.free_symbols & set(state):
            raise InvalidProblem(f"{name} contains {each}, which is not twice differentiable; write {name} with smooth functions alone.")


def check_real(name: str, values: Sequence[Any]) -> None:
    """Accept expressions that may be real numbers.

    Raises
    ------
    InvalidProblem
        Naming what is an equation, no expression, or has an imaginary unit, infinity or NaN in it.
    """
    for k, value in enumerate(values):
        where = f"{name}[{k}]" if len(values) > 1 else name
        try:
            expression = sp.sympify(value)
        except (sp.SympifyError, TypeError, SyntaxError) as error:
            raise InvalidProblem(f"{where} is {value!r}, which is no number or expression.") from error
        if isinstance(expression, sp.Equality):
            raise InvalidProblem(f"{where} is the equation {expression}; give the difference of its sides, which is to vanish.")
        if not isinstance(expression, sp.Expr):
            raise InvalidProblem(f"{where} is {value!r}, which is no number or expression.")
        if expression.has(sp.I, sp.nan, sp.zoo, sp.oo, -sp.oo):
            raise InvalidProblem(f"{where} is not a real number everywhere: it contains an imaginary unit, infinity or NaN.")


def strange(where: str, extra: Iterable[sp.Symbol], known: Iterable[sp.Symbol]) -> InvalidProblem:
    """Return the error for symbols that an expression may not depend on; one may have the name of a declared one, and not be it."""
    if same := {str(symbol) for symbol in set(extra) - set(known)} & {str(symbol) for symbol in known}:
        names = ", ".join(sorted(same))
        return InvalidProblem(
            f"{where} contains {names} with other assumptions than those declared; use one and the same symbol throughout."
        )
    return InvalidProblem(f"{where} contains {', '.join(sorted(map(str, extra)))}, which it may not depend on; declare it.")


def _scalars(problem: "ConstrainedHamiltonian") -> dict[str, Any]:
    """Return what must be one expression each, by name."""
    integrals: Mapping[str, Any] = {f"integral {name}": each for name, each in problem.integrals.items()}
    return {name: each for name, each in {"H": problem.H, "U": problem.U, **integrals}.items() if each is not None}


def _several(name: str, values: Any) -> list[Any]:
    try:
        return list(values)
    except TypeError:
        raise InvalidProblem(f"{name} is {values!r}, and must be a sequence; write [{values!r}].") from None

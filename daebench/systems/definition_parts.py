"""Checks of the parts that definitions of every kind have: symbols, parameters and their values, named cases, and real expressions."""

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import sympy as sp

from daebench.errors import BadInput, InvalidProblem, real

DEEPEST = 100
"""Maximum nesting depth of operations in an expression: SymPy recurses several times for each level."""

LARGEST = 100_000
"""Maximum number of operations of a written-out expression: for more, SymPy takes minutes to differentiate it."""

LONGEST = 100
"""Maximum length of the name of a case, an integral or a part."""

ON_SINGULAR = ("stop", "continue", "least-squares")


def check_coordinates(name: str, symbols: Any) -> None:
    """Check that all entries of a sequence are symbols; InvalidProblem names any other entry. ``assumptions`` checks their assumptions."""
    for entry in several(name, symbols):
        if not isinstance(entry, sp.Symbol):
            raise InvalidProblem(f"{name} contains {entry!r}, which is not a SymPy Symbol.", "not-a-symbol")


def check_parameters(parameters: Any) -> None:
    """Check a mapping of symbols to numbers; InvalidProblem names a parameter whose value is not a number."""
    if not isinstance(parameters, Mapping):
        raise InvalidProblem(
            f"the parameters are {parameters!r}; they must be a mapping of symbols to numbers.", "parameters-not-a-mapping"
        )
    check_coordinates("the parameters", parameters)
    for symbol, value in parameters.items():
        _require_number(f"the parameter {symbol}", value, "give a number, and use its name for nothing else in the file")


def check_distinct(symbols: Iterable[sp.Symbol], what: str) -> None:
    """Check that symbols have different names, which tables and generated code use; InvalidProblem names those used twice."""
    names = [str(symbol) for symbol in symbols]
    if twice := {name for name in names if names.count(name) > 1}:
        raise InvalidProblem(f"{', '.join(sorted(twice))} stands for more than one {what}; rename one.", "name-stands-for-two")


def check_cases(cases: Any, kind: str, states: Sequence[str], parameters: Mapping[sp.Symbol, float]) -> None:
    """Check named cases of the class ``kind`` and the types of their parts; ``states`` are the parts with initial values.

    A number that a case sets belongs to one of the parameters. A whole number may belong to a structural parameter, which only the file
    knows. InvalidProblem names the case and the part.
    """
    if not isinstance(cases, Mapping):
        raise InvalidProblem(f"the cases are {cases!r}; they must be a mapping of names to {kind}(...).", "cases-not-a-mapping")
    for name, case in cases.items():
        _require_name("a case", name)
        if type(case).__name__ != kind:
            arguments = ", ".join(f"{state}=..." for state in states)
            raise InvalidProblem(f"case {name!r} is a {type(case).__name__}; it must be a {kind}({arguments}).", "case-of-wrong-type")
        for state in states:
            check_real(f"{state} of case {name!r}", several(f"{state} of case {name!r}", getattr(case, state)))
        _check_settings(name, case, {str(symbol) for symbol in parameters})


def _check_settings(name: str, case: Any, parameters: set[str]) -> None:
    """Check the parts of a case other than initial values."""
    if not isinstance(case.parameters, Mapping):
        raise InvalidProblem(
            f"the parameters of case {name!r} are {case.parameters!r}; they must be a mapping of names to numbers.",
            "case-settings-not-a-mapping",
        )
    for parameter, value in case.parameters.items():
        if not isinstance(parameter, str):
            raise InvalidProblem(
                f"case {name!r} sets {parameter!r}, which is not text; give the parameter's name as text.", "case-parameter-not-text"
            )
        _require_number(f"{parameter} of case {name!r}", value, "give a number")
    if foreign := {key for key, value in case.parameters.items() if key not in parameters and not isinstance(value, int)}:
        raise InvalidProblem(
            f"case {name!r} sets {', '.join(sorted(foreign))}, which is not a parameter of the problem.", "case-sets-no-parameter"
        )
    if not isinstance(case.about, str):
        raise InvalidProblem(f"about of case {name!r} is {case.about!r}, which is not text.", "case-about-not-text")
    if getattr(case, "on_singular", "stop") not in ON_SINGULAR:
        raise InvalidProblem(
            f"on_singular of case {name!r} is {case.on_singular!r}; it must be {', '.join(ON_SINGULAR)}.", "case-on-singular-unknown"
        )


def check_functions(what: str, functions: Any) -> None:
    """Check a mapping of names to real expressions; InvalidProblem names the wrong mapping, name or expression."""
    if not isinstance(functions, Mapping):
        raise InvalidProblem(f"{what}s are {functions!r}; they must be a mapping of names to expressions.", "functions-not-a-mapping")
    for name, expression in functions.items():
        _require_name(what, name)
        check_real(f"{what} {name}", [expression])


def check_real(name: str, values: Sequence[Any]) -> None:
    """Check that expressions can be real numbers, and are small enough to differentiate.

    InvalidProblem names an equation, a value that is not an expression, or one with an imaginary unit, infinity or NaN.
    """
    for k, value in enumerate(values):
        where = f"{name}[{k}]" if len(values) > 1 else name
        try:
            expression = sp.sympify(value)
        except (sp.SympifyError, TypeError, SyntaxError, AttributeError, ValueError, RecursionError) as error:
            raise InvalidProblem(f"{where} is {value!r}, which is not a number or an expression.", "not-an-expression") from error
        if isinstance(expression, sp.Equality):
            raise InvalidProblem(f"{where} is the equation {expression}; give the difference of its sides.", "equation-for-expression")
        if getattr(expression, "is_Matrix", False):
            raise InvalidProblem(
                f"{where} is a matrix, but must be a single expression; give its entries one by one.", "matrix-for-expression"
            )
        if not isinstance(expression, sp.Expr):
            raise InvalidProblem(f"{where} is {value!r}, which is not a number or an expression.", "not-an-expression")
        check_size(where, expression)
        if expression.has(sp.I, sp.nan, sp.zoo, sp.oo, -sp.oo):
            raise InvalidProblem(
                f"{where} is not a real number everywhere: it contains an imaginary unit, infinity or NaN.", "not-real-everywhere"
            )
        if expression.is_commutative is False:
            raise InvalidProblem(f"{where} contains symbols that do not commute; real numbers do.", "symbols-do-not-commute")


def check_size(name: str, expression: sp.Basic) -> None:
    """Check that an expression is not too large, or too deep, for its derivatives to be written."""
    size, depth = extent(expression)
    if depth > DEEPEST:
        raise InvalidProblem(
            f"{name} has operations nested {depth} deep, but at most {DEEPEST} can be differentiated; write it flatter.",
            "expression-too-deep",
        )
    if size > LARGEST:
        raise InvalidProblem(
            f"{name} has {size:.3g} operations written out, but at most {LARGEST} can be differentiated; shorten it.", "expression-too-long"
        )


def extent(expression: sp.Basic) -> tuple[int, int]:
    """Return the number of nodes of a written-out expression, and its depth; shared subexpressions are visited once."""
    known: dict[int, tuple[int, int]] = {}
    arguments: dict[int, tuple[sp.Basic, ...]] = {}  # kept alive, so that no other object gets an id that is in use here
    # A stack of its own: what is checked here may be nested deeper than Python can recurse.
    stack = [expression]
    while stack:
        node = stack[-1]
        below = arguments.setdefault(id(node), node.args)
        if missing := [argument for argument in below if id(argument) not in known]:
            stack += missing
            continue
        parts = [known[id(argument)] for argument in below]
        known[id(node)] = 1 + sum(size for size, _ in parts), 1 + max((depth for _, depth in parts), default=0)
        stack.pop()
    return known[id(expression)]


def several(name: str, values: Any) -> list[Any]:
    """Return values as a list; refuse anything that is not a sequence."""
    if isinstance(values, str) or not hasattr(values, "__len__"):
        raise InvalidProblem(f"{name} is {values!r}, but must be a sequence; write [{values!r}].", "not-a-sequence")
    return list(values)


def _require_name(what: str, name: Any) -> None:
    if not isinstance(name, str) or not name.strip() or not name.isprintable() or len(name) > LONGEST:
        raise InvalidProblem(
            f"{what} has the name {name!r}; a name must be text that can be printed, of at most {LONGEST} characters.", "name-not-printable"
        )


def _require_number(what: str, value: Any, remedy: str) -> None:
    try:
        real(what, value)
    except BadInput as error:
        raise InvalidProblem(f"{what} has the value {value!r}, which is not a finite number; {remedy}.", "value-not-finite") from error

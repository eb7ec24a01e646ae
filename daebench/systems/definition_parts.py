"""What the parts of a definition must be, whatever its kind: symbols, parameters and their values, named cases, and real expressions."""

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import sympy as sp

from daebench.errors import BadInput, InvalidProblem, real

DEEPEST = 100
"""Most operations within each other in an expression: SymPy calls itself several times for each."""

LARGEST = 100_000
"""Most operations of an expression as it is written out: SymPy takes minutes for its derivatives."""

LONGEST = 100
"""Most characters of the name of a case, an integral or a part."""

ON_SINGULAR = ("stop", "continue", "least-squares")


def check_coordinates(name: str, symbols: Any) -> None:
    """Accept a sequence of symbols; InvalidProblem names any other entry. Their assumptions are checked in ``assumptions``."""
    for entry in several(name, symbols):
        if not isinstance(entry, sp.Symbol):
            raise InvalidProblem(f"{name} contains {entry!r}, which is not a SymPy Symbol.")


def check_parameters(parameters: Any) -> None:
    """Accept a mapping of symbols to numbers; InvalidProblem names the parameter whose value is not a number."""
    if not isinstance(parameters, Mapping):
        raise InvalidProblem(f"the parameters are {parameters!r}; they must be a mapping of symbols to numbers.")
    check_coordinates("the parameters", parameters)
    for symbol, value in parameters.items():
        _require_number(f"the parameter {symbol}", value, "give a number, and let nothing else in the file have its name")


def check_distinct(symbols: Iterable[sp.Symbol], what: str) -> None:
    """Accept symbols of different names, by which tables and generated code know them; InvalidProblem names those used twice."""
    names = [str(symbol) for symbol in symbols]
    if twice := {name for name in names if names.count(name) > 1}:
        raise InvalidProblem(f"{', '.join(sorted(twice))} stands for more than one {what}; rename one.")


def check_cases(cases: Any, kind: str, states: Sequence[str], parameters: Mapping[sp.Symbol, float]) -> None:
    """Accept named cases of the class ``kind`` whose parts are of the right types; ``states`` are those that are initial values.

    A number that a case sets belongs to one of the parameters; a whole number may belong to a structural parameter, which only the file
    knows. InvalidProblem names the case and the part.
    """
    if not isinstance(cases, Mapping):
        raise InvalidProblem(f"the cases are {cases!r}; they must be a mapping of names to {kind}(...).")
    for name, case in cases.items():
        _require_name("a case", name)
        if type(case).__name__ != kind:
            arguments = ", ".join(f"{state}=..." for state in states)
            raise InvalidProblem(f"case {name!r} is a {type(case).__name__}; it must be a {kind}({arguments}).")
        for state in states:
            check_real(f"{state} of case {name!r}", several(f"{state} of case {name!r}", getattr(case, state)))
        _check_settings(name, case, {str(symbol) for symbol in parameters})


def _check_settings(name: str, case: Any, parameters: set[str]) -> None:
    """Accept what a case has beside initial values."""
    if not isinstance(case.parameters, Mapping):
        raise InvalidProblem(f"the parameters of case {name!r} are {case.parameters!r}; they must be a mapping of names to numbers.")
    for parameter, value in case.parameters.items():
        if not isinstance(parameter, str):
            raise InvalidProblem(f"case {name!r} sets {parameter!r}, which is not text; give the parameter's name as text.")
        _require_number(f"{parameter} of case {name!r}", value, "give a number")
    if foreign := {key for key, value in case.parameters.items() if key not in parameters and not isinstance(value, int)}:
        raise InvalidProblem(f"case {name!r} sets {', '.join(sorted(foreign))}, which is not a parameter of the problem.")
    if not isinstance(case.about, str):
        raise InvalidProblem(f"about of case {name!r} is {case.about!r}, which is not text.")
    if getattr(case, "on_singular", "stop") not in ON_SINGULAR:
        raise InvalidProblem(f"on_singular of case {name!r} is {case.on_singular!r}; it must be {', '.join(ON_SINGULAR)}.")


def check_functions(what: str, functions: Any) -> None:
    """Accept a mapping of names to real expressions; InvalidProblem names the mapping, name or expression that is not one."""
    if not isinstance(functions, Mapping):
        raise InvalidProblem(f"{what}s are {functions!r}; they must be a mapping of names to expressions.")
    for name, expression in functions.items():
        _require_name(what, name)
        check_real(f"{what} {name}", [expression])


def check_real(name: str, values: Sequence[Any]) -> None:
    """Accept expressions that may be real numbers, of a size that can be derived.

    InvalidProblem names an equation, a value that is not an expression, and one with an imaginary unit, infinity or NaN.
    """
    for k, value in enumerate(values):
        where = f"{name}[{k}]" if len(values) > 1 else name
        try:
            expression = sp.sympify(value)
        except (sp.SympifyError, TypeError, SyntaxError, AttributeError, ValueError, RecursionError) as error:
            raise InvalidProblem(f"{where} is {value!r}, which is not a number or an expression.") from error
        if isinstance(expression, sp.Equality):
            raise InvalidProblem(f"{where} is the equation {expression}; give the difference of its sides.")
        if getattr(expression, "is_Matrix", False):
            raise InvalidProblem(f"{where} is a matrix, but must be a single expression; give its entries one by one.")
        if not isinstance(expression, sp.Expr):
            raise InvalidProblem(f"{where} is {value!r}, which is not a number or an expression.")
        check_size(where, expression)
        if expression.has(sp.I, sp.nan, sp.zoo, sp.oo, -sp.oo):
            raise InvalidProblem(f"{where} is not a real number everywhere: it contains an imaginary unit, infinity or NaN.")
        if expression.is_commutative is False:
            raise InvalidProblem(f"{where} contains symbols that do not commute; real numbers do.")


def check_size(name: str, expression: sp.Basic) -> None:
    """Accept an expression that is not so large, or so deep, that its derivatives cannot be written."""
    size, depth = extent(expression)
    if depth > DEEPEST:
        raise InvalidProblem(f"{name} has {depth} operations within each other, and at most {DEEPEST} can be derived; write it flatter.")
    if size > LARGEST:
        raise InvalidProblem(f"{name} has {size:.3g} operations written out, and at most {LARGEST} can be derived; write it shorter.")


def extent(expression: sp.Basic) -> tuple[int, int]:
    """Return how many nodes an expression has as it is written out, and how deep it is; what is shared is looked at once."""
    known: dict[int, tuple[int, int]] = {}
    arguments: dict[int, tuple[sp.Basic, ...]] = {}  # held, so that no other object takes the place of one of them
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
    """Return values as a list; refuse what is not a sequence."""
    if isinstance(values, str) or not hasattr(values, "__len__"):
        raise InvalidProblem(f"{name} is {values!r}, and must be a sequence; write [{values!r}].")
    return list(values)


def _require_name(what: str, name: Any) -> None:
    if not isinstance(name, str) or not name.strip() or not name.isprintable() or len(name) > LONGEST:
        raise InvalidProblem(f"{what} has the name {name!r}; a name must be text that can be printed, of at most {LONGEST} characters.")


def _require_number(what: str, value: Any, remedy: str) -> None:
    try:
        real(what, value)
    except BadInput as error:
        raise InvalidProblem(f"{what} has the value {value!r}, which is not a finite number; {remedy}.") from error

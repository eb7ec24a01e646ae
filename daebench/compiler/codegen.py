"""SymPy expressions as source text: straight-line functions on tuples, with common subexpressions shared."""

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager

import sympy as sp
from sympy.codegen.cfunctions import expm1, log1p
from sympy.printing.codeprinter import PrintMethodNotImplementedError
from sympy.printing.numpy import NumPyPrinter

from daebench.compiler.expressions import Expressions, Symbols, parts, rebuilt, replaced
from daebench.compiler.syntax import Lines, function, pack
from daebench.errors import InvalidProblem
from daebench.systems.definition_parts import extent


class _Printer(NumPyPrinter):  # type: ignore[misc]
    """Printer for float and complex scalars alike: integer powers become products, integers become floats."""

    def __init__(self) -> None:
        super().__init__({"fully_qualified_modules": False, "allow_unknown_functions": False})

    def _print_Integer(self, expr: sp.Integer) -> str:
        return f"{int(expr)}.0"

    def _print_Rational(self, expr: sp.Rational) -> str:
        return repr(float(expr)) if expr > 0 else f"({float(expr)!r})"

    def _print_Float(self, expr: sp.Float) -> str:
        return repr(float(expr))

    _print_NumberSymbol = _print_Pi = _print_Float

    def _print_Pow(self, expr: sp.Pow, rational: bool = False) -> str:
        base, exponent = expr.as_base_exp()
        if exponent.is_Integer and 2 <= abs(exponent) <= 8:
            product = "*".join([self.parenthesize(base, 55)] * abs(int(exponent)))
            return f"({product})" if exponent > 0 else f"(1.0/({product}))"
        if exponent == -1:
            return f"(1.0/({self._print(base)}))"
        return str(super()._print_Pow(expr, rational=rational))


Arguments = Mapping[str, Symbols]
"""Symbols of the arguments of a function, by their names."""


def _private(argument: str, i: int, symbol: sp.Symbol) -> sp.Symbol:
    """Return the name of an argument's entry in the source; no name chosen by a user can equal it."""
    return sp.Symbol(f"{argument}_{i}", **symbol.assumptions0)


ROUNDED = sp.Rational(1, 2**53)
"""Tolerance of the test for 1: numbers closer to 1 than this are 1 in double precision."""


def _near_one(part: sp.Expr) -> sp.Expr:
    """Return log(1 + x) and exp(x) - 1 as functions of their own, which are accurate for small x; any other part as it is."""
    if part.func is sp.log and part.args[0].is_Add and abs(part.args[0].as_coeff_Add()[0] - 1) < ROUNDED:
        return log1p(part.args[0] - 1)
    if part.is_Add and sp.S.NegativeOne in part.args and (powers := [term for term in part.args if term.func is sp.exp]):
        return part - powers[0] + 1 + expm1(powers[0].args[0])
    return part


LONG = 10**6
"""Nodes, written out, from which on terms keep the order that they have: SymPy takes minutes to put them into its own."""


UNPRINTED: tuple[type[Exception], ...] = (NotImplementedError, PrintMethodNotImplementedError, TypeError, ValueError, KeyError)
UNPRINTED += (AttributeError, OverflowError, RecursionError)
"""Exceptions that SymPy raises if it cannot print an expression."""


@contextmanager
def printable(name: str, printer: _Printer) -> Iterator[None]:
    """Turn any failure to print an expression into an InvalidProblem that names the function."""
    try:
        yield
    except UNPRINTED as error:
        raise InvalidProblem(
            f"{name} cannot be written as a numerical function: {_first_line(error)}.", "not-a-numerical-function"
        ) from error
    if strangers := sorted(part for module, parts in printer.module_imports.items() if module != "numpy" for part in parts):
        raise InvalidProblem(
            f"{name} contains {', '.join(strangers)}, which NumPy does not have; write {name} with functions of NumPy.",
            "function-not-in-numpy",
        )


def _first_line(error: BaseException) -> str:
    """Return the first line of an error, without the class of our printer."""
    text = (str(error) or type(error).__name__).splitlines()[0].rstrip(".")
    return text.replace(f"Unsupported by {_Printer}: ", "it contains the function ")


def shaped(items: Sequence[str], shape: tuple[int, ...]) -> str:
    """Return the source of a scalar, a tuple, or a tuple of rows, according to the shape."""
    if shape == ():
        return items[0]
    if len(shape) == 1:
        return pack(items)
    return pack(pack(items[row * shape[1] : (row + 1) * shape[1]]) for row in range(shape[0]))


def _straight_line(
    name: str, values: Expressions, private: Mapping[sp.Symbol, sp.Symbol], sources: Mapping[sp.Symbol, str]
) -> tuple[Lines, Lines]:
    """Return lines for the common subexpressions of values, given each symbol's private name and source; and the sources of the values."""
    whole = rebuilt(replaced([sp.sympify(value) for value in values], private), _near_one)
    order = "canonical" if sum(extent(value)[0] for value in whole) < LONG else "none"
    shared, reduced = sp.cse(whole, symbols=sp.numbered_symbols("t_"), list=True, order=order)
    used = set().union(*(value.free_symbols for value in [*reduced, *(value for _, value in shared)]))
    printer = _Printer()
    load = [f"{private[symbol]} = {source}" for symbol, source in sources.items() if private[symbol] in used]
    with printable(name, printer):
        lines = [f"{symbol} = {printer.doprint(value)}" for symbol, value in shared]
        return load + lines, [printer.doprint(value) for value in reduced]


def assignments(targets: Sequence[str], values: Expressions, names: Mapping[sp.Symbol, str]) -> Lines:
    """Return lines that set each target to a value, with common subexpressions shared."""
    private = {symbol: _private("s", i, symbol) for i, symbol in enumerate(names)}
    lines, results = _straight_line("an expression", values, private, names)
    return lines + [f"{target} = {result}" for target, result in zip(targets, results, strict=True)]


def require_smooth(name: str, values: Expressions) -> None:
    """Check that the expressions are finite, real and without cases; raise InvalidProblem otherwise."""
    every = list(parts(values))
    if any(part in (sp.zoo, sp.nan, sp.oo, -sp.oo, sp.I) for part in every):
        raise InvalidProblem(
            f"{name} is not a finite real number anywhere: it has infinity, NaN or the imaginary unit in it; write it otherwise.",
            "nowhere-finite-real",
        )
    if any(isinstance(part, (sp.Piecewise, sp.Min, sp.Max, sp.floor, sp.ceiling)) for part in every):
        raise InvalidProblem(
            f"{name} contains cases, a minimum, a maximum or a floor; H and g must be twice differentiable.", "function-not-smooth"
        )


def computed(name: str, arguments: Arguments, values: Expressions, parameters: Symbols) -> tuple[Lines, Lines]:
    """Return lines for the common subexpressions of values, and the source of each value."""
    whole = [sp.sympify(value) for value in values]
    require_smooth(name, whole)
    entries = [(argument, i, s) for argument, symbols in {**arguments, "par": parameters}.items() for i, s in enumerate(symbols)]
    private = {s: _private(argument, i, s) for argument, i, s in entries}
    return _straight_line(name, whole, private, {s: f"{argument}[{i}]" for argument, i, s in entries})


def expressions(
    name: str,
    arguments: Arguments,
    values: Expressions,
    shape: tuple[int, ...],
    parameters: Symbols,
) -> str:
    """Return the source of ``name(*arguments, par)``, a function of tuples."""
    lines, results = computed(name, arguments, values, parameters)
    return function(f"{name}({', '.join([*arguments, 'par'])})", *lines, f"return {shaped(results, shape)}")

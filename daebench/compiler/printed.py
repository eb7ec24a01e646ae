"""A problem's functions as code in other languages, so that external codes solve the same problem."""

import json
import keyword
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import sympy as sp
from sympy.printing.numpy import NumPyPrinter

from daebench.compiler.print.languages import FUNCTIONS, KEYWORDS, unknown_language
from daebench.errors import BadInput


@dataclass(frozen=True)
class Function:
    """One function of a problem."""

    name: str
    """The textbook's name."""
    about: str
    """Description with its shape."""
    arguments: Mapping[str, Sequence[sp.Symbol]]
    """Vectors that it takes."""
    entries: sp.NDimArray
    """Its value."""

    @property
    def flat(self) -> list[sp.Expr]:
        """Its entries in one list, with the last index fastest."""
        return list(sp.flatten(self.entries.tolist())) if self.entries.shape else [self.entries[()]]


EXPLICIT = {
    "H": "Hamiltonian",
    "H_p": "its gradient with respect to p, shape(d,)",
    "H_q": "its gradient with respect to q, shape(d,)",
    "H_pp": "its second derivatives with respect to p (rows) and p (columns), shape(d, d)",
    "H_qp": "its second derivatives with respect to q (rows) and p (columns), shape(d, d)",
    "H_qq": "its second derivatives with respect to q (rows) and q (columns), shape(d, d)",
}
"""Printed functions of a constrained problem whose H is an expression, by name."""

OF_MASS = {
    "M": "mass matrix of H = 1/2 p^T M(q)^-1 p + U(q), shape(d, d)",
    "M_q": "its derivative with respect to q in the last index, shape(d, d, d)",
    "U": "potential energy",
    "U_q": "its gradient, shape(d,)",
    "U_qq": "its second derivatives, shape(d, d)",
}
"""Printed functions in place of those if the mass matrix is not diagonal."""

CONSTRAINTS = {
    "g": "constraints, shape(m,)",
    "G": "their Jacobian, shape(m, d)",
    "g_qq": "their second derivatives, shape(m, d, d)",
}
"""Printed functions of the constraints; those on velocities have 0 as g, and their factors of velocities as rows of G."""

POISSON = {
    "H": "Hamiltonian",
    "H_y": "its gradient, shape(n,)",
    "H_yy": "its second derivatives, shape(n, n)",
    "B": "structure matrix, shape(n, n)",
}
"""Printed functions of a Poisson system."""

DERIVED = {"M_q": ("M", "q"), "g_qq": ("G", "q"), "H_yy": ("H_y", "y")}
"""Functions that no scheme needs, so that no derivation has them: each is the derivative of a function with respect to an argument."""


def functions(derivation: Any) -> list[Function]:
    """Return the functions of a problem and their first and second derivatives, as they are compiled for schemes.

    For a constrained problem these are H, H_p, H_q, H_pp, H_qp, H_qq, g, G and g_qq. If the mass matrix is not diagonal, M, M_q, U, U_q and
    U_qq replace those of H. For a Poisson system they are H, H_y, H_yy, B, and the Casimir functions C with C_y.
    """
    definition = derivation.definition
    if hasattr(definition, "sites"):
        raise BadInput(f"the functions of a lattice of {definition.sites} sites are loops and cannot be printed.", "lattice-not-printable")
    if hasattr(definition, "nodes"):
        raise BadInput(f"{definition.nodes} nodes are too many to print; take fewer nodes.", "too-many-nodes-to-print")
    if derivation.states == "constrained":
        contents = (EXPLICIT if derivation.explicit else OF_MASS) | (CONSTRAINTS if definition.m else {})
        return [_function(derivation, name, about) for name, about in contents.items()]
    printed_functions = [_function(derivation, name, about) for name, about in POISSON.items()]
    if definition.casimirs:
        C = replace(_function(derivation, "casimirs", f"Casimir functions {', '.join(definition.casimirs)}"), name="C")
        printed_functions += [C, _function(derivation, "C_y", "their gradients, one per row")]
    return printed_functions


def _function(derivation: Any, name: str, about: str) -> Function:
    """Return one function of a problem. The derivation has its expressions, or those of the function of which it is the derivative."""
    if name in DERIVED:
        integral, by = DERIVED[name]
        function = _function(derivation, integral, about)
        x = function.arguments[by]
        entries = [sp.diff(entry, symbol) for entry in function.flat for symbol in x]
        return replace(function, name=name, entries=sp.Array(entries, (*function.entries.shape, len(x))))
    arguments, values, shape = derivation.rule(name)
    return Function(name, about, arguments, sp.Array(list(values), shape))


def printed(language: str, problem: str, derivation: Any) -> str:
    """Return a problem's functions as code."""
    if language not in FUNCTIONS:
        raise unknown_language(language)
    writer: Any = LANGUAGES[language]
    return str(writer(problem, {symbol: float(value) for symbol, value in derivation.definition.parameters.items()}, functions(derivation)))


def _plain(names: Sequence[sp.Symbol], taken: Sequence[str]) -> dict[sp.Symbol, sp.Symbol]:
    """Return symbols with names that are not reserved in any language."""
    words = {*keyword.kwlist, *taken, *KEYWORDS, "end", "begin", "local", "out", "par"}
    return {symbol: sp.Symbol(f"{symbol}_" if str(symbol) in words else str(symbol), real=True) for symbol in names}


Body = tuple[list[tuple[str, str, int]], list[tuple[sp.Symbol, sp.Expr]], list[sp.Expr]]
"""The numbers that a function reads (local name, vector, index), shared subexpressions, and entries in terms of both."""


def _body(function: Function, parameters: Sequence[sp.Symbol]) -> Body:
    vectors = {"par": list(parameters), **function.arguments}
    free = set().union(*(entry.free_symbols for entry in function.flat))
    place = {symbol: (vector, k) for vector, symbols in vectors.items() for k, symbol in enumerate(symbols) if symbol in free}
    plain = _plain(list(place), ["p", "q", "y", function.name])
    shared, entries = sp.cse([entry.xreplace(plain) for entry in function.flat], symbols=sp.numbered_symbols("t_"), order="none")
    return [(str(plain[symbol]), *where) for symbol, where in place.items()], shared, entries


def _c(problem: str, parameters: Mapping[sp.Symbol, float], contents: Sequence[Function]) -> str:
    lines = [f"/* {problem}: {_parameters(parameters)}. Arrays are stored by rows. */", "#include <math.h>", ""]
    for function in contents:
        places, shared, entries = _body(function, list(parameters))
        taken = "".join(f", const double *{name}" for name in function.arguments)
        lines += [f"/* {function.about} */", f"static void {function.name}(const double *par{taken}, double *out)", "{"]
        lines += [f"    (void){name};" for name in ("par", *function.arguments) if name not in {vector for _, vector, _ in places}]
        lines += [f"    const double {name} = {vector}[{k}];" for name, vector, k in places]
        lines += [f"    const double {name} = {_in_c(value)};" for name, value in shared]
        lines += [f"    out[{k}] = {_in_c(entry)};" for k, entry in enumerate(entries)]
        lines += ["}", ""]
    return "\n".join(lines)


def _in_c(x: sp.Expr) -> str:
    """Return an expression without M_PI and its like, which not all compilers have."""
    return str(sp.ccode(x.xreplace({number: sp.Float(number, 17) for number in x.atoms(sp.NumberSymbol)}), math_macros={}))


def _javascript(problem: str, parameters: Mapping[sp.Symbol, float], contents: Sequence[Function]) -> str:
    lines = [f"/* {problem}: {_parameters(parameters)}. Arrays are stored by rows. */", ""]
    for function in contents:
        places, shared, entries = _body(function, list(parameters))
        lines += [f"/* {function.about} */", f"function {function.name}({', '.join(['par', *function.arguments])}) {{"]
        lines += [f"    const {name} = {vector}[{k}];" for name, vector, k in places]
        lines += [f"    const {name} = {sp.jscode(value)};" for name, value in shared]
        values = ", ".join(sp.jscode(entry) for entry in entries)
        lines += [f"    return {f'[{values}]' if function.entries.shape else values};", "}", ""]
    return "\n".join(lines)


def _julia(problem: str, parameters: Mapping[sp.Symbol, float], contents: Sequence[Function]) -> str:
    lines = [f"# {problem}: {_parameters(parameters)}.", ""]
    for function in contents:
        places, shared, entries = _body(function, list(parameters))
        lines += [f"# {function.about}", f"function {function.name}({', '.join(['par', *function.arguments])})"]
        lines += [f"    {name} = {vector}[{k + 1}]" for name, vector, k in places]
        lines += [f"    {name} = {sp.julia_code(value)}" for name, value in shared]
        values = ", ".join(sp.julia_code(entry) for entry in entries)
        shape = function.entries.shape
        backwards = f"permutedims(reshape([{values}], {', '.join(map(str, shape[::-1]))}), {tuple(range(len(shape), 0, -1))})"
        lines += [f"    return {values if not shape else f'[{values}]' if len(shape) == 1 else backwards}", "end", ""]
    return "\n".join(lines)


def _python(problem: str, parameters: Mapping[sp.Symbol, float], contents: Sequence[Function]) -> str:
    code = NumPyPrinter({"fully_qualified_modules": True, "inline": True}).doprint
    lines = [f'"""{problem}: {_parameters(parameters)}."""', "", "import numpy", "", f"par = {list(parameters.values())}", ""]
    for function in contents:
        places, shared, entries = _body(function, list(parameters))
        lines += ["", f"def {function.name}({', '.join(['par', *function.arguments])}):", f'    """{function.about}."""']
        lines += [f"    {name} = {vector}[{k}]" for name, vector, k in places]
        lines += [f"    {name} = {code(value)}" for name, value in shared]
        values, shape = ", ".join(code(entry) for entry in entries), function.entries.shape
        lines += [f"    return numpy.array([{values}]).reshape({shape})" if shape else f"    return {values}", ""]
    return "\n".join(lines)


def _latex(problem: str, parameters: Mapping[sp.Symbol, float], contents: Sequence[Function]) -> str:
    lines = [f"% {problem}: {_parameters(parameters)}."]
    for function in contents:
        name = f"{function.name[0]}_{{{function.name[2:]}}}" if "_" in function.name else function.name
        value = sp.Matrix(function.flat) if len(function.entries.shape) == 1 else function.entries
        shown = value.tomatrix() if len(function.entries.shape) == 2 else value[()] if not function.entries.shape else value
        lines += [f"% {function.about}", f"\\[ {name} = {sp.latex(shown)} \\]"]
    return "\n".join([*lines, ""])


def _json(problem: str, parameters: Mapping[sp.Symbol, float], contents: Sequence[Function]) -> str:
    def text(entries: Any) -> Any:
        return [text(entry) for entry in entries] if isinstance(entries, list) else str(entries)

    values = {f.name: text(f.entries.tolist() if f.entries.shape else f.entries[()]) for f in contents}
    arguments = {name: list(map(str, symbols)) for f in contents for name, symbols in f.arguments.items()}
    return json.dumps({"problem": problem, "par": {str(k): v for k, v in parameters.items()}, "arguments": arguments, "functions": values})


def _parameters(parameters: Mapping[sp.Symbol, float]) -> str:
    """Return the parameters in the order of ``par``, with their defaults."""
    return "par = (" + ", ".join(f"{symbol} = {value:g}" for symbol, value in parameters.items()) + ")"


LANGUAGES = dict(zip(FUNCTIONS, (_c, _c, _javascript, _python, _julia, _latex, _json), strict=True))
"""The languages by name."""

"""A problem's functions as code of other languages, so that code from outside solves the same problem."""

import json
import keyword
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import sympy as sp

from daebench.errors import BadInput, unknown


@dataclass(frozen=True)
class Function:
    """One function of a problem.

    Parameters
    ----------
    name : str
        The textbook's name.
    about : str
        What it is, with its shape.
    arguments : mapping of str to sequence of Symbol
        The vectors that it takes.
    entries : ndarray of Expr
        Its value.
    """

    name: str
    about: str
    arguments: Mapping[str, Sequence[sp.Symbol]]
    entries: sp.NDimArray

    @property
    def flat(self) -> list[sp.Expr]:
        """Its entries, the last index fastest."""
        return list(sp.flatten(self.entries.tolist())) if self.entries.shape else [self.entries[()]]


def functions(derivation: Any) -> list[Function]:
    """Return the functions of a problem and their first and second derivatives.

    Those of a constrained problem are H, H_p, H_q, H_pp, H_qp, H_qq, g, G and g_qq; where the mass matrix is not diagonal, M, M_q, U,
    U_q and U_qq stand for those of H. Those of a Poisson system are H, H_y, H_yy, B, and the Casimir functions C with C_y.

    Raises
    ------
    BadInput
        If the problem is a lattice, or a chain of so many nodes that its functions are loops.
    """
    if derivation.states == "poisson":
        return _poisson(derivation)
    if not hasattr(derivation, "q"):
        raise BadInput(f"{derivation.definition.nodes} nodes are too many to write out; take fewer.")
    q, p = list(derivation.q), list(derivation.p)
    if derivation.explicit:
        H = sp.sympify(derivation.H)
        both = {"p": p, "q": q}
        found = [Function("H", "Hamiltonian", both, sp.Array(H))]
        found += [
            Function(f"H_{name}", f"its gradient with respect to {name}, shape(d,)", both, _gradient(H, x)) for name, x in both.items()
        ]
        for first, second in (("p", "p"), ("q", "p"), ("q", "q")):
            about = f"its second derivatives, by {first} in rows and by {second} in columns, shape(d, d)"
            found.append(Function(f"H_{first}{second}", about, both, _gradient(_gradient(H, both[first]), both[second])))
    else:
        M, U, at = sp.Array(derivation.M.tolist()), sp.sympify(derivation.U), {"q": q}
        found = [Function("M", "mass matrix of H = 1/2 p^T M(q)^-1 p + U(q), shape(d, d)", at, M)]
        found += [Function("M_q", "its derivative with respect to q in the last index, shape(d, d, d)", at, _gradient(M, q))]
        found += [Function("U", "potential energy", at, sp.Array(U)), Function("U_q", "its gradient, shape(d,)", at, _gradient(U, q))]
        found += [Function("U_qq", "its second derivatives, shape(d, d)", at, _gradient(_gradient(U, q), q))]
    g = sp.Array(list(derivation.g))
    found += [Function("g", "constraints, shape(m,)", {"q": q}, g), Function("G", "their Jacobian, shape(m, d)", {"q": q}, _gradient(g, q))]
    return [*found, Function("g_qq", "their second derivatives, shape(m, d, d)", {"q": q}, _gradient(_gradient(g, q), q))]


def _poisson(derivation: Any) -> list[Function]:
    system = derivation.definition
    if hasattr(system, "sites"):
        raise BadInput(f"the functions of a lattice of {system.sites} sites are loops, and are not written out.")
    y = list(system.y)
    H, at = sp.sympify(system.H), {"y": y}
    found = [Function("H", "Hamiltonian", at, sp.Array(H)), Function("H_y", "its gradient, shape(n,)", at, _gradient(H, y))]
    found += [Function("H_yy", "its second derivatives, shape(n, n)", at, _gradient(_gradient(H, y), y))]
    found += [Function("B", "structure matrix, shape(n, n)", at, sp.Array(sp.Matrix(system.B).tolist()))]
    if system.casimirs:
        C = sp.Array(list(system.casimirs.values()))
        found += [Function("C", f"Casimir functions {', '.join(system.casimirs)}", at, C)]
        found += [Function("C_y", "their gradients, one a row", at, _gradient(C, y))]
    return found


def _gradient(values: Any, x: Sequence[sp.Symbol]) -> sp.NDimArray:
    """Return the derivatives of an expression or array, the new index last."""
    values = sp.Array(values)
    flat = list(sp.flatten(values.tolist())) if values.shape else [values[()]]
    return sp.Array([sp.diff(entry, symbol) for entry in flat for symbol in x], (*values.shape, len(x)))


def printed(language: str, problem: str, derivation: Any) -> str:
    """Return a problem's functions as code.

    Parameters
    ----------
    language : str
        One of :data:`LANGUAGES`.
    problem : str
        Name of the problem.
    derivation : Derivation or PoissonDerivation
        Its expressions.

    Raises
    ------
    BadInput
        If there is no such language, or the functions cannot be written out.
    """
    if language not in LANGUAGES:
        raise unknown("language", language, LANGUAGES)
    writer: Any = LANGUAGES[language]
    return str(writer(problem, {symbol: float(value) for symbol, value in derivation.definition.parameters.items()}, functions(derivation)))


def _plain(names: Sequence[sp.Symbol], taken: Sequence[str]) -> dict[sp.Symbol, sp.Symbol]:
    """Return symbols with names that no language keeps for itself."""
    words = {*keyword.kwlist, *taken, "double", "int", "float", "const", "end", "function", "begin", "let", "local", "out", "par"}
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


def _c(problem: str, parameters: Mapping[sp.Symbol, float], found: Sequence[Function]) -> str:
    lines = [f"/* {problem}: {_parameters(parameters)}. Arrays are stored by rows. */", "#include <math.h>", ""]
    for function in found:
        places, shared, entries = _body(function, list(parameters))
        taken = "".join(f", const double *{name}" for name in function.arguments)
        lines += [f"/* {function.about} */", f"static void {function.name}(const double *par{taken}, double *out)", "{"]
        lines += [f"    (void){name};" for name in ("par", *function.arguments) if name not in {vector for _, vector, _ in places}]
        lines += [f"    const double {name} = {vector}[{k}];" for name, vector, k in places]
        lines += [f"    const double {name} = {sp.ccode(value)};" for name, value in shared]
        lines += [f"    out[{k}] = {sp.ccode(entry)};" for k, entry in enumerate(entries)]
        lines += ["}", ""]
    return "\n".join(lines)


def _julia(problem: str, parameters: Mapping[sp.Symbol, float], found: Sequence[Function]) -> str:
    lines = [f"# {problem}: {_parameters(parameters)}.", ""]
    for function in found:
        places, shared, entries = _body(function, list(parameters))
        lines += [f"# {function.about}", f"function {function.name}({', '.join(['par', *function.arguments])})"]
        lines += [f"    {name} = {vector}[{k + 1}]" for name, vector, k in places]
        lines += [f"    {name} = {sp.julia_code(value)}" for name, value in shared]
        values = ", ".join(sp.julia_code(entry) for entry in entries)
        shape = function.entries.shape
        backwards = f"permutedims(reshape([{values}], {', '.join(map(str, shape[::-1]))}), {tuple(range(len(shape), 0, -1))})"
        lines += [f"    return {values if not shape else f'[{values}]' if len(shape) == 1 else backwards}", "end", ""]
    return "\n".join(lines)


def _python(problem: str, parameters: Mapping[sp.Symbol, float], found: Sequence[Function]) -> str:
    from sympy.printing.numpy import NumPyPrinter

    code = NumPyPrinter({"fully_qualified_modules": True, "inline": True}).doprint
    lines = [f'"""{problem}: {_parameters(parameters)}."""', "", "import numpy", "", f"par = {list(parameters.values())}", ""]
    for function in found:
        places, shared, entries = _body(function, list(parameters))
        lines += ["", f"def {function.name}({', '.join(['par', *function.arguments])}):", f'    """{function.about}."""']
        lines += [f"    {name} = {vector}[{k}]" for name, vector, k in places]
        lines += [f"    {name} = {code(value)}" for name, value in shared]
        values, shape = ", ".join(code(entry) for entry in entries), function.entries.shape
        lines += [f"    return numpy.array([{values}]).reshape({shape})" if shape else f"    return {values}", ""]
    return "\n".join(lines)


def _latex(problem: str, parameters: Mapping[sp.Symbol, float], found: Sequence[Function]) -> str:
    lines = [f"% {problem}: {_parameters(parameters)}."]
    for function in found:
        name = f"{function.name[0]}_{{{function.name[2:]}}}" if "_" in function.name else function.name
        value = sp.Matrix(function.flat) if len(function.entries.shape) == 1 else function.entries
        shown = value.tomatrix() if len(function.entries.shape) == 2 else value[()] if not function.entries.shape else value
        lines += [f"% {function.about}", f"\\[ {name} = {sp.latex(shown)} \\]"]
    return "\n".join([*lines, ""])


def _json(problem: str, parameters: Mapping[sp.Symbol, float], found: Sequence[Function]) -> str:
    def text(entries: Any) -> Any:
        return [text(entry) for entry in entries] if isinstance(entries, list) else str(entries)

    values = {f.name: text(f.entries.tolist() if f.entries.shape else f.entries[()]) for f in found}
    arguments = {name: list(map(str, symbols)) for f in found for name, symbols in f.arguments.items()}
    return json.dumps({"problem": problem, "par": {str(k): v for k, v in parameters.items()}, "arguments": arguments, "functions": values})


def _parameters(parameters: Mapping[sp.Symbol, float]) -> str:
    """Return the parameters in the order of ``par``, with their defaults."""
    return "par = (" + ", ".join(f"{symbol} = {value:g}" for symbol, value in parameters.items()) + ")"


LANGUAGES = {"c": _c, "julia": _julia, "python": _python, "latex": _latex, "json": _json}
"""The languages by name."""

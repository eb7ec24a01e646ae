"""A fixed-step method on a problem, recorded: the functions of the scheme, and those of the problem in its own coordinates."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from daebench.compiler.facts import in_loops
from daebench.compiler.link import Linker, Options
from daebench.compiler.syntax import LANGUAGE
from daebench.compiler.trace.ir import FLOAT32, FLOAT64
from daebench.methods.fixed_step.base import FixedStepMethod
from daebench.pages.generation.recorded import Data, Recorded, of_problem, of_scheme
from daebench.runs.ivp import InitialValueProblem
from daebench.schemes.kernels.claims import MAPPED

ALONE = "daebench.schemes.kernels.alone"

PART = 4000
"""Operations of the longest part that is no function of its own, where functions are divided."""

ENTERING = {"local": "inverse_chart", "canonical": "inverse_chart", "darboux": "canonical"}
"""Functions into the coordinates in which a scheme computes, by the form of the system."""


@dataclass(frozen=True)
class Linked:
    """Recorded functions, and the numbers that belong to them."""

    scheme: Recorded
    """Functions of the scheme."""
    problem: tuple[Recorded, ...]
    """Functions of the problem."""
    state: Any
    """What the scheme computes in, at the start."""
    scales: tuple[float, ...]
    """The length and the rate of the start."""
    entering: str
    """Function into the coordinates of the scheme; "" if these are the problem's."""
    real: str
    """Kind of the numbers of a state: double or single precision."""


def linked(ivp: InitialValueProblem, method: FixedStepMethod[Any, Any], h: float, longest: int = 0, precision: str = "float64") -> Linked:
    """Return a method on a problem, recorded; what has functions of more than ``longest`` operations is divided, unless that is 0."""
    source, state, par = method.printable(ivp, h, precision)
    weights, real = tuple(map(float, method.weights)), FLOAT32 if precision == "float32" else FLOAT64
    data = Data(par, len(ivp.par) + 1, real)
    scheme = _divided(lambda alone: of_scheme(source, state, data, weights, alone), longest)
    entering = ENTERING[method.form] if method.form in MAPPED else ""
    functions = [_divided(lambda alone: _functions(ivp, data, alone), longest)]
    if entering:
        options = Options(form=method.form, precision=precision)
        text = Linker(ivp.source.form(method.form), options).module("Coordinates.", [(LANGUAGE, entering)])
        functions.append(of_problem(text, _vectors(ivp, loops=False), data, [entering]))
    return Linked(scheme, tuple(functions), state, par[len(ivp.par)], entering, real)


def _divided(record: Callable[[int], Recorded], longest: int) -> Recorded:
    """Return recorded functions, with parts of them as functions of their own if they are too long."""
    whole = record(0)
    return record(PART) if 0 < longest < whole.longest else whole


def _functions(ivp: InitialValueProblem, data: Data, alone: int) -> Recorded:
    """Return the functions of a problem in its own coordinates; in mixed precision, too, they are of double precision."""
    precision = "float32" if data.real == FLOAT32 else "float64"
    loops = in_loops(ivp.facts, precision)
    names = ["H"]
    if ivp.facts.KIND == "constrained":
        momenta = ["alone_momenta"] if ivp.source.derivation.mechanical else []
        names += ["H_p", "lam", "alone_residuals", "alone_projected", *momenta]
    roots = [(ALONE, name.removeprefix("alone_")) if name.startswith("alone_") else (LANGUAGE, name) for name in names]
    options = Options(singular=ivp.singular, loops=loops, precision=precision)
    text = Linker(ivp.source.derivation, options).module(f"Functions of {ivp.problem}.", roots)
    return of_problem(text, _vectors(ivp, loops=loops), data, names, alone)


def _vectors(ivp: InitialValueProblem, *, loops: bool) -> tuple[Any, ...]:
    held = (lambda x: x) if ivp.arrays or loops else lambda x: tuple(map(float, x))
    return tuple(held(vector) for vector in ivp.start)

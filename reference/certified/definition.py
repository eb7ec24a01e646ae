"""The definition of a reference: one case of one problem in exact numbers, and the text and hash that stand for it."""

import hashlib
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import mpmath as mp
import sympy as sp

from daebench.catalogue import find_problem, find_scene
from daebench.scene import Scene

if TYPE_CHECKING:
    from daebench.derive import Derivation


@dataclass(frozen=True)
class Definition:
    """One case of one problem, every number of it exact.

    A parameter is the decimal number that its shortest double stands for: 9.81 is 981/100 and not the double beside it.

    Parameters
    ----------
    scene : Scene
        The same in double precision.
    structure : mapping of str to int
        Structural parameters of the case.
    """

    scene: Scene
    structure: Mapping[str, int]

    @property
    def name(self) -> str:
        """Name of the reference: PROBLEM-CASE."""
        return f"{self.scene.problem}-{self.scene.case}"

    @property
    def derivation(self) -> "Derivation":
        """What follows from the problem's definition."""
        return self.scene.source.derivation

    @cached_property
    def parameters(self) -> dict[sp.Symbol, sp.Rational]:
        """Values of the parameters by their symbols."""
        values = self.scene.parameters
        return {symbol: sp.Rational(repr(values[str(symbol)])) for symbol in self.derivation.problem.parameters}

    @cached_property
    def start(self) -> tuple[list[sp.Expr], list[sp.Expr]]:
        """Initial positions and momenta as exact expressions, shape(d,) each."""
        case = self.derivation.problem.cases[self.scene.case]
        return self.settled(case.q), self.settled(case.p)

    def settled(self, expressions: Sequence[Any]) -> list[sp.Expr]:
        """Return expressions with the parameters replaced by their values."""
        return [sp.sympify(each).subs(self.parameters) for each in expressions]

    def start_numbers(self) -> tuple[list[Any], list[Any]]:
        """Return initial positions and momenta as mpmath numbers at mpmath's working precision."""
        q, p = ([sp.N(each, mp.mp.dps + 5)._to_mpmath(mp.mp.prec) for each in part] for part in self.start)
        return q, p

    @cached_property
    def text(self) -> dict[str, Any]:
        """The mathematics in words of SymPy: what the hash is taken of."""
        problem = self.derivation.problem
        energy = {"H": str(problem.H)} if problem.H is not None else {"M": str(sp.Matrix(problem.M).tolist()), "U": str(problem.U)}
        return {
            "q": [str(x) for x in problem.q],
            "p": [str(x) for x in problem.p],
            **energy,
            "g": [str(each) for each in problem.g],
            "parameters": {name: repr(value) for name, value in self.scene.parameters.items()},
            "structure": dict(self.structure),
            "q0": [str(each) for each in problem.cases[self.scene.case].q],
            "p0": [str(each) for each in problem.cases[self.scene.case].p],
            "integrals": {name: str(each) for name, each in problem.integrals.items()},
        }

    @property
    def hash(self) -> str:
        """SHA-256 of the definition's text."""
        return hashlib.sha256(json.dumps(self.text, sort_keys=True).encode()).hexdigest()


def define(problem: str, case: str | None = None) -> Definition:
    """Return the definition of a case of a problem of the catalogue.

    Raises
    ------
    BadInput
        If the problem or the case is unknown.
    """
    scene, found = find_scene(problem, case), find_problem(problem)
    own = scene.sheet.CASES[scene.case]["parameters"]
    return Definition(scene, {name: int(own.get(name, value)) for name, value in found.structure.items()})

"""The definition of a reference: one case of one problem in exact numbers, with its text and hash."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import mpmath as mp
import sympy as sp

from daebench.errors import BadInput
from daebench.methods.catalogue import find_problem
from daebench.methods.initial_value_problem import initial_value_problem
from daebench.records.seals import digest
from daebench.runs.ivp import Ivp
from daebench.systems.constrained import ConstrainedHamiltonian
from daebench.systems.poisson import PoissonSystem


@dataclass(frozen=True)
class Definition:
    """One case of one problem, with exact numbers.

    The value of a parameter is the decimal number of its shortest representation: 9.81 is 981/100, not the double nearest to it.
    """

    ivp: Ivp
    """The same problem in double precision."""
    structure: Mapping[str, int]
    """Structural parameters of the case."""

    @property
    def name(self) -> str:
        """Name of the reference: PROBLEM-CASE."""
        return f"{self.ivp.problem}-{self.ivp.case}"

    @property
    def derivation(self) -> Any:
        """Quantities derived from the problem's definition."""
        return self.ivp.source.derivation

    @property
    def problem(self) -> Any:
        """The problem's definition: a ConstrainedHamiltonian, or a PoissonSystem; a lattice is written out as one."""
        return self.derivation.problem

    @cached_property
    def parameters(self) -> dict[sp.Symbol, sp.Rational]:
        """Values of the parameters by their symbols."""
        values = self.ivp.parameters
        return {symbol: sp.Rational(repr(values[str(symbol)])) for symbol in self.problem.parameters}

    def values(self) -> dict[str, Any]:
        """Return the values of the parameters by their names, as mpmath numbers of the working precision."""
        return {str(symbol): mp.mpf(value.p) / value.q for symbol, value in self.parameters.items()}

    @cached_property
    def start(self) -> list[list[sp.Expr]]:
        """Initial values as exact expressions, one list for each part of the state: q and p, or y."""
        case = self.problem.cases[self.ivp.case]
        return [self.settled(getattr(case, part)) for part in self.ivp.state.columns]

    @property
    def crosses(self) -> bool:
        """Whether the motion may pass a rank loss of G: the case continues there, and closed form and chart do not need G."""
        if not self.ivp.on_manifold or self.problem.cases[self.ivp.case].on_singular != "continue":
            return False
        return self.problem.closed_form is not None and self.problem.chart is not None

    def settled(self, expressions: Sequence[Any]) -> list[sp.Expr]:
        """Return expressions with the parameters replaced by their values."""
        return [sp.sympify(expression).subs(self.parameters) for expression in expressions]

    def start_numbers(self) -> list[list[Any]]:
        """Return the initial values as mpmath numbers at mpmath's working precision."""
        return [[sp.N(expression, mp.mp.dps + 5)._to_mpmath(mp.mp.prec) for expression in part] for part in self.start]

    @cached_property
    def text(self) -> dict[str, Any]:
        """The mathematics as text of SymPy, of which the hash is taken."""
        problem = self.problem
        case = problem.cases[self.ivp.case]
        return {
            **{part: list(map(str, getattr(problem, part))) for part in self.ivp.state.columns},
            **(_energy_and_constraints(problem) if self.ivp.on_manifold else _structure(problem)),
            **_with_velocities(self.derivation.definition),
            "parameters": {name: repr(value) for name, value in self.ivp.parameters.items()},
            "structure": dict(self.structure),
            **{f"{part}0": list(map(str, getattr(case, part))) for part in self.ivp.state.columns},
            "integrals": {name: str(integral) for name, integral in problem.integrals.items()},
        }

    @property
    def hash(self) -> str:
        """SHA-256 of the definition's text."""
        return hash_of(self.text)


def hash_of(text: Mapping[str, Any]) -> str:
    """Return the SHA-256 of the text of a definition."""
    return digest(json.dumps(text, sort_keys=True))


def _structure(problem: PoissonSystem) -> dict[str, Any]:
    """Return the expressions that determine the equations of motion of a Poisson system, as text of SymPy."""
    casimirs = {name: str(casimir) for name, casimir in problem.casimirs.items()}
    return {"B": str(sp.Matrix(problem.B).tolist()), "H": str(problem.H), "casimirs": casimirs}


def _energy_and_constraints(problem: ConstrainedHamiltonian) -> dict[str, Any]:
    """Return the expressions that determine the equations of motion on a manifold, as text of SymPy."""
    energy = {"H": str(problem.H)} if problem.H is not None else {"M": str(sp.Matrix(problem.M).tolist()), "U": str(problem.U)}
    return {**energy, "g": [str(constraint) for constraint in problem.g]}


def _with_velocities(declared: Any) -> dict[str, Any]:
    """Return forces without a potential, constraints on velocities and these, as text of SymPy; empty if there are none."""
    given = {part: list(map(str, entries)) for part in ("force", "velocity") if (entries := getattr(declared, part, None))}
    return given and given | {"v": list(map(str, declared.v or ()))}


def define(problem: str, case: str | None = None) -> Definition:
    """Return the definition of a case of a problem of the catalogue."""
    ivp, entry = initial_value_problem(problem, case), find_problem(problem)
    if ivp.case not in ivp.facts.CASES:
        raise BadInput(
            f"{ivp.problem}, case {ivp.case}, is a start of your own, and references are of declared cases; declare one.",
            "reference-of-own-start",
        )
    parameters = ivp.facts.CASES[ivp.case]["parameters"]
    return Definition(ivp, {name: int(parameters.get(name, value)) for name, value in entry.structure.items()})

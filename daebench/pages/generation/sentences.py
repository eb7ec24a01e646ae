"""Sentences in generated code: the meaning of its parameters, multipliers and statuses, and the claims of a scheme."""

import re
from collections.abc import Mapping, Sequence
from typing import Any

from daebench.compiler.print.languages import KEYWORDS
from daebench.methods.fixed_step.reasons import IN_SHORT
from daebench.pages import definition as definitions
from daebench.runs.ivp import InitialValueProblem
from daebench.schemes.kernels.relax import ROUNDS
from daebench.systems.lazily import sympy as sp

OF_RUNS = (4, 8)
"""Statuses that only a loop with monitors or derivatives has."""

UNSAID = frozenset(("closed form", "kinetic flow", "chart", "canonical coordinates", "lift"))
"""Parts of a definition that are nothing to generated code."""

CLAIMS = {
    "symmetric": "symmetric",
    "symplectic": "symplectic on the manifold",
    "keeps_g": "keeping g = 0 to round-off",
    "keeps_Gv": "keeping G v = 0 to round-off",
    "conserves_energy": "conserving H to round-off",
    "conformal": "contracting the two-form as a damping -c p does",
}
"""Claims of a scheme in words."""


def commented(text: str) -> str:
    """Return a text that ends no comment and no docstring of any language."""
    for ending, other in (("*/", "* /"), ('"""', "''"), ("\\", "/")):
        text = text.replace(ending, other)
    return text


def multipliers(problem: Any) -> list[str]:
    """Return the meaning of each multiplier of a problem; for a chain, those of a node and of the joint before it."""
    if hasattr(problem, "joints"):
        joints = [f"of each joint: g = {g}; the force is -lam grad g" for g in problem.joints]
        return [*joints, *(f"of each node: g = {g}; the force is -lam grad g" for g in problem.own)]
    words = problem.parts.constraints if getattr(problem, "parts", None) else [""] * problem.m
    meanings = [
        f"lam[{k}], of {about + ', ' if about else ''}{_force(sp.sympify(constraint), problem.q)}"
        for k, (about, constraint) in enumerate(zip(words[: len(problem.g)], problem.g, strict=True))
    ]
    meanings += [
        f"lam[{k}], of {about + ', ' if about else ''}0 = {row}; the force is -lam times its factors of velocities"
        for k, (about, row) in enumerate(zip(words[len(problem.g) :], problem.velocity, strict=True), start=len(problem.g))
    ]
    return meanings


def conditions(ivp: InitialValueProblem) -> str:
    """Return the constraints on positions and on velocities as equations, and what the rows of G are."""
    if not ivp.nonholonomic:
        return ",    0 = g(q),    G = g'" if ivp.m else ""
    positions, rows = (",    0 = g(q)", "(g', A)") if ivp.holonomic else ("", "A")
    return f"{positions},    0 = A(q) q' + a(q),    G = {rows}"


def _force(g: "sp.Expr", q: "Sequence[sp.Symbol]") -> str:
    """Return a constraint on positions, and the force that its multiplier is."""
    factor = _factor(g, q)
    if factor is None:
        return f"g = {g}; the force is -lam grad g"
    force = f"2 {'' if factor == 1 else f'{factor} '}lam l"
    return f"g = {g}; the force along the distance l is {force}, tension where it is positive, thrust where negative"


def _factor(g: "sp.Expr", q: "Sequence[sp.Symbol]") -> "sp.Expr | None":
    """Return c where g is c (l^2 - const), l being the distance of two points, or of one from a fixed point; None otherwise."""
    from daebench.compiler.constrained.distances import distance  # which imports SymPy

    between = distance(g, q)
    if between is not None:
        return between.factor
    if not g.is_polynomial(*q) or (polynomial := sp.Poly(g, *q)).total_degree() != 2:
        return None
    terms = {powers: value for powers, value in polynomial.terms() if sum(powers) == 2}
    linear = {powers.index(1) for powers, _ in polynomial.terms() if sum(powers) == 1}
    alone = all(2 in powers for powers in terms) and linear <= {powers.index(2) for powers in terms}
    factors = {*terms.values()}
    return factors.pop() if alone and len(factors) == 1 and not next(iter(terms.values())).has(*q) else None


def definition(ivp: InitialValueProblem) -> dict[str, str]:
    """Return the parts of a definition as text."""
    problem = ivp.source.define()
    parts, _ = definitions.constrained(problem) if ivp.facts.KIND == "constrained" else definitions.poisson(problem, ivp.facts)
    return {name: part for name, part in parts.items() if name not in UNSAID}


def statuses(reasons: Mapping[int, tuple[str, str]]) -> list[tuple[int, str, str]]:
    """Return number, name and sentence of each status that a step may have."""

    def sentence(why: str, advice: str) -> str:
        why = re.sub(r", residual \{residual[^}]*\}| in \{sweeps\} iterations", "", why)
        return f"{why.format(relaxations=ROUNDS, domain='of the problem')}; {advice}".replace('"', "'")

    names = {status: re.sub(r"\W", "_", IN_SHORT[status]) for status in reasons if status not in OF_RUNS}
    return [(status, name.upper(), sentence(*reasons[status])) for status, name in sorted(names.items())]


def claimed(ivp: InitialValueProblem, method: Any) -> tuple[int, str, str]:
    """Return the order that a method claims on a problem, its other claims in a sentence, and where its scheme is defined."""
    if ivp.facts.KIND == "poisson":
        claims, conserved = method.member, method.keeps(ivp)
        statements = ["symmetric"] * claims.symmetric + ["a Poisson integrator"] * method.is_poisson(ivp)
        statements += [f"keeping {', '.join(conserved)} to round-off"] * bool(conserved)
        order = method.order
    else:
        claims = method.claims_on(ivp)
        statements = [words for name, words in CLAIMS.items() if getattr(claims, name, False)]
        order = claims.order
    return order, f"Claimed to be {', '.join(statements)}." if statements else "Nothing is claimed besides.", claims.source


def claims(ivp: InitialValueProblem, method: Any) -> dict[str, Any]:
    """Return the claims of a scheme on a constrained problem as a code from outside states them."""
    stated = method.claims_on(ivp)
    return {name: getattr(stated, name) for name in ("order", "symmetric", "symplectic", "keeps_g", "keeps_Gv")}


IDENTIFIER = re.compile(r"[A-Za-z_][A-Za-z0-9_]*")


def identifiers(names: Sequence[str]) -> list[str]:
    """Return names that are identifiers and no keywords, each used once."""
    unique: list[str] = []
    for name in names:
        plain = "".join(c if c.isascii() and (c.isalnum() or c == "_") else f"u{ord(c):x}" for c in name)
        plain = plain if IDENTIFIER.fullmatch(plain) and plain not in KEYWORDS else f"{plain}_" if plain[:1].isalpha() else f"_{plain}"
        while plain in unique:
            plain += "_"
        unique.append(plain)
    return unique


def parameters_of(ivp: InitialValueProblem, about: Mapping[str, str]) -> list[dict[str, Any]]:
    """Return name, value and meaning of each parameter of a problem."""
    names = identifiers([*ivp.parameters, "scale_length", "scale_rate"])[: len(ivp.parameters)]
    return [
        {"name": name, "value": float(value), "about": commented(about.get(of, "").rstrip("."))}
        for name, (of, value) in zip(names, ivp.parameters.items(), strict=True)
    ]

"""Initial value problems from a source: parameters and initial values of a case, or replacements of them."""

import types
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from daebench.compiler.definition import Source
from daebench.errors import BadInput, real, unknown
from daebench.runs.ivp import Array, ConstrainedIvp, Ivp, PoissonIvp
from daebench.runs.state import STATES

Start = Mapping[str, Sequence[float] | None]


ANALYSIS = "but this analysis is for constrained problems; see daebench list problems"


def constrained(ivp: Ivp, why: str = ANALYSIS, lead: str = "") -> ConstrainedIvp:
    """Return a problem as one on a manifold; refuse a Poisson system in a sentence that begins with ``lead`` and ends with ``why``."""
    if not ivp.on_manifold:
        raise BadInput(f"{lead}{ivp.problem} is a Poisson system, {why}.", "poisson-not-constrained")
    return ivp


def require_constraints(ivp: Ivp, why: str, lead: str = "") -> ConstrainedIvp:
    """Return a problem as one with constraints; refuse others in a sentence that begins with ``lead`` and ends with ``why``."""
    if not (ivp.on_manifold and ivp.m):
        raise BadInput(f"{lead}{ivp.problem} is {ivp.state.words}, {why}.", "constraints-needed")
    return ivp


def require_positions(ivp: ConstrainedIvp, why: str) -> ConstrainedIvp:
    """Return a problem with constraints on positions; refuse one with others in a sentence that ends with ``why``."""
    if ivp.nonholonomic:
        raise BadInput(f"{ivp.problem} has constraints on velocities, {why}.", "velocity-constraints-refused")
    return ivp


def with_reactions(ivp: Ivp) -> ConstrainedIvp:
    """Return a problem that has constraint forces; refuse a Poisson system, and vectors that are arrays, for which G is not given."""
    problem = require_constraints(ivp, "which has no joints or constraints and so no reactions; leave them out")
    if ivp.arrays:
        raise BadInput(
            f"the vectors of {ivp.problem} are arrays, for which there are no reactions; choose the algebra values.", "reactions-of-arrays"
        )
    return problem


def make_ivp(
    source: Source,
    case: str | None = None,
    parameters: Mapping[str, float] | None = None,
    **given: Sequence[float] | None,
) -> Ivp:
    """Return the initial value problem of a case, by default the first, with parameters and p0, q0 or y0 replaced if they are given.

    Consistency with the constraints is not checked, and velocities v0 are left to the caller.
    """
    facts = source.facts
    case = first_case(source, given) if case is None else case
    names = STATES[facts.KIND].starts
    for name, values in given.items():
        if values is not None and name not in names and not (name == "v0" and "p0" in names):
            raise BadInput(f"{source.problem} starts from {' and '.join(names)}; leave out {name}.", "other-initial-values")
    if not facts.CASES and given.get("v0") is not None:
        given["p0"] = [0.0] * facts.D  # which the momenta of these velocities replace
    free = not facts.CASES and all(given.get(name) is not None for name in names)
    if case not in facts.CASES and not free:
        raise unknown(f"case of {source.problem}", case, facts.CASES)
    values_of = _parameters(source, {} if free else facts.CASES[case]["parameters"], parameters or {})
    declared = () if free else case_start(facts, case, values_of)
    start = [declared[k] if (values := given.get(name)) is None else initial_values(name, values, facts) for k, name in enumerate(names)]
    for name, array in zip(names, start, strict=True):
        if not np.all(np.isfinite(array)):
            raise BadInput(
                f"{name} of {source.problem}, case {case}, is {array.tolist()}; it must be finite numbers.", "initial-value-not-finite"
            )
    if facts.KIND == "poisson":
        return _in_domain(PoissonIvp(source, case, values_of, *start))
    return ConstrainedIvp(source, case, values_of, start[0], start[1], on_singular=facts.CASES.get(case, {}).get("on_singular", "stop"))


def first_case(source: Source, start: Start) -> str:
    """Return the first case; "" if the problem has none and all initial values are given."""
    if not source.facts.CASES and sum(values is not None for values in start.values()) < len(STATES[source.facts.KIND].vectors):
        raise BadInput(f"{source.problem} declares no cases; declare one, or give the initial values.", "problem-without-cases")
    return next(iter(source.facts.CASES), "")


def _parameters(source: Source, of_case: Mapping[str, float], given: Mapping[str, float]) -> dict[str, float]:
    """Return the values of all parameters: given values first, then those of the case, then the defaults."""
    values: dict[str, float] = dict(source.defaults or source.facts.PARAMETERS)
    # A case may also set a structural parameter, which chose the definition and is no run-time parameter.
    values |= {name: float(value) for name, value in of_case.items() if name in values}
    for name, value in given.items():
        if name not in values:
            raise unknown(f"parameter of {source.problem}", name, values)
        values[name] = real(name, value)
    for name in source.facts.POSITIVE:
        if not values[name] > 0:
            raise BadInput(f"{name} = {values[name]:g} of {source.problem} must be greater than 0.", "parameter-not-positive")
    return values


def _in_domain(ivp: PoissonIvp) -> PoissonIvp:
    domain = " and ".join(f"{expression} > 0" for expression in ivp.facts.DOMAIN)
    if domain and not bool(ivp.value("inside", ivp.y0)):
        raise BadInput(f"y0 = {ivp.y0.tolist()} of {ivp.problem} is outside its domain {domain}; start inside.", "outside-domain")
    return ivp


def case_start(facts: types.ModuleType, case: str, values: Mapping[str, float]) -> tuple[Array, ...]:
    """Return the initial values of a case for some values of the parameters: p and q, or y."""
    with np.errstate(all="ignore"):
        start = facts.INITIAL[case](tuple(map(np.float64, values.values())))
    return tuple(np.array(x, dtype=float) for x in (start if np.ndim(start) > 1 else (start,)))


def initial_values(name: str, values: Any, facts: types.ModuleType) -> Array:
    """Return initial values as an array, shape(d,); raise BadInput if their number is wrong or one is not finite."""
    d, what = (facts.N, "coordinates") if facts.KIND == "poisson" else (facts.D, "positions")
    if isinstance(values, str | Mapping) or not np.iterable(values):
        raise BadInput(f"{name} = {values!r} must be {d} numbers.", "initial-value-malformed")
    numbers = list(values)
    if facts.KIND == "constrained" and facts.EXTENDED and len(numbers) == d - 1:
        numbers.append(0.0)  # the time, or its conjugate
    if len(numbers) != d:
        raise BadInput(
            f"{name} has {len(numbers)} numbers; the problem has {d - getattr(facts, 'EXTENDED', 0)} {what}.", "initial-value-length"
        )
    return np.array([real(f"{name}[{i}]", value) for i, value in enumerate(numbers)])

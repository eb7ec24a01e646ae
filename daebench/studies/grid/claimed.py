"""Which methods can be run here and on a problem, and what each claims to conserve there."""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from daebench.errors import BadInput
from daebench.methods.fixed_step.constrained import FixedStep
from daebench.methods.initial_value_problem import initial_value_problem
from daebench.methods.names import methods_of
from daebench.methods.outside.method import OutsideMethod
from daebench.methods.solvers.drive import not_installed
from daebench.runs.ivp import Ivp, PoissonIvp
from daebench.runs.state import State

if TYPE_CHECKING:
    import pandas as pd


ON_VELOCITIES = (
    *("dla", "nonholonomic_leapfrog", "gni", "spark_lobatto3", "spark_lobatto4", "dla/suzuki4", "rk4", "rk4+proj", "gauss3+proj"),
    *("heyoka:taylor", "cvode:adams", "ida:index1", "ida:index2", "ida:ode", "scipy:DOP853", "solve_dae:Radau"),
)
"""Methods for problems with constraints on velocities, where none are given."""


def usual(methods: Mapping[State, tuple[str, ...]], ivp: Ivp) -> tuple[str, ...]:
    """Return the methods of a study where none are given: those for the state of a problem, or for constraints on velocities."""
    return ON_VELOCITIES if ivp.nonholonomic else methods[ivp.state]


def installed(names: Sequence[str]) -> tuple[list[str], dict[str, str]]:
    """Return those of these methods whose packages are installed, and what the others need, as sentences; refuse where none is left."""
    missing = {name: why for name in names if (why := not_installed(name))}
    if missing.keys() == set(names) and names:
        raise BadInput(" ".join(missing.values()), "packages-missing-for-runs")
    return [name for name in names if name not in missing], missing


def feasible(ivp: Ivp, names: Sequence[str], *, anyway: bool = False) -> tuple[list[str], dict[str, str]]:
    """Return those of these methods that can be run, and why the others cannot, as sentences; refuse ``anyway`` where it has no use."""
    methods_of(ivp, (), anyway=anyway)
    accepted_names: list[str] = []
    refused: dict[str, str] = {}
    for name in names:
        try:
            (solver,) = methods_of(ivp, [name], anyway=anyway)
            why = solver.refusal(ivp)
        except BadInput as error:
            why = str(error)
        if why:
            refused[name] = why
        else:
            accepted_names.append(name)
    return accepted_names, refused


THINGS = ("energy", "constraints", "casimirs", "two_form")
"""What may be claimed: energy without drift, g = 0 and G H_p = 0, Casimir functions, the two-form or the structure matrix."""


def claimed(ivp: Ivp, method: Any) -> frozenset[str]:
    """Return which of :data:`THINGS` a method claims to conserve on an initial value problem.

    Energy without drift is claimed by a method that is symplectic on the manifold, or a Poisson integrator, or that conserves H. A method
    that is symmetric alone and stays on the manifold claims it on a motion that is its own reverse: that begins at rest, so that
    x(-t) is x(t) with p reversed. Methods that choose their own steps claim nothing, nor do those that refuse the problem.
    """
    if method.knob != "h":
        return frozenset()
    if not ivp.on_manifold:
        return _on_poisson(ivp, method)
    assert isinstance(method, FixedStep | OutsideMethod)
    if isinstance(method, FixedStep) and method.refusal(ivp):
        return frozenset()
    claims = method.claims_on(ivp) if isinstance(method, FixedStep) else method.claims
    symplectic = claims.symplectic and claims.on_manifold
    returns = not np.any(ivp.p0) and not ivp.facts.EXTENDED and not ivp.nonholonomic
    reversed_too = claims.symmetric and claims.on_manifold and returns
    claim = {
        "energy": symplectic or claims.conserves_energy or reversed_too,
        "constraints": claims.on_manifold and ivp.m > 0,
        "two_form": claims.symplectic,
    }
    return frozenset(name for name, holds in claim.items() if holds)


def _on_poisson(ivp: PoissonIvp, method: Any) -> frozenset[str]:
    conserved = method.keeps(ivp)
    claim = {
        "energy": method.is_poisson(ivp) or "energy" in conserved,
        "casimirs": bool(ivp.casimirs) and set(ivp.casimirs) <= set(conserved),
        "two_form": method.is_poisson(ivp),
    }
    return frozenset(name for name, holds in claim.items() if holds)


def claims_of(table: "pd.DataFrame") -> dict[str, frozenset[str]]:
    """Return the claims of the methods of a study's table on all of its cases, by name; one that daebench does not know claims nothing.

    The claims do not depend on values of parameters.
    """
    claims_by_method: dict[str, frozenset[str]] = {}
    for (problem, case), rows in table.groupby(["problem", "case"], sort=False):
        ivp = initial_value_problem(str(problem), str(case))
        for name in dict.fromkeys(map(str, rows["method"])):
            claims = _claimed(ivp, name)
            claims_by_method[name] = claims_by_method[name] & claims if name in claims_by_method else claims
    return claims_by_method


def _claimed(ivp: Ivp, name: str) -> frozenset[str]:
    try:
        (method,) = methods_of(ivp, [name], anyway=not ivp.on_manifold)
    except BadInput:
        return frozenset()
    return claimed(ivp, method)

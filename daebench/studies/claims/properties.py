"""One property of one method on one problem, and the sentence that says why it does not hold: what assertions in tests are made of."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from daebench.diagnostics.energy import BOUNDED, DRIFTS, KEPT
from daebench.diagnostics.energy_verdict import energy_verdict
from daebench.diagnostics.order import SLACK
from daebench.errors import BadInput, require_known
from daebench.methods.initial_value_problem import initial_value_problem
from daebench.methods.names import method_of
from daebench.runs.ivp import ConstrainedIvp, Ivp, PoissonIvp
from daebench.runs.request import Request
from daebench.runs.trajectory import CONSTRAINED, POISSON
from daebench.studies.claims.bench import NAMES, Bench, Finding
from daebench.studies.claims.check import MOST_STATES, order_finding
from daebench.studies.claims.constrained import ConstrainedBench
from daebench.studies.claims.poisson import PoissonBench

OUTPUTS = 2000
"""States of a run of which it is told whether the energy drifts, about."""


def posed(problem: Any, case: str | None, parameters: Mapping[str, float] | None, method: Any) -> tuple[Ivp, Any]:
    """Return an initial value problem, and a method for it by its name or as code from outside."""
    ivp = initial_value_problem(problem, case, parameters)
    return ivp, method_of(ivp, method)


def _bench(ivp: Ivp, method: Any, h: float, steps: int) -> Bench[Any, Any]:
    watch = CONSTRAINED if isinstance(ivp, ConstrainedIvp) else POISSON
    request = Request(value=h, steps=steps, every=max(1, steps // MOST_STATES), watch=watch)
    method.check(ivp, request)
    run = method.solve(ivp, request).complete()
    return ConstrainedBench(ivp, method, run) if isinstance(ivp, ConstrainedIvp) else PoissonBench(ivp, method, run)


def defect(name: str, ivp: Ivp, method: Any, h: float, steps: int) -> str:
    """Return why a map does not have a property, "" where it has: "symplectic", which on a Poisson system is a Poisson map, or "symmetric".

    Parameters
    ----------
    name : str
        The property.
    ivp : InitialValueProblem
        The problem with its numbers.
    method : Method
        A method with fixed steps.
    h : float
        Step size, s.
    steps : int
        Steps of the map, at most 10 of them; one step may have a property by accident.
    """
    bench = _bench(ivp, method, h, steps)
    findings = {finding.property: finding for finding in bench.defects()}
    finding = findings["Poisson map" if name == "symplectic" and isinstance(ivp, PoissonIvp) else name]
    return _beyond(finding, f"{method.name} is not {name} on {ivp.problem}, case {ivp.case}: {bench.n} steps of {h:g}")


def _beyond(finding: Finding, what: str) -> str:
    if finding.measured <= finding.bound:
        return ""
    if not np.isfinite(finding.measured):
        return f"{what} have no defect to measure; {finding.note}"
    return f"{what} have a defect of {finding.measured:.2e}, where rounding explains {finding.bound:.1e}. {finding.note}".rstrip()


def conserved(names: Sequence[str], ivp: Ivp, method: Any, h: float, steps: int, within: float | None = None) -> str:
    """Return what is not conserved along a run, of the names given, "" where all of it is.

    Parameters
    ----------
    names : sequence of str
        "g", "Gv", "energy", Casimir functions and first integrals by their names.
    ivp, method, h, steps
        As for :func:`defect`.
    within : float, optional
        Largest error allowed; by default what the rounding of the steps explains.
    """
    bench = _bench(ivp, method, h, steps)
    sizes = bench.conserved()
    faults = []
    for name in names:
        require_known((f"quantity of {ivp.problem}", name, bench.run.maxima))
        bound = bench.bound(steps, sizes[name][1]) if within is None else within
        if np.isnan(bound):
            raise BadInput(f"what rounding makes of {name} is not known; say within what it is to be kept.")
        error = bench.run.maxima[name]
        if not error <= bound:
            faults.append(
                f"{method.name} does not keep {NAMES.get(name, name)} on {ivp.problem}, case {ivp.case}: "
                f"in {steps} steps of {h:g} it is off by {error:.2e}, and {bound:.1e} is allowed."
            )
    return "\n".join(faults)


def drift(ivp: Ivp, method: Any, h: float, t_end: float) -> str:
    """Return how the energy drifts, or why that cannot be told, "" where it is told to be bounded or kept.

    Parameters
    ----------
    ivp, method, h
        As for :func:`defect`.
    t_end : float
        End of the run, s: many oscillations, for absence of evidence of drift is not absence of drift.
    """
    request = Request(value=h, t_end=t_end, every=max(1, int(t_end / h / OUTPUTS)))
    method.check(ivp, request)
    found = energy_verdict(ivp, method.solve(ivp, request).complete())
    where = f"{method.name} on {ivp.problem}, case {ivp.case}, h = {h:g}, up to t = {t_end:g}"
    if found.verdict == DRIFTS:
        return f"the energy of {where} drifts: {found.law}."
    return (
        "" if found.verdict in (KEPT, BOUNDED) else f"whether the energy of {where} drifts cannot be told: {found.reason}; run it longer."
    )


def order(asked: float, ivp: Ivp, method: Any, halvings: int | None = None) -> str:
    """Return why a method has not the order that is asked for, "" where it has: of q and p, or y, the worse one.

    Parameters
    ----------
    asked : float
        The order.
    ivp, method
        As for :func:`defect`.
    halvings : int, optional
        How often the step size is halved; by default until round-off is reached.
    """
    finding, _ = order_finding(ivp, method, halvings=halvings)
    least = asked - SLACK - 2 * finding.standard_error
    if finding.measured > least:
        return ""
    what = f"{method.name} on {ivp.problem}, case {ivp.case}"
    measured = f"is of order {finding.measured:.3g}" if np.isfinite(finding.measured) else "shows no order"
    return f"{what} {measured}, and {asked:g} is asked for: {finding.note}"

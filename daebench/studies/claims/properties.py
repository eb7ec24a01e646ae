"""One property of one method on one problem, and the sentence that says why it does not hold: what assertions in tests are made of."""

import warnings
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from daebench.diagnostics.drift import BOUNDED, DRIFTS, KEPT
from daebench.diagnostics.energy_verdict import energy_verdict
from daebench.diagnostics.order import SLACK
from daebench.errors import BadInput, CannotShow, positive, require_known
from daebench.methods.initial_value_problem import initial_value_problem
from daebench.methods.names import method_of
from daebench.methods.outside.method import OutsideMethod
from daebench.runs.grid import MOST_STEPS
from daebench.runs.ivp import Ivp
from daebench.runs.request import Request
from daebench.studies.claims.bench import DEFECT_STEPS, NAMES, NOT_APPLICABLE
from daebench.studies.claims.check import order_finding
from daebench.studies.claims.measured_run import bench_of
from daebench.studies.claims.second import constant_force, on_second, unseen

ASSERTED = {"symplectic": "symplecticity", "symmetric": "reversibility", "order": "an order"}
"""Words for what is asserted."""

ADVICE = "assert it on a problem whose U has curvature as well"
"""What to do where a problem cannot show a fault."""

OUTPUTS = 2000
"""States of a run of which it is told whether the energy drifts, about."""


def posed(problem: Any, case: str | None, parameters: Mapping[str, float] | None, method: Any) -> tuple[Ivp, Any]:
    """Return an initial value problem, and a method for it by its name or as code from outside."""
    ivp = initial_value_problem(problem, case, parameters)
    return ivp, method_of(ivp, method)


def defect(name: str, ivp: Ivp, method: Any, h: float, steps: int) -> str:
    """Return why a map does not have a property, or why that cannot be told, "" where it has."""
    if steps > DEFECT_STEPS:
        raise BadInput(
            f"steps = {steps} is more than {DEFECT_STEPS}, the most over which the defect of a map is measured; take fewer.",
            "defect-of-too-many-steps",
        )
    bench = bench_of(ivp, method, h, steps)
    finding = bench.judged(name)
    where = f"on {ivp.problem}, case {ivp.case}"
    if finding.verdict == NOT_APPLICABLE:
        raise BadInput(f"{method.name} cannot be {name} {where}: {finding.note}", "property-unmeasured")
    if finding.measured <= finding.bound:
        return on_curved(name, ivp, method)
    if not np.isfinite(finding.measured):
        return f"whether {method.name} is {name} {where} cannot be decided: {finding.note}"
    defect = f"{bench.n} steps of {h:g} have a defect of {finding.measured:.2e}, and rounding explains {finding.bound:.1e}"
    return f"{method.name} is not {name} {where}: {defect}. {finding.note}".rstrip()


def on_curved(name: str, ivp: Ivp, method: Any) -> str:
    """Return why a scheme does not have a property on the second problem, "" where it has, or the first problem shows the force.

    Code from outside knows one problem alone: where its force is constant, a warning says what the problem cannot show.
    """
    for row in on_second(ivp, method, (name,)):
        if not (row.measured > row.bound if name == "order" else row.measured <= row.bound):
            return f"{method.name} is not as asked, {row.property}: {row.measured:.3g}, against {row.bound:.3g}. {row.note}".rstrip()
    if isinstance(method, OutsideMethod) and constant_force(ivp):
        warnings.warn(f"{ASSERTED[name]} is asserted, and {unseen(ivp)[0].rstrip('.')}; {ADVICE}.", CannotShow, stacklevel=6)
    return ""


def conserved(names: Sequence[str], ivp: Ivp, method: Any, h: float, steps: int, within: float | None = None) -> str:
    """Return the names among those given that are not conserved along a run, "" where all are."""
    bench = bench_of(ivp, method, h, steps)
    sizes = bench.conserved()
    faults = []
    for name in names:
        require_known((f"quantity of {ivp.problem}", name, bench.run.maxima))
        bound = bench.bound(steps, sizes[name][1]) if within is None else within
        if np.isnan(bound):
            raise BadInput(f"the round-off of {name} is not known; give a bound with within.", "round-off-bound-missing")
        error = bench.run.maxima[name]
        if not error <= bound:
            faults.append(
                f"{method.name} does not keep {NAMES.get(name, name)} on {ivp.problem}, case {ivp.case}: "
                f"in {steps} steps of {h:g} its error is {error:.2e}, and {bound:.1e} is allowed."
            )
    return "\n".join(faults)


def drift(ivp: Ivp, method: Any, h: float, t_end: float) -> str:
    """Return how the energy drifts, or why that cannot be told, "" where it is told to be bounded or kept."""
    steps = min(positive("t_end", t_end) / positive("h", h), MOST_STEPS)
    request = Request(value=h, t_end=t_end, every=max(1, int(steps / OUTPUTS)))
    method.check(ivp, request)
    energy = energy_verdict(ivp, method.solve(ivp, request).complete())
    where = f"{method.name} on {ivp.problem}, case {ivp.case}, h = {h:g}, up to t = {t_end:g}"
    if energy.verdict == DRIFTS:
        return f"the energy of {where} drifts: {energy.law}."
    if energy.verdict not in (KEPT, BOUNDED):
        return f"whether the energy of {where} drifts cannot be decided: {energy.reason}; run it longer."
    return ""


def order(asked: float, ivp: Ivp, method: Any, halvings: int | None = None) -> str:
    """Return why a method has not the order that is asked for, "" where it has: of q and p, or y, the worse one."""
    finding, _ = order_finding(ivp, method, halvings=halvings)
    least = asked - SLACK - 2 * finding.standard_error
    if finding.measured > least:
        return on_curved("order", ivp, method)
    what = f"{method.name} on {ivp.problem}, case {ivp.case}"
    measured = f"is of order {finding.measured:.3g}" if np.isfinite(finding.measured) else "shows no order"
    return f"{what} {measured}, and {asked:g} is asked for: {finding.note}"

"""Mici's sentences on its constrained leapfrog, measured on the double pendulum."""

import warnings
from typing import Any

import numpy as np

from daebench.diagnostics.derivative import DerivativeWarning
from daebench.diagnostics.order import fit_order
from daebench.diagnostics.reversibility import reversibility_defect
from daebench.diagnostics.symplecticity import linearisation, tangent_basis, two_form_change
from daebench.pages.report.sentences import number
from daebench.reports.engines.adapters import mici as adapter
from daebench.reports.engines.documentation import row
from daebench.reports.engines.motions import BY_KEY, reference_of

PLACE = "ConstrainedLeapfrogIntegrator"

END, STEPS = 10.0, 10
"""Horizon of the order, s, and steps of the map whose properties are measured."""


def check() -> list[dict[str, str]]:
    """Return the sentences with their measurements."""
    ivp, known = BY_KEY["double"].ivp, reference_of("double")
    steps = [1 / 128, 1 / 256, 1 / 512]
    runs = [adapter.run(ivp, h, np.array([END])) for h in steps]
    order = fit_order(steps, [float(np.max(np.abs(run.q[-1] - known.value))) for run in runs], floor=known.bound).slope
    p, q = adapter.run(ivp, 1 / 64, np.array([1.0])).p[-1], adapter.run(ivp, 1 / 64, np.array([1.0])).q[-1]

    def flow(p0: Any, q0: Any) -> tuple[Any, Any]:
        if np.iscomplexobj(p0) or np.iscomplexobj(q0):
            raise TypeError("Mici takes real numbers alone")
        return adapter.steps(ivp, p0, q0, 1 / 64, STEPS)

    X = tangent_basis(ivp, p, q)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DerivativeWarning)
        derivative = linearisation(flow, p, q, X)
    form, back = two_form_change(derivative.value, X), reversibility_defect(flow, p, q)
    g = [float(np.max(np.abs(ivp.along("g", run.q)))) for run in runs]
    Gv = [float(np.max(np.abs(ivp.along("Gv", run.p, run.q)))) for run in runs]
    return [
        row(PLACE, "It has order two.", f"order {number(order, 3)} on the double pendulum", abs(order - 2) < 0.15),
        row(
            PLACE,
            "It is a symplectic map on the cotangent bundle of the manifold.",
            f"two-form defect of {STEPS} steps {number(form)}, by differences that see {number(float(np.max(derivative.floor)))}",
            form < 10 * float(np.max(derivative.floor)) + 1e-7,
        ),
        row(PLACE, "It is symmetric, so that steps are undone.", f"reversibility defect of {STEPS} steps {number(back)}", back < 1e-9),
        row(
            PLACE,
            "Constraints hold up to floating point error, if the iteration converges.",
            f"|g| at most {number(max(g))}, |G v| at most {number(max(Gv))}, with its tolerances set to 1e-12 and 1e-10",
            max(*g, *Gv) < 1e-11,
        ),
    ]

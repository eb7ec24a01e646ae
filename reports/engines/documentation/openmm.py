"""OpenMM's sentences on its constraints and on RATTLE, measured on butane."""

import numpy as np

from daebench.methods.names import method_of
from daebench.pages.report.sentences import number
from daebench.reports.engines.adapters import openmm as adapter
from daebench.reports.engines.contender import Array
from daebench.reports.engines.documentation import row
from daebench.reports.engines.motions import BY_KEY, T_END
from daebench.runs.request import Request
from daebench.systems.lazily import openmm

STEP = 1 / 64
"""Step size, 0.1 ps."""

PAIRS = ((0, 1), (1, 2), (2, 3), (0, 2), (1, 3))
"""Atoms at fixed distances."""


def check() -> list[dict[str, str]]:
    """Return the sentences with their measurements."""
    return [tolerance(), rattle(), massless(), diamond()]


def distances(q: Array) -> Array:
    """Return the distances that are constrained, shape(n, 5)."""
    r = q.reshape(-1, 4, 3)
    return np.stack([np.linalg.norm(r[:, j] - r[:, i], axis=1) for i, j in PAIRS], axis=1)


def tolerance() -> dict[str, str]:
    """Return whether constrained distances are off by no more than the tolerance, relative to themselves."""
    ivp, worst = BY_KEY["butane"].ivp, {}
    for tol in (1e-5, 1e-8, 1e-12):
        states = adapter.run(tol, ivp, STEP, np.arange(1, 81) / 8)
        known = distances(ivp.q0[None])[0]
        worst[tol] = float(np.max(np.abs(distances(states.q) / known - 1)))
    words = ", ".join(f"{number(tol, 1)}: {number(value)}" for tol, value in worst.items())
    sentence = "Constrained distances are kept to the tolerance, as a fraction of themselves (Integrator.setConstraintTolerance)."
    return row("Integrator", sentence, f"largest, of butane: {words}", all(value <= tol * (1 + 1e-3) for tol, value in worst.items()))


def rattle() -> dict[str, str]:
    """Return how far the integrator of the documentation is from RATTLE, HLW (1.25), with the same step."""
    ivp = BY_KEY["butane"].ivp
    states = adapter.run(adapter.TIGHT, ivp, STEP, np.array([T_END]))
    known = method_of(ivp, "rattle").solve(ivp, Request(value=STEP, t_end=T_END, every=0, watch=(), count=False)).complete()
    off = float(np.max(np.abs(states.q[-1] - known.q[-1])))
    sentence = "Its example of velocity Verlet with constraints is the RATTLE algorithm."
    return row("CustomIntegrator", sentence, f"off RATTLE of the same step by {number(off)} Å at t = 10, tolerance 1e-12", off < 1e-8)


def massless() -> dict[str, str]:
    """Return whether a constraint that ends at a particle without mass is refused."""
    system = openmm.System()
    for mass in (0.0, 1.0):
        system.addParticle(mass)
    system.addConstraint(0, 1, 1.0)
    try:
        openmm.Context(system, openmm.VerletIntegrator(0.01), openmm.Platform.getPlatformByName(adapter.PLATFORM))
        refused = False
    except openmm.OpenMMException:
        refused = True
    sentence = "Particles of mass 0 cannot take part in constraints."
    return row("System.addConstraint", sentence, "refused with an error" if refused else "accepted", refused)


def diamond() -> dict[str, str]:
    """Return when butane's positions are no longer finite without the hint on its angles."""
    ivp = BY_KEY["butane"].ivp
    states = adapter.run(adapter.TOLERANCE, ivp, STEP, np.arange(1, 81) / 8, hint=False)
    bad = np.flatnonzero(~np.isfinite(states.q).all(axis=1))
    words = f"no longer finite at t = {number(float((bad[0] + 1) / 8))}, tolerance 1e-5" if len(bad) else "finite to t = 10"
    sentence = (
        "Five constraints between four atoms can blow up (issue 3603, open): butane as it stands, without the hint that its rows have."
    )
    return row("openmm/openmm, issue 3603", sentence, words, bool(len(bad)))

"""Where one method is measured on one Poisson system, and what its roundings may amount to there.

The rule is that of :mod:`daebench.studies.claims.constrained`, bound = 64 eps n size, with these sizes:

- reversal: the start, and what rounding it, or the state half way, makes of the end: |y0| + ||Phi'| |y0|| + ||Psi'| |y1||, where
  y1 = Phi(y0) and Psi is Phi with -h; there are 2 n steps, out and back;
- Poisson map: the largest entry of |Phi'| |B| |Phi'|^T + |B(y1)|. A Poisson map carries B unchanged, so that the roundings of the steps
  add up and are not amplified;
- conserved functions F: |F| + sum |F_y y|, the largest along the run.
"""

from collections.abc import Callable
from typing import Any

import numpy as np

from daebench.diagnostics.derivative import STEP, derivative
from daebench.diagnostics.poisson import Map, poisson_defect
from daebench.reference.solution import EPS
from daebench.runs.ivp import Array, PoissonIvp
from daebench.runs.trajectory import PoissonTrajectory
from daebench.studies.claims.constrained import DEFECT_STEPS, ROUNDINGS, Finding, held, tried
from daebench.studies.measurable import PoissonScheme, symmetric

MULTIPLES = (1, 2, 4)
"""The Poisson defect is measured at these multiples of the step size: a Poisson map is one at all of them, and what is none shows it."""

MOST_STATES = 16
"""States of the run at which sizes of conserved functions are taken, at most."""


class PoissonBench:
    """Where one method is measured on one initial value problem.

    Parameters
    ----------
    ivp : PoissonIvp
        What is solved.
    method : PoissonScheme
        What is measured.
    run : PoissonTrajectory
        A complete run, with everything watched.
    """

    def __init__(self, ivp: PoissonIvp, method: PoissonScheme, run: PoissonTrajectory) -> None:
        self.ivp, self.method, self.run = ivp, method, run
        self.h, self.n = run.value, min(DEFECT_STEPS, run.steps)

    def findings(self) -> list[Finding]:
        """Return all findings but that on the order."""
        return [self.symmetric(), self.poisson(), *self.conserved()]

    def bound(self, n: int, size: float) -> float:
        """Return what n steps may amount to by rounding alone."""
        return ROUNDINGS * EPS * n * size

    def symmetric(self) -> Finding:
        """Return the finding on Phi_{-h} o Phi_h = 1, over n steps each."""
        forth, back = self._flow(self.h), self._flow(-self.h)
        measured, note = tried(lambda: np.linalg.norm(np.real(back(np.real(forth(self.ivp.y0)))) - self.ivp.y0))
        size = self._reversal_size(forth, back) if np.isfinite(measured) else float("nan")
        return held("symmetric", symmetric(self.method), measured, self.bound(2 * self.n, size), note)

    def _reversal_size(self, forth: Map, back: Map) -> float:
        y0 = self.ivp.y0
        y1, out = tangent(forth, y0)
        _, home = tangent(back, y1)
        return float(sum(np.linalg.norm(part) for part in (y0, np.abs(out) @ np.abs(y0), np.abs(home) @ np.abs(y1))))

    def poisson(self) -> Finding:
        """Return the finding on HLW (4.2) at the step size and, where there is a solution, at two larger ones: the worst of the three."""
        claimed = self.method.is_poisson(self.ivp)
        at_h, *larger = (self._poisson(multiple * self.h) for multiple in MULTIPLES)
        if not np.isfinite(at_h[0]):
            return held("Poisson map", claimed, *at_h)
        found = [at_h, *(each for each in larger if np.isfinite(each[0]))]
        measured, bound, _ = max(found, key=lambda each: each[0] / each[1])
        steps = ", ".join(f"{multiple * self.h:g}" for multiple, each in zip(MULTIPLES, (at_h, *larger), strict=True) if each in found)
        note = f"defects of {self.n} steps of {steps}: {', '.join(f'{defect:.1e}' for defect, _, _ in found)}."
        return held("Poisson map", claimed, measured, bound, note)

    def _poisson(self, h: float) -> tuple[float, float, str]:
        """Return the Poisson defect of n steps of size h, its bound, and why there is none."""
        flow, y0 = self._flow(h), self.ivp.y0
        measured, note = tried(lambda: poisson_defect(flow, y0, self._structure))
        if not np.isfinite(measured):
            return measured, float("nan"), note or "the map is not finite."
        y1, D = tangent(flow, y0)
        size = np.abs(D) @ np.abs(self._structure(y0)) @ np.abs(D).T + np.abs(self._structure(y1))
        return measured, self.bound(self.n, float(np.max(size))), ""

    def _flow(self, h: float) -> Map:
        """Return the map of n steps of size h."""
        flow: Any = self.method.flow(self.ivp, h, self.n)
        return flow  # type: ignore[no-any-return]

    def _structure(self, y: Array) -> Array:
        return self.ivp.value("B", y).astype(float)

    def conserved(self) -> list[Finding]:
        """Return the findings on H, the Casimir functions and other integrals along the run."""
        kept, maxima, sizes = self.method.keeps(self.ivp), self.run.maxima, self._sizes()
        return [
            held(f"keeps {'H' if name == 'energy' else name}", name in kept, maxima[name], self.bound(self.run.steps, size))
            for name, size in sizes.items()
        ]

    def _sizes(self) -> dict[str, float]:
        """Return the sizes of conserved functions by the names of their errors."""
        ivp, rows = self.ivp, self.run.y[:: 1 + len(self.run.y) // MOST_STATES]
        names = {"H": ("energy",), "casimirs": ivp.casimirs, "integrals": ivp.integrals}
        found: dict[str, float] = {}
        for function, own in names.items():
            if own:
                sizes = np.max([_size(lambda y, function=function: ivp.value(function, y), y) for y in rows], axis=0)
                found |= dict(zip(own, map(float, sizes), strict=True))
        return found


def tangent(flow: Map, y: Array) -> tuple[Array, Array]:
    """Return Phi(y), shape(n,), and Phi'(y), shape(n, n)."""
    found = derivative(flow, y, np.eye(len(y)))
    return found.image, found.value


def _size(F: Callable[..., Any], y: Array) -> Array:
    """Return |F| + sum |F_y y| of functions at a state, shape(k,)."""
    parts = np.array([np.imag(np.ravel(F(y + 1j * STEP * e))) / STEP for e in np.eye(len(y))])
    sizes: Array = np.abs(np.ravel(F(y))) + np.abs(parts).T @ np.abs(y)
    return sizes

"""The claims of one method on one Poisson system, and what its roundings may amount to there.

The rule is that of :mod:`daebench.studies.claims.bench`, bound = 64 eps n size, with these sizes:

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
from daebench.diagnostics.poisson import Map, structure_change
from daebench.errors import BadInput, RunFailed
from daebench.runs.ivp import Array, PoissonIvp
from daebench.runs.trajectory import PoissonTrajectory
from daebench.studies.claims.bench import NO_BOUND, Bench, Finding, attempted, finding
from daebench.studies.measurable import symmetric

MULTIPLES = (1, 2, 4)
"""The Poisson defect is measured at these multiples of the step size: a Poisson map is one at all of them, and what is none shows it."""

MOST_STATES = 16
"""States of the run at which sizes of conserved functions are taken, at most."""


class PoissonBench(Bench[PoissonIvp, PoissonTrajectory]):
    """One method measured on one Poisson system."""

    def defects(self) -> list[Finding]:
        """Return the findings on symmetry and on the Poisson map."""
        return [self.symmetric(), self.form()]

    def symmetric(self) -> Finding:
        """Return the finding on Phi_{-h} o Phi_h = 1, over n steps each."""
        forth, back = (self.method.flow(self.ivp, h, self.n) for h in (self.run.value, -self.run.value))
        measured, note = attempted(lambda: np.linalg.norm(np.real(back(np.real(forth(self.ivp.y0)))) - self.ivp.y0))
        size = self._reversal_size(forth, back) if np.isfinite(measured) else NO_BOUND
        return finding("symmetric", symmetric(self.method), measured, self.bound(2 * self.n, size), note)

    def _reversal_size(self, forth: Map, back: Map) -> float:
        y0 = self.ivp.y0
        y1, out = tangent(forth, y0)
        _, home = tangent(back, y1)
        return float(sum(np.linalg.norm(part) for part in (y0, np.abs(out) @ np.abs(y0), np.abs(home) @ np.abs(y1))))

    def form(self) -> Finding:
        """Return the finding on HLW (4.2) at the step size and, where there is a solution, at two larger ones: the worst of the three."""
        claimed = self.method.is_poisson(self.ivp)
        defects = {h: self._poisson(h) for h in (multiple * self.run.value for multiple in MULTIPLES)}
        at_h = defects[self.run.value]
        if not np.isfinite(at_h[0]):
            return finding("Poisson map", claimed, *at_h)
        finite = {h: defect for h, defect in defects.items() if np.isfinite(defect[0])}
        measured, bound, _ = max(finite.values(), key=lambda defect: defect[0] / defect[1])
        steps = ", ".join(f"{h:g}" for h in finite)
        note = f"defects of {self.n} steps of {steps}: {', '.join(f'{defect:.1e}' for defect, _, _ in finite.values())}."
        return finding("Poisson map", claimed, measured, bound, note)

    def _poisson(self, h: float) -> tuple[float, float, str]:
        """Return the Poisson defect of n steps of size h, its bound, and why there is none."""
        y0 = self.ivp.y0
        try:
            carried = derivative(self.method.flow(self.ivp, h, self.n), y0, np.eye(len(y0)))
            measured = structure_change(carried, y0, self._structure)
        except (RunFailed, BadInput) as error:
            return NO_BOUND, NO_BOUND, str(error)
        if not np.isfinite(measured):
            return measured, NO_BOUND, "the map is not finite."
        D, B = np.abs(carried.value), np.abs(self._structure(y0))
        size = D @ B @ D.T + np.abs(self._structure(carried.image))
        unknown = 4 * len(y0) * carried.floor * float(np.max(D)) ** 2 * float(np.max(B))
        return measured, self.bound(self.n, float(np.max(size))) + unknown, ""

    def _structure(self, y: Array) -> Array:
        return self.ivp.value("B", y).astype(float)

    def conserved(self) -> dict[str, tuple[bool | None, float]]:
        """Return claims and sizes for H, the Casimir functions and other integrals."""
        ivp, states = self.ivp, self.run.y[:: 1 + len(self.run.y) // MOST_STATES]
        claimed = self.method.keeps(ivp)
        conserved: dict[str, tuple[bool | None, float]] = {}
        for function, names in (("H", ("energy",)), ("casimirs", ivp.casimirs), ("integrals", ivp.integrals)):
            if names:
                sizes = np.max([_size(lambda y, function=function: ivp.value(function, y), y) for y in states], axis=0)
                conserved |= {name: (name in claimed, float(size)) for name, size in zip(names, sizes, strict=True)}
        return conserved


def tangent(flow: Map, y: Array) -> tuple[Array, Array]:
    """Return Phi(y), shape(n,), and Phi'(y), shape(n, n)."""
    linearisation = derivative(flow, y, np.eye(len(y)))
    return linearisation.image, linearisation.value


def _size(F: Callable[..., Any], y: Array) -> Array:
    """Return |F| + sum |F_y y| of functions at a state, shape(k,)."""
    parts = np.array([np.imag(np.ravel(F(y + 1j * STEP * e))) / STEP for e in np.eye(len(y))])
    sizes: Array = np.abs(np.ravel(F(y))) + np.abs(parts).T @ np.abs(y)
    return sizes

"""The claims of one method on one constrained problem, and what its roundings may amount to there.

The rule is that of :mod:`daebench.studies.claims.bench`, bound = 64 eps n size, with these sizes:

- constraints: what a relative change of one in q and v would make of g and G H_p, the largest along the run;
- energy: |H| + sum |H_p p| + sum |H_q q|, the largest along the run;
- reversal: the state, and each of its entries carried to the end, |x| + |Phi' X X^T| |x|, X a basis of the tangent space for a method
  that stays on the manifold, which takes all else away, and of the whole space for others; there are 2 n steps, out and back;
- volume: 1, of a share of what was there;
- two-form: sum |Z_p| |Z_q| over the degrees of freedom, for the columns of Z = X and Z = Phi' X, and 1 for the rounding of X itself,
  the orthonormal basis of the tangent space. A symplectic map carries the two-form of a rounding and a column unchanged, so that
  roundings add up over the steps and are not amplified.

A method that keeps g = 0 and not G H_p = 0 leaves in the momenta what the rounding of positions puts there, through a multiplier
or a difference quotient; the size of p is then |p| + |M| |q| / h.
"""

from functools import cached_property

import numpy as np

from daebench.diagnostics.derivative import Derivative
from daebench.diagnostics.poisson import poisson_defect
from daebench.diagnostics.reversibility import inversion_defect, reversibility_defect
from daebench.diagnostics.symplecticity import (
    Flow,
    linearisation,
    tangent_basis,
    tangent_basis_at_one_time,
    tangent_map,
    two_form_change,
)
from daebench.diagnostics.volume import TOLERANCE, share_of_velocities, volume_left, volume_share
from daebench.errors import BadInput, RunFailed
from daebench.methods.fixed_step.constrained import FixedStep
from daebench.methods.outside.method import OutsideMethod, Stated
from daebench.runs.ivp import Array, ConstrainedIvp
from daebench.runs.local_flow import enter, local_flow, structure_matrix
from daebench.runs.trajectory import Trajectory
from daebench.schemes.kernels.claims import Claims
from daebench.studies.claims.bench import NO_BOUND, NOT_APPLICABLE, Bench, Finding, attempted, finding

EXACT, FINER, KEPT = FixedStep("gauss4"), 4, 1e-9
"""The method that takes the place of the motion, with so many steps for one, and the change of volume up to which it counts as none."""


class ConstrainedBench(Bench[ConstrainedIvp, Trajectory]):
    """One method measured on one constrained problem."""

    def __init__(self, ivp: ConstrainedIvp, method: FixedStep | OutsideMethod, run: Trajectory) -> None:
        super().__init__(ivp, method, run)
        self.claims: Claims | Stated = method.claims_on(ivp) if isinstance(method, FixedStep) else method.claims
        self.flow: Flow = method.flow(ivp, run.value, self.n)
        self.X = tangent_basis(ivp, ivp.p0, ivp.q0)
        self.v, self.H_q = (np.abs(ivp.along(name, run.p, run.q)) for name in ("H_p", "H_q"))
        self.quotient = np.zeros((ivp.d, ivp.d))
        if self.claims.keeps_g and not self.claims.keeps_Gv:
            self.quotient = np.max(np.abs(ivp.along("mass", run.p, run.q)), axis=0) / run.value
        self.q = np.max(np.abs(run.q), axis=0)
        self.p = np.max(np.abs(run.p), axis=0) + self.quotient @ self.q

    def defects(self) -> list[Finding]:
        """Return the findings on symmetry, on symplecticity, and on the Poisson map of the problem's chart."""
        facts = self.ivp.facts
        form = [self.contraction()] if facts.DAMPED else [self.form(), *([self.volume()] if facts.FORCED else [])]
        if self.ivp.nonholonomic:  # its motion preserves no two-form
            form = [] if facts.EXTENDED else [self.volume_of_velocities()]
        volume = [self.kept_volume()] if getattr(self.claims, "volume", False) else []
        return [self.symmetric(), *form, *volume, *self.poisson()]

    def symmetric(self) -> Finding:
        """Return the finding on rho∘Phi∘rho∘Phi = 1, or on Phi_{-h}∘Phi_h = 1 where past and future differ."""
        if self.ivp.facts.EXTENDED:
            return self._undone("a system in time is not reversed by turning the momenta round")
        uneven = np.abs(self.ivp.along("H", -self.run.p, self.run.q) - self.ivp.along("H", self.run.p, self.run.q))
        if np.any(uneven > self.bound(1, self._energy_size())):
            return self._undone("H(-p, q) is not H(p, q), so that turning the momenta round does not reverse the motion")
        measured, note = attempted(lambda: reversibility_defect(self.flow, self.ivp.p0, self.ivp.q0))
        return finding("symmetric", self.claims.symmetric, measured, self.bound(2 * self.n, self._state_size()), note)

    def _undone(self, why: str) -> Finding:
        """Return the finding on Phi_{-h}∘Phi_h = 1, which takes the place of the other for a reason."""
        if not isinstance(self.method, FixedStep):
            note = f"{why}, and code from outside takes no step backwards."
            return Finding("symmetric", self.claims.symmetric, NO_BOUND, NO_BOUND, NOT_APPLICABLE, note=note)
        back = self.method.flow(self.ivp, -self.run.value, self.n)
        measured, note = attempted(lambda: inversion_defect(self.flow, back, self.ivp.p0, self.ivp.q0))
        return finding("symmetric", self.claims.symmetric, measured, self.bound(2 * self.n, self._state_size()), note)

    def contraction(self) -> Finding:
        """Return the finding on the two-form of q and p, which a damping F = -c p contracts as exp(-c t)."""
        at_one_time = tangent_basis_at_one_time(self.ivp, self.ivp.p0, self.ivp.q0)
        try:
            carried = linearisation(self.flow, self.ivp.p0, self.ivp.q0, at_one_time)
        except (RunFailed, BadInput) as error:
            return finding("contracts the two-form", False, NO_BOUND, note=str(error))
        left = float(np.exp(-self.ivp.value("damping", self.ivp.q0, (0.0,))[0] * self.n * self.run.value))
        measured = two_form_change(carried.value, at_one_time, left)
        size = 1 + max(self._two_form_size(Z) for Z in (at_one_time, carried.value))
        claimed = getattr(self.claims, "conformal", False)
        return finding("contracts the two-form", claimed, measured, self.bound(self.n, size), f"by exp(-c t) = {left:.6g}")

    def volume(self) -> Finding:
        """Return the finding on the volume on the manifold, which forces change as :mod:`daebench.diagnostics.volume` says.

        No scheme claims to change it as the motion does: where the rate is another in each position, a step knows it to its order only.
        """
        at_one_time = tangent_basis_at_one_time(self.ivp, self.ivp.p0, self.ivp.q0)
        left = volume_left(self.ivp, self.n * self.run.value)

        def off(parts: int) -> float:
            flow = self.method.flow(self.ivp, self.run.value / parts, parts * self.n)
            return abs(volume_share(tangent_map(flow, self.ivp.p0, self.ivp.q0, at_one_time), at_one_time) / left - 1)

        measured, note = attempted(lambda: off(1))
        bound = self.bound(self.n, 1.0) + TOLERANCE
        if measured > bound:
            halved, note = attempted(lambda: off(2))
            note = note or f"by exp(integral of the divergence) = {left:.6g}, off by {halved:.1e} with h/2."
        return finding("contracts the volume", False, measured, bound, note or f"by exp(integral of the divergence) = {left:.6g}.")

    def kept_volume(self) -> Finding:
        """Return the finding on the volume dp dq, by the determinant of the derivative of the map."""
        measured, note = attempted(lambda: abs(volume_share(self._linearised.value, self.X) - 1))
        return finding("keeps the volume", True, measured, self.bound(self.n, 1.0), note)

    def volume_of_velocities(self) -> Finding:
        """Return the finding on the volume of positions and velocities, which no scheme claims to change as the motion does."""

        def change(flow: Flow) -> float:
            end = tuple(np.real(x) for x in flow(self.ivp.p0, self.ivp.q0))
            return share_of_velocities(self.ivp, self.ivp.start, end, self.X, tangent_map(flow, self.ivp.p0, self.ivp.q0, self.X)) - 1

        measured, note = attempted(lambda: abs(change(self.flow)))
        exact, why = attempted(lambda: change(EXACT.flow(self.ivp, self.run.value / FINER, FINER * self.n)))
        kept = "the motion itself keeps it" if abs(exact) < KEPT else f"the motion itself multiplies it by {1 + exact:.6g}"
        return finding("keeps the volume", False, measured, note=note or why or f"{kept}.")

    def form(self) -> Finding:
        """Return the finding on the two-form on the tangent space of the manifold."""
        try:
            carried = self._linearised
        except (RunFailed, BadInput) as error:
            return finding("symplectic", self.claims.symplectic, NO_BOUND, note=str(error))
        size = 1 + max(self._two_form_size(Z) for Z in (self.X, carried.value))
        largest = float(np.max(np.abs(carried.value), initial=0.0))
        unknown = 4 * self.ivp.d * carried.floor * largest**2  # what the floor of differences may make of the two-form
        note = f"by differences, good to {unknown:.1e}." if carried.floor else ""
        measured = two_form_change(carried.value, self.X)
        return finding("symplectic", self.claims.symplectic, measured, self.bound(self.n, size) + unknown, note)

    def poisson(self) -> list[Finding]:
        """Return the Poisson defect in the problem's chart, HLW (4.2), of a method that stays on the manifold; reported without a claim."""
        if not (self.ivp.facts.CHART and self.claims.on_manifold):
            return []

        def measure() -> float:
            y0 = np.concatenate([np.asarray(part) for part in enter(self.ivp)(self.ivp.p0, self.ivp.q0)])
            return poisson_defect(local_flow(self.flow, self.ivp), y0, structure_matrix(self.ivp))

        measured, note = attempted(measure)
        return [finding("Poisson in the chart", None, measured, note=note)]

    def conserved(self) -> dict[str, tuple[bool | None, float]]:
        """Return claims and sizes for g, G H_p and H, and for first integrals, momentum maps among them, which no method claims to keep."""
        P, Q = self.run.p, self.run.q
        n = self.ivp.moving  # the time counts with what it is itself
        rows = [self.ivp.along(name, *x) for name, x in (("G", (Q,)), ("Gv_q", (P, Q)))]
        (G, G_t), (Gv_q, Gv_t) = ((_largest_row(row[..., :n]), _largest_row(row[..., n:])) for row in rows)
        q, t = float(np.max(self.q[:n])), float(np.max(self.q[n:], initial=0.0))
        M_inverse = np.max(np.abs(self.ivp.along("H_pp", P, Q)), axis=0)
        v = float(np.max(self.v[:, :n])) + float(np.max((M_inverse @ self.quotient @ self.q)[:n]))
        constraints = {
            "g": (self.claims.keeps_g, G * q + G_t * t),
            "Gv": (self.claims.keeps_Gv, G * v + Gv_q * q + Gv_t * t),
        }
        return {
            **(constraints if self.ivp.m else {}),
            "energy": (self.claims.conserves_energy, self._energy_size()),
            **dict.fromkeys(self.ivp.integrals, (None, NO_BOUND)),
        }

    def _energy_size(self) -> float:
        H = np.abs(self.ivp.along("H", self.run.p, self.run.q))
        return float(np.max(H + self.v @ self.p + self.H_q @ self.q))

    @cached_property
    def _linearised(self) -> Derivative:
        """The derivative of the map along the tangent space of the manifold."""
        return linearisation(self.flow, self.ivp.p0, self.ivp.q0, self.X)

    def _state_size(self) -> float:
        x = np.concatenate([self.p, self.q])
        X = self.X if self.claims.on_manifold else np.eye(len(x))
        try:
            carried = self._linearised.value if self.claims.on_manifold else tangent_map(self.flow, self.ivp.p0, self.ivp.q0, X)
        except (RunFailed, BadInput):  # the map has no solution
            carried = X
        return float(np.linalg.norm(x) + np.linalg.norm(np.abs(carried @ X.T) @ x))

    def _two_form_size(self, Z: Array) -> float:
        Z_p, Z_q = np.abs(Z[: self.ivp.d]), np.abs(Z[self.ivp.d :])
        half = (Z_p + self.quotient @ Z_q).T @ Z_q
        return float(np.linalg.norm(half + half.T, 2))


def _largest_row(matrices: Array) -> float:
    """Return the largest sum of moduli over a row, of many matrices."""
    return float(np.max(np.sum(np.abs(matrices), axis=-1), initial=0.0))

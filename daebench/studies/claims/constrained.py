"""Where one method is measured on one initial value problem, and what its roundings may amount to there.

What is claimed to hold exactly is measured to be zero but for rounding. The bounds on that come from one rule::

    bound = 64 eps n size        eps = 2^-52

n is the number of steps, each of which rounds; 64 allows for the roundings of one step, substeps and stages included (RATTLE, and its
composition of 17 substeps, show up to one half of one of them); size is what the rounded numbers amount to, so that neither units
nor mass ratios matter:

- constraints: what a relative change of one in q and v would make of g and G H_p, the largest along the run;
- energy: |H| + sum |H_p p| + sum |H_q q|, the largest along the run;
- reversal: the state, and each of its entries carried to the end, |x| + |Phi' X X^T| |x|, X a basis of the tangent space for a method
  that stays on the manifold, which takes all else away, and of the whole space for others; there are 2 n steps, out and back;
- two-form: sum |Z_p| |Z_q| over the degrees of freedom, for the columns of Z = X and Z = Phi' X, and 1 for the rounding of X itself,
  the orthonormal basis of the tangent space. A symplectic map carries the two-form of a rounding and a column unchanged, so that
  roundings add up over the steps and are not amplified.

A method that keeps g = 0 and not G H_p = 0 leaves in the momenta what the rounding of positions puts there, through a multiplier
or a difference quotient; the size of p is then |p| + |M| |q| / h.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from daebench.diagnostics.poisson import poisson_defect
from daebench.diagnostics.reversibility import reversibility_defect
from daebench.diagnostics.symplecticity import Flow, symplecticity_defect, tangent_basis, tangent_map
from daebench.errors import BadInput, RunFailed
from daebench.methods.fixed_step.constrained import FixedStep
from daebench.reference.solution import EPS
from daebench.runs.ivp import Array, ConstrainedIvp
from daebench.runs.local_flow import enter, local_flow, structure_matrix
from daebench.runs.trajectory import Trajectory

OK, FALLS_SHORT, NOT_CLAIMED = "ok", "FALLS SHORT", "not claimed"
NOT_APPLICABLE, UNDETERMINED = "not applicable", "undetermined"

DEFECT_STEPS = 10
"""Steps of the map whose reversal and two-form are measured: a single step may be exact by accident."""

ROUNDINGS = 64.0
"""Roundings of the size of the state that are allowed for in each step."""


@dataclass(frozen=True)
class Finding:
    """One claim and what was measured.

    Parameters
    ----------
    property : str
        What is claimed, or might be.
    claimed : int, bool or None
        The order; whether the method says so of itself; None for what no method claims, which is only reported.
    measured : float
        The slope for the order, else the defect or the largest error; NaN where there is none.
    bound : float
        The slope must exceed it, all else must not; NaN where nothing is held against anything.
    verdict : str
        "ok", "FALLS SHORT", "not claimed", "not applicable" or "undetermined".
    standard_error : float
        Of the slope.
    note : str
        Why there is no number or no verdict, or more numbers, as a sentence.
    """

    property: str
    claimed: int | bool | None
    measured: float
    bound: float
    verdict: str
    standard_error: float = float("nan")
    note: str = ""


def held(property: str, claimed: bool, measured: float, bound: float, note: str = "") -> Finding:
    """Return the finding on what must not exceed its bound; a number that is missing is none that is small."""
    verdict = NOT_CLAIMED if not claimed else OK if measured <= bound else FALLS_SHORT
    return Finding(property, claimed, measured, bound, verdict, note=note)


class Bench:
    """Where one method is measured on one initial value problem: the run, and the sizes that its roundings have."""

    def __init__(self, ivp: ConstrainedIvp, method: FixedStep, run: Trajectory) -> None:
        self.ivp, self.run, self.claims = ivp, run, method.claims
        self.n = min(DEFECT_STEPS, run.steps)
        self.flow: Flow = method.flow(ivp, run.value, self.n)
        self.X = tangent_basis(ivp, ivp.p0, ivp.q0)
        self.v, self.H_q = (np.abs(ivp.along(name, run.p, run.q)) for name in ("H_p", "H_q"))
        self.quotient = np.zeros((ivp.d, ivp.d))
        if self.claims.keeps_g and not self.claims.keeps_Gv:
            self.quotient = np.max(np.abs(ivp.along("mass", run.p, run.q)), axis=0) / run.value
        self.q = np.max(np.abs(run.q), axis=0)
        self.p = np.max(np.abs(run.p), axis=0) + self.quotient @ self.q

    def findings(self) -> list[Finding]:
        """Return all findings but that on the order."""
        return [self.symmetric(), self.symplectic(), *self.poisson(), *self.constraints(), self.energy(), *self.integrals()]

    def bound(self, n: int, size: float) -> float:
        """Return what n steps may amount to by rounding alone."""
        return ROUNDINGS * EPS * n * size

    def symmetric(self) -> Finding:
        """Return the finding on rho∘Phi∘rho∘Phi = 1."""
        uneven = np.abs(self.ivp.along("H", -self.run.p, self.run.q) - self.ivp.along("H", self.run.p, self.run.q))
        if np.any(uneven > self.bound(1, self._energy_size())):
            note = "H(-p, q) is not H(p, q), so that turning the momenta round does not reverse the motion."
            return Finding("symmetric", self.claims.symmetric, float("nan"), float("nan"), NOT_APPLICABLE, note=note)
        measured, note = tried(lambda: reversibility_defect(self.flow, self.ivp.p0, self.ivp.q0))
        return held("symmetric", self.claims.symmetric, measured, self.bound(2 * self.n, self._state_size()), note)

    def symplectic(self) -> Finding:
        """Return the finding on the two-form on the tangent space of the manifold."""
        measured, note = tried(lambda: symplecticity_defect(self.flow, self.ivp.p0, self.ivp.q0, self.X))
        size = 1 + max(self._two_form_size(Z) for Z in (self.X, self._carried(self.X)))
        return held("symplectic", self.claims.symplectic, measured, self.bound(self.n, size), note)

    def poisson(self) -> list[Finding]:
        """Return the Poisson defect in the problem's chart, HLW (4.2), of a method that stays on the manifold; reported without a claim."""
        if not (self.ivp.sheet.CHART and self.claims.on_manifold):
            return []
        measured, note = tried(self._poisson_defect)
        return [Finding("Poisson in the chart", None, measured, float("nan"), NOT_CLAIMED, note=note)]

    def _poisson_defect(self) -> float:
        y0 = np.concatenate([np.asarray(part) for part in enter(self.ivp)(self.ivp.p0, self.ivp.q0)])
        return poisson_defect(local_flow(self.flow, self.ivp), y0, structure_matrix(self.ivp))

    def constraints(self) -> list[Finding]:
        """Return the findings on g = 0 and G H_p = 0 along the run."""
        P, Q = self.run.p, self.run.q
        G, Gv_q = (_largest_row(self.ivp.along(name, *x)) for name, x in (("G", (Q,)), ("Gv_q", (P, Q))))
        M_inverse = np.max(np.abs(self.ivp.along("H_pp", P, Q)), axis=0)
        v = float(np.max(self.v)) + float(np.max(M_inverse @ self.quotient @ self.q))
        sizes = {"g": G * float(np.max(self.q)), "Gv": G * v + Gv_q * float(np.max(self.q))}
        kept = {"g": ("keeps g", self.claims.keeps_g), "Gv": ("keeps G H_p", self.claims.keeps_Gv)}
        return [held(*kept[x], self.run.maxima[x], self.bound(self.run.steps, size)) for x, size in sizes.items()]

    def energy(self) -> Finding:
        """Return the finding on H along the run."""
        size = self._energy_size()
        return held("keeps H", self.claims.conserves_energy, self.run.maxima["energy"], self.bound(self.run.steps, size))

    def integrals(self) -> list[Finding]:
        """Return the largest errors of the declared first integrals, momentum maps among them, which no method claims to keep."""
        maxima, missing = self.run.maxima, float("nan")
        return [Finding(f"keeps {name}", None, maxima[name], missing, NOT_CLAIMED) for name in self.ivp.integrals]

    def _energy_size(self) -> float:
        H = np.abs(self.ivp.along("H", self.run.p, self.run.q))
        return float(np.max(H + self.v @ self.p + self.H_q @ self.q))

    def _carried(self, X: Array) -> Array:
        """Return Phi' X, or X where the map has no solution."""
        try:
            return tangent_map(self.flow, self.ivp.p0, self.ivp.q0, X)
        except RunFailed:
            return X

    def _state_size(self) -> float:
        x = np.concatenate([self.p, self.q])
        X = self.X if self.claims.on_manifold else np.eye(len(x))
        return float(np.linalg.norm(x) + np.linalg.norm(np.abs(self._carried(X) @ X.T) @ x))

    def _two_form_size(self, Z: Array) -> float:
        Z_p, Z_q = np.abs(Z[: self.ivp.d]), np.abs(Z[self.ivp.d :])
        half = (Z_p + self.quotient @ Z_q).T @ Z_q
        return float(np.linalg.norm(half + half.T, 2))


def _largest_row(matrices: Array) -> float:
    """Return the largest sum of moduli over a row, of many matrices."""
    return float(np.max(np.sum(np.abs(matrices), axis=-1)))


def tried(measure: Callable[[], Any]) -> tuple[float, str]:
    """Return a number, or NaN and the sentence that says why there is none: no solution, or a chart that is singular there."""
    try:
        return float(measure()), ""
    except (RunFailed, BadInput) as error:
        return float("nan"), str(error)

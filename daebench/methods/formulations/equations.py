"""The equations of each formulation, as expressions.

A problem given by M(q) and U(q) is written in velocities, so that M is never inverted; one given by H(p, q) in momenta::

    q' = v - G^T mu                   q' = H_p - G^T mu
    M v' = -c - U_q - G^T lam         p' = -H_q - G^T lam
    0 = g_qv(q, v) v + G v'           0 = (1.12)

with c = M'(q)[v] v - T_q, and mu in ``ggl`` only. Equations are HLW (1.9), (1.11), (1.12), (1.18).
"""

import sympy as sp

from daebench.compiler.constrained.derivation import Derivation

ALPHA, BETA = sp.Dummy("alpha"), sp.Dummy("beta")
"""Baumgarte's numbers, which no parameter of a problem can be mistaken for."""

OPTIONS = {"baumgarte": (ALPHA, BETA)}


class Equations:
    """The rows from which every formulation is put together, each zero along the motion."""

    def __init__(self, derivation: Derivation) -> None:
        self.of, self.d, self.m = derivation, derivation.d, derivation.m
        self.w = derivation.v if derivation.mechanical else derivation.p
        self.q_rate, self.w_rate = (sp.Matrix([sp.Dummy() for _ in range(self.d)]) for _ in range(2))
        self.mu = sp.Matrix([sp.Dummy() for _ in range(self.m)])

    @property
    def velocity(self) -> sp.Matrix:
        """Velocity, v itself or H_p, shape(d,)."""
        return self.of.velocity if self.of.mechanical else self.of.H_p

    def positions(self, formulation: str) -> sp.Matrix:
        """Kinematic rows of (1.9), shape(d,)."""
        extra = self.of.of_positions(self.of.G.T * self.mu) if formulation == "ggl" else sp.zeros(self.d, 1)
        return self.q_rate - self.velocity + extra

    @property
    def momenta(self) -> sp.Matrix:
        """Dynamic rows of (1.9), shape(d,)."""
        of = self.of
        if of.mechanical:
            return of.M * self.w_rate + of.c + of.U_q + of.G.T * of.lam
        return self.w_rate + of.H_q + of.G.T * of.lam

    @property
    def first(self) -> sp.Matrix:
        """Velocity constraint (1.11), shape(m,)."""
        return self.of.G * self.velocity

    @property
    def second(self) -> sp.Matrix:
        """Acceleration constraint (1.12), shape(m,)."""
        of = self.of
        return of.g_qv * of.velocity + of.G * of.of_positions(self.w_rate) if of.mechanical else of.a

    def rows(self, formulation: str) -> sp.Matrix:
        """All rows of a formulation, shape(n,)."""
        constraint = {
            "index3": lambda: [self.of.g],
            "index2": lambda: [self.first],
            "index1": lambda: [self.second],
            "ggl": lambda: [self.of.g, self.first],
            "baumgarte": lambda: [self.second + 2 * ALPHA * self.first + BETA**2 * self.of.g],
        }
        return sp.Matrix.vstack(self.positions(formulation), self.momenta, *constraint[formulation]())

    @property
    def multiplied(self) -> tuple[sp.Matrix, sp.Matrix]:
        """Linear system that fixes the multiplier: its unknowns z and its rows, each shape(k,).

        In velocities z = (v', lam) and the matrix is [[M, G^T], [G, 0]]; in momenta z = lam and it is -G H_pp G^T.
        """
        if self.of.mechanical:
            return sp.Matrix.vstack(self.w_rate, self.of.lam), sp.Matrix.vstack(self.momenta, self.second)
        return self.of.lam, self.second

    @property
    def slope(self) -> sp.Matrix:
        """Right side of (1.18) in terms of z, shape(2d,)."""
        if self.of.mechanical:
            return sp.Matrix.vstack(self.of.velocity, self.w_rate)
        return sp.Matrix.vstack(self.of.H_p, -self.of.H_q - self.of.G.T * self.of.lam)

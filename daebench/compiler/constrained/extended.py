"""Functions derived from a problem that depends on time or has forces without a potential: the same functions, in extended phase space."""

from collections.abc import Mapping, Sequence
from functools import cached_property
from typing import Any

import sympy as sp

from daebench.compiler.constrained.derivation import Derivation
from daebench.compiler.derived import Rules
from daebench.compiler.expressions import jacobian
from daebench.systems.constrained import ConstrainedHamiltonian
from daebench.systems.extended import extended, force


class ExtendedDerivation(Derivation):
    """The expressions of one problem with the time as last position, see :mod:`daebench.systems.extended`.

    The functions have the names and shapes of those of a Hamiltonian system, with d + 1 for d. Three of them have additional terms::

        H_p  (M^-1 p, 1)               the time has no mass and advances at the rate 1
        H_q  (H_q - F, H_t + F.v)      minus all forces at fixed p, including those without a potential
        T_q  (T_q + F, T_t - F.v)      for a mass matrix M that is not diagonal

    H itself is K = H + p_t. If M is given, w = (v, p_t) are the unknowns of the formulations, with the mass matrix (M, 1).
    """

    timed = 1

    def __init__(self, problem: ConstrainedHamiltonian) -> None:
        super().__init__(extended(problem))
        self.definition = self.declared = problem

    @property
    def forced(self) -> bool:
        """Whether there are forces without a potential."""
        return self.declared.force is not None

    def forces(self, p: Sequence[sp.Expr], velocity: Sequence[sp.Expr]) -> sp.Matrix:
        """Return (F, -F.v), the forces without a potential and minus their power, shape(d + 1,)."""
        return force(self.declared, p, velocity)

    @cached_property
    def H(self) -> sp.Expr:
        """K = H(p, q, t) + p_t as an expression, of an explicit problem."""
        if self.problem.H is not None:
            return sp.sympify(self.problem.H)
        return sum(self.p[i] ** 2 / self.M[i, i] for i in range(self.d - 1)) / 2 + self.U + self.p[self.d - 1]

    @cached_property
    def H_q(self) -> sp.Matrix:
        """Minus all forces at fixed p, K_q - (F, -F.v), shape(d + 1,)."""
        return super().H_q - force(self.declared, list(self.p), list(self.H_p))

    @cached_property
    def separable(self) -> bool:
        """Whether K = 1/2 p^T M^-1 p + p_t + U(q, t) with constant M, and the forces do not depend on the velocity."""
        if not self.explicit:
            return self.constant_mass and not self.T_q.free_symbols & set(self.v)
        return super().separable

    @property
    def in_time(self) -> str:
        """The reason, as part of a sentence, why time or forces keep a system from being separable; "" if they do not."""
        problem = self.declared
        rates = problem.M if problem.M is not None else sp.Matrix([problem.H]).jacobian(list(problem.p)).jacobian(list(problem.p))
        if self.separable or rates.free_symbols & {*problem.q, *problem.p}:
            return ""
        if problem.t in rates.free_symbols:
            return "depends on time, its masses too"
        return "has forces that depend on the velocity" if problem.force is not None else "depends on time where it depends on p"

    @cached_property
    def velocity(self) -> sp.Matrix:
        """Velocity (v, 1), shape(d + 1,); the last entry of the vector of symbols stands for p_t."""
        return sp.Matrix([*self.v[: self.d - 1], 1])

    def of_positions(self, x: sp.Matrix) -> sp.Matrix:
        """Return a vector with its entry for the time set to 0, shape(d + 1,); so have the momenta a last entry 0."""
        return sp.Matrix([*x[: self.d - 1], 0])

    @cached_property
    def T_q(self) -> sp.Matrix:
        """Derivative of 1/2 v^T M v with respect to q and t at fixed v, plus the forces without a potential, shape(d + 1,)."""
        T = (self.velocity.T * self.momenta)[0] / 2
        return jacobian([T], self.q).T + force(self.declared, list(self.momenta), list(self.velocity))

    @cached_property
    def coupled(self) -> list[list[int]]:
        """Sets of positions that M couples with each other. The time has no mass and is in no set."""
        return [indices for indices in super().coupled if self.d - 1 not in indices]

    @cached_property
    def inverse_mass(self) -> list[list[bool]]:
        """Pattern of the nonzero entries of H_pp, shape(d + 1, d + 1)."""
        known = super().inverse_mass
        return [[known[i][j] and self.d - 1 not in (i, j) for j in range(self.d)] for i in range(self.d)]

    @cached_property
    def damping(self) -> sp.Expr | None:
        """Rate c if F = -c p plus the gradient of a function of q and t, where c is a number or depends on parameters only; else None.

        Then the two-form contracts as exp(-c t). Any other force R(q, t) would change it by dR ^ dq.
        """
        if not self.forced:
            return None
        d, v = self.d - 1, list(self.velocity[: self.d - 1]) if self.mechanical else list(self.p[: self.d - 1])
        p = self.momenta if self.mechanical else self.p
        F = force(self.declared, list(p), list(self.velocity if self.mechanical else self.H_p))[:d]
        by_v, mass = jacobian(F, v), jacobian(p[:d], v)
        if mass[0, 0] == 0 or by_v == sp.zeros(d, d):
            return None
        rate = sp.simplify(-by_v[0, 0] / mass[0, 0])
        settled = not rate.free_symbols & {*self.q, *self.p, *self.v}
        if not settled or sp.simplify(by_v + rate * mass) != sp.zeros(d, d):
            return None
        rest = jacobian(sp.Matrix(F) + rate * sp.Matrix(p[:d]), self.q[:d])
        return rate if sp.simplify(rest - rest.T) == sp.zeros(d, d) else None

    @cached_property
    def constants(self) -> dict[str, bool | int]:
        """Constants of ``kernels/language.py`` that are known from the problem."""
        return super().constants | {"EXTENDED": True, "FORCED": self.forced}

    def facts(self) -> dict[str, Any]:
        """Return the facts of a constrained problem; D counts the time."""
        return super().facts() | {"EXTENDED": True, "FORCED": self.forced, "DAMPED": self.damping is not None, "IN_TIME": self.in_time}

    @cached_property
    def _rules(self) -> Rules:
        d = self.d
        pq = {"p": list(self.p), "q": list(self.q)}
        rules: Rules = super()._rules | {"rate_of_time": lambda: ({"q": list(self.q)}, [0] * (d - 1) + [1], (d,))}
        if self.damping is not None:
            time = sp.Dummy("time")
            values = [sp.sympify(self.damping), sp.exp(-self.damping * time) - 1]
            rules["damping"] = lambda: ({"q": list(self.q), "time": [time]}, values, (2,))
        if self.explicit:
            rules["H_pp_and_time"] = lambda: (pq, self.H_pp + sp.diag(*[0] * (d - 1), 1), (d, d))
        return rules

    @property
    def named(self) -> Mapping[str, tuple[str, str]]:
        """Functions that are attributes; see the base class."""
        return {**super().named, **({"H_pq": ("p q", "dd")} if self.explicit else {"T_qv": ("q v", "dd")})}

"""The largest step of a scheme at rest: up to where no small oscillation grows and the step can be made, by its derivative.

The derivative is by central differences: at rest Newton's iteration has converged before it begins, and would not carry a complex step.
Its rows and columns are the natural modes that oscillate, momenta in units in which each of them turns in a circle: a step that is stable
is close to a rotation there, whose eigenvalues are as accurate as its entries, however stiff others are. A direction without a restoring
force is left out. A step moves along it at constant velocity, which is a Jordan block of two ones and no growth, but round-off makes the
block's eigenvalues grow by its root.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from daebench.diagnostics.freedom import dependence
from daebench.errors import BadInput, DaebenchError
from daebench.methods.fixed_step.constrained import FixedStep
from daebench.methods.names import method_of
from daebench.runs.ivp import Array, ConstrainedIvp
from daebench.runs.request import Request
from daebench.studies.modes.equilibrium import largest

METHODS = ("symplectic_euler", "rattle", "lobatto3", "rk4", "local:gauss2", "implicit_euler")
"""Schemes that are looked at where none are given, and the problem has what they need."""

GROWS = 1e-6
"""A step that lets something grow by more than this part is not usable."""

CERTAIN = 4.0
"""Growth is beyond so many times what the derivative changes by where the differences are twice as wide."""

SMOOTH = 0.01
"""A step whose derivative changes by more than this part where the differences are twice as wide has none."""

SHIFT = 1e-5
"""Shift of the differences, in parts of the distance from rest to the start: they are off by its square, and by round-off over it."""

NEAREST = 0.01
"""That distance is at least this part of the largest position."""

MOST = 32.0
"""The largest step that is looked at, times the fastest frequency; who has no limit up to there is said to have none."""

LEAST = 0.05
"""The smallest."""

TRIED = 64
"""Steps between which a limit is looked for, from the smallest up."""

HALVINGS = 20
"""Of the interval in which it is."""


@dataclass(frozen=True)
class Oscillations:
    """The natural modes that oscillate at rest."""

    ivp: ConstrainedIvp
    """The problem."""
    q: Array
    """The position of rest; shape (d,)."""
    frequencies: Array
    """Their frequencies, 1/s, positive; shape (n,)."""
    shapes: Array
    """dq of each, largest entry 1; shape (n, d)."""
    momenta: Array
    """M dq of each; shape (n, d)."""

    @property
    def fastest(self) -> float:
        """The largest frequency, 1/s; 1 where nothing oscillates."""
        return float(np.max(self.frequencies, initial=0.0)) or 1.0

    @property
    def shift(self) -> float:
        """How far positions are moved for a difference."""
        return SHIFT * (max(largest(self.ivp.q0 - self.q), NEAREST * largest(self.q)) or 1.0)

    def step(self, name: str, h: float, width: float = 1.0) -> Array:
        """Return the derivative of one step, shape(2n, 2n), by differences of so many shifts."""
        flow, size = method_of(self.ivp, name).flow(self.ivp, h, 1), width * self.shift
        w, masses = self.frequencies[:, None], np.sum(self.shapes * self.momenta, axis=1)[:, None]

        def end(dp: Array, dq: Array) -> Array:
            p, q = (np.real(np.asarray(part)) for part in flow(tuple(dp), tuple(self.q + dq)))
            return np.concatenate([self.shapes @ p / (masses * w)[:, 0], self.momenta @ (q - self.q) / masses[:, 0]])

        def difference(dp: Array, dq: Array) -> Array:
            return np.asarray((end(size * dp, size * dq) - end(-size * dp, -size * dq)) / (2 * size))

        none = np.zeros(self.ivp.d)
        columns = [difference(x, none) for x in w * self.momenta] + [difference(none, x) for x in self.shapes]
        return np.array(columns).reshape(len(columns), len(columns)).T

    def grows(self, name: str, h: float) -> bool:
        """Return whether a step cannot be made or lets an oscillation grow by more than its derivative is uncertain."""
        try:
            matrix = self.step(name, h)
            if not np.all(np.isfinite(matrix)):
                return True
            if _radius(matrix) <= 1 + GROWS:
                return False
            return _surely_grows(matrix, self.step(name, h, width=2.0))
        except DaebenchError:
            return True

    def limit(self, name: str) -> float:
        """Return the largest step size with which nothing grows, s; infinite where there is none up to :data:`MOST`."""
        low = 0.0
        for high in np.geomspace(LEAST, MOST, TRIED).tolist():
            if self.grows(name, high / self.fastest):
                break
            low = high
        else:
            return float("inf")
        for _ in range(HALVINGS):
            middle = (low + high) / 2
            low, high = (low, middle) if self.grows(name, middle / self.fastest) else (middle, high)
        return low / self.fastest

    def obstacle(self, name: str) -> str | None:
        """Return why a method has no step at rest that can be differentiated, as a sentence, or None."""
        method = method_of(self.ivp, name)
        eliminates = isinstance(method, FixedStep) and method.on_singular(self.ivp, Request(value=1.0)) and not self.ivp.singular
        if eliminates and (dependent := dependence(self.ivp.at(self.ivp.p0, self.q))):
            return f"G M^-1 G^T is singular at rest, where {dependent}."
        try:
            narrow, wide = (self.step(name, LEAST / self.fastest, width) for width in (1.0, 2.0))
        except BadInput as error:
            return str(error)
        except DaebenchError:
            return None
        if not largest(wide - narrow) > SMOOTH * max(1.0, largest(narrow)):
            return None
        return f"a step of {name} is not smooth where {self.ivp.problem} is at rest, so no limit can be told there; leave the method out."


def _radius(matrix: Array) -> float:
    return largest(np.linalg.eigvals(matrix))


def _surely_grows(matrix: Array, wide: Array) -> bool:
    """Return whether an eigenvalue is beyond 1 by more than the change of the derivative moves it, to first order."""
    if not np.all(np.isfinite(wide)):
        return True
    values, right = np.linalg.eig(matrix)
    left = np.linalg.pinv(right)
    moved = np.abs(np.einsum("ij,jk,ki->i", left, wide - matrix, right))
    return bool(np.any(np.abs(values) > 1 + GROWS + CERTAIN * moved))


def require_usable(ivp: ConstrainedIvp, names: Sequence[str]) -> None:
    """Refuse methods that choose their steps themselves, and those that are not for the problem, before any work."""
    if why := next(filter(None, (_misfit(ivp, name) for name in names)), None):
        raise BadInput(why, "step-limit-unusable")


def usable_methods(ivp: ConstrainedIvp) -> tuple[str, ...]:
    """Return those of :data:`METHODS` that are for a problem."""
    return tuple(name for name in METHODS if not _misfit(ivp, name))


def _misfit(ivp: ConstrainedIvp, name: str) -> str | None:
    method = method_of(ivp, name)
    if method.knob != "h":
        return f"{name} chooses its steps by a tolerance, and has no step limit; name methods with a fixed step, for example rattle."
    why: str | None = method.refusal(ivp)
    return why


def usable_steps(about: Oscillations, names: Sequence[str]) -> tuple[dict[str, float], dict[str, str]]:
    """Return the step limits of methods, s, and of those that have no step at rest the reasons."""
    left_out = {name: why for name in names if (why := about.obstacle(name))}
    return {name: about.limit(name) for name in names if name not in left_out}, left_out

"""The Darboux-Lie theorem in numbers, by the steps of its proof: HLW VII.3, Theorems 3.3 and 3.4, in three dimensions.

The proof finds canonical coordinates of a Poisson system by solving linear partial differential equations along their characteristic
lines. In three dimensions there is one pair Q, P and one Casimir function C, and every line is a curve y(s) that ODE software follows:

1. Q = y_i, for a pair with b_ij(y0) not 0.
2. {Q, P} = 1, that is sum_k b_ik dP/dy_k = 1, grows P by s along the lines y' = (b_i1, b_i2, b_i3). On these y_i stays, for b_ii = 0, and
   y_j runs at the speed b_ij, so that each line meets the plane y_j = y0_j once. There P = 0.
3. {Q, C} = 0 and {P, C} = 0: C is constant along the same lines and along those of P. The two flows commute, by Lemma 3.2 and {Q, P} = 1,
   so that it does not matter in which order they are followed: first back to the plane. In the plane P = 0, and by (2) its gradient is
   (1/b_ij) e_j: the lines of P stay in the plane and are y' = (b_j1, b_j2, b_j3)/b_ij, along which y_i runs at the speed -1.
4. They lead to the points with y_i = y0_i and y_j = y0_j, a line on which y_k distinguishes them: C = y_k there.

Both times, a coordinate that runs evenly or at a known speed is the better variable than s: the end is then known beforehand.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from daebench.errors import BadInput
from daebench.systems.lazily import scipy
from daebench.systems.lazily import sympy as sp

if TYPE_CHECKING:
    from daebench.systems.poisson import PoissonSystem

Vector = NDArray[Any]

TOLERANCE = 1e-13
STEP = 1e-30
"""Complex step: its square is lost in rounding, so that derivatives are exact to it."""
SHRINK = 0.05
"""The neighbourhood ends where b_ij is less than this part of b_ij(y0)."""


@dataclass(frozen=True)
class DarbouxLie:
    """Canonical coordinates Q, P, C near a point, {Q, P} = 1 and {Q, C} = {P, C} = 0, each evaluated by following lines.

    Parameters
    ----------
    y0 : ndarray, shape(3,)
        The point, at which Q = y0_i, P = 0, C = y0_k.
    i, j, k : int
        Q = y_i; y_j runs along the lines of Q; y_k is the third coordinate.
    B : callable
        y -> B(y), shape(3, 3), for complex y too.
    domain : callable
        y -> the values that must be positive.
    names : tuple of str
        Names of the coordinates, for messages.
    """

    y0: Vector
    i: int
    j: int
    k: int
    B: Callable[[Vector], Vector]
    domain: Callable[[Vector], Vector]
    names: tuple[str, ...]

    def Q(self, y: ArrayLike) -> Any:
        """Return Q(y) = y_i."""
        return np.asarray(y)[self.i]

    def P(self, y: ArrayLike) -> Any:
        """Return P(y), the time along the line of Q from the plane y_j = y0_j to y.

        Raises
        ------
        BadInput
            If the line leaves the neighbourhood.
        """
        return self._to_plane(np.asarray(y))[1]

    def C(self, y: ArrayLike) -> Any:
        """Return C(y): y_k at the end of the line of Q to the plane and from there of the line of P to y_i = y0_i.

        Raises
        ------
        BadInput
            If one of the lines leaves the neighbourhood.
        """
        foot = self._to_plane(np.asarray(y))[0]

        def slope(x: Vector) -> tuple[Vector, Any]:
            B = self._regular(x)
            return -B[self.j] / B[self.i, self.j], 0

        return self._follow(foot, self.i, slope)[0][self.k]

    def brackets(self, y: ArrayLike) -> Vector:
        """Return the brackets of Q, P, C with each other at y, shape(3, 3): HLW (3.13) has [[0, 1, 0], [-1, 0, 0], [0, 0, 0]].

        The gradients are those of the numbers that Q, P and C return, by complex step.
        """
        y = np.asarray(y, dtype=float)
        moved = [y + 1j * STEP * e for e in np.eye(3)]
        gradients = np.imag([[F(x) for x in moved] for F in (self.Q, self.P, self.C)]) / STEP
        brackets: Vector = gradients @ self.B(y) @ gradients.T
        return brackets

    def defect(self, y: ArrayLike) -> float:
        """Return the largest difference of an entry of the brackets at y from that in HLW (3.13)."""
        return float(np.max(np.abs(self.brackets(y) - [[0, 1, 0], [-1, 0, 0], [0, 0, 0]])))

    def _to_plane(self, y: Vector) -> tuple[Vector, Any]:
        """Return the point in which the line of Q through y meets the plane y_j = y0_j, and the time P from there to y."""

        def slope(x: Vector) -> tuple[Vector, Any]:
            B = self._regular(x)
            return B[self.i] / B[self.i, self.j], 1 / B[self.i, self.j]

        foot, time = self._follow(y, self.j, slope)
        return foot, -time

    def _follow(self, y: Vector, m: int, slope: Callable[[Vector], tuple[Vector, Any]]) -> tuple[Vector, Any]:
        """Return the end of the line from y to y_m = y0_m, and the time along it, from its slopes with respect to y_m."""
        length = self.y0[m] - y[m]

        def right(_: float, x: Vector) -> Vector:
            along, time = slope(x[:3])
            rates: Vector = length * np.append(along, time)
            return rates

        # An absolute tolerance in the size of y0, because a coordinate may pass zero on the way.
        scale = TOLERANCE * (np.max(np.abs(self.y0)) or 1.0)
        # Complex from the start: SciPy takes the number type of the integration from that of the initial values.
        start = np.append(y, 0.0).astype(complex)
        solution = scipy.integrate.solve_ivp(right, (0, 1), start, method="DOP853", rtol=TOLERANCE, atol=scale)
        if not solution.success:
            raise BadInput(
                f"a line could not be followed to the plane of y0 ({solution.message.rstrip('.').lower()}); choose a point nearer to y0.",
                "darboux-line-lost",
            )
        end: Vector = solution.y[:, -1]
        return (end[:3], end[3]) if np.iscomplexobj(y) else (end[:3].real, end[3].real)

    def _regular(self, y: Vector) -> Vector:
        """Return B(y), or refuse a point where b_ij has all but vanished or that is outside the domain."""
        B = self.B(y)
        ratio = np.real(B[self.i, self.j] / self.B(self.y0)[self.i, self.j])
        if not ratio > SHRINK or not np.all(np.real(self.domain(y)) > 0):
            where = ", ".join(f"{name} = {value:.6g}" for name, value in zip(self.names, np.real(y), strict=True))
            pair = f"b_{self.i + 1}{self.j + 1}"
            raise BadInput(
                f"the lines leave the neighbourhood of y0 at {where}: there {pair} vanishes or the domain ends; choose a point nearer to "
                f"y0.",
                "darboux-lines-leave",
            )
        return B


def darboux_lie(system: "PoissonSystem", y0: ArrayLike) -> DarbouxLie:
    """Return canonical coordinates of a three-dimensional Poisson system near y0, as the proof of the Darboux-Lie theorem makes them.

    Parameters
    ----------
    system : PoissonSystem
        With n = 3, at the current values of its parameters.
    y0 : array_like, shape(3,)
        A point of its domain at which B is not zero. The pair i, j is that of the largest entry there.

    Raises
    ------
    BadInput
        If the system is not three-dimensional, y0 is not in its domain, or B(y0) = 0.
    """
    if system.n != 3:
        raise BadInput(
            f"the demonstration of the Darboux-Lie theorem is for three coordinates; this system has {system.n}.",
            "darboux-not-three-dimensional",
        )
    point = np.asarray(y0, dtype=float)
    if point.shape != (3,) or not np.all(np.isfinite(point)):
        raise BadInput("the point y0 must be three finite numbers.", "darboux-point-malformed")
    symbols, values = [*system.y, *system.parameters], list(system.parameters.values())
    entries, bounds = (sp.lambdify(symbols, part, "numpy") for part in (system.B.tolist(), list(system.domain)))
    if not np.all(np.array(bounds(*point, *values)) > 0):
        raise BadInput("the point y0 is outside the domain of the system; choose one inside.", "darboux-point-outside-domain")
    moduli = np.abs(np.array(entries(*point, *values)))
    # The largest entry of B: the lines run fastest along its pair, and 1/b_ij stays smallest.
    i, j = (int(index) for index in np.unravel_index(np.argmax(np.triu(moduli)), moduli.shape))
    if not moduli[i, j] > 0:
        raise BadInput(
            "B vanishes at y0, so every coordinate is a Casimir function there; choose a point of rank two.", "darboux-matrix-vanishes"
        )
    return DarbouxLie(
        y0=point,
        i=i,
        j=j,
        k=3 - i - j,
        B=lambda y: np.array(entries(*y, *values)),
        domain=lambda y: np.array(bounds(*y, *values)),
        names=tuple(str(symbol) for symbol in system.y),
    )

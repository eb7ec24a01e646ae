"""``daebench.shadow``: the modified energy that a symplectic scheme conserves, computed along its orbit."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Unpack

import numpy as np

from daebench.diagnostics.shadow import central_weights, shadow_hamiltonian
from daebench.draw.figures import drawing, grid_of_axes, legend_below
from daebench.draw.methods import curve_of
from daebench.errors import BadInput, RunFailed
from daebench.methods.fixed_step.constrained import FixedStep
from daebench.methods.initial_value_problem import initial_value_problem
from daebench.runs.ivp import Array, ConstrainedIvp
from daebench.runs.option import Option
from daebench.runs.own_start import OwnStart
from daebench.runs.request import Request
from daebench.runs.result import Result, Table
from daebench.systems.lazily import pandas as pd

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from daebench.runs.ivp import InitialValueProblem
    from daebench.systems.constrained import ConstrainedHamiltonian

ORDERS = (2, 4, 6, 8, 10, 12)
"""Orders where none are asked for."""

MOST_STEPS = 2_000_000
"""Most steps: all states are kept."""


@dataclass(frozen=True)
class Shadow(Result):
    """Energies along an orbit.

    Parameters
    ----------
    ivp : ConstrainedIvp
        The problem.
    method : str
        The scheme.
    h : float
        Its step size, s.
    derived : bool
        Whether the scheme has a shadow Hamiltonian; False for schemes that are shown for comparison.
    t : ndarray, shape(n + 1,)
        Times, s.
    H : ndarray, shape(n + 1,)
        The energy, J.
    shadows : mapping of int to ndarray
        The shadow Hamiltonian by order 2k, shape(n + 1 - 2k,), J, at the times t[k], ..., t[n - k].
    """

    ivp: ConstrainedIvp
    method: str
    h: float
    derived: bool
    t: Array
    H: Array
    shadows: Mapping[int, Array]

    stem: ClassVar[str] = "shadow"

    @property
    def ranges(self) -> dict[int, float]:
        """Range (largest minus smallest value) by order, J; that of the energy itself at 0."""
        return {0: float(np.ptp(self.H))} | {order: float(np.ptp(values)) for order, values in self.shadows.items()}

    def summary(self) -> dict[str, Any]:
        """Return the ranges, for JSON."""
        ranges = [{"order": order, "range": value} for order, value in self.ranges.items()]
        return {**self.posed, "method": self.method, "h": self.h, "t": float(self.t[-1]), "derived": self.derived, "ranges": ranges}

    def plot(self) -> "Figure":
        """Return a figure of the range of each shadow Hamiltonian by its order."""
        return Shadows((self,)).plot()

    @staticmethod
    def together(runs: "Sequence[Shadow]") -> "Shadows":
        """Return several as one result."""
        return Shadows(tuple(runs))


@dataclass(frozen=True)
class Shadows(Result):
    """Energies along the orbits of several schemes on one problem."""

    runs: tuple[Shadow, ...]

    stem: ClassVar[str] = "shadow"

    @property
    def ivp(self) -> ConstrainedIvp:
        """The problem."""
        return self.runs[0].ivp

    @property
    def table(self) -> "pd.DataFrame":
        """The ranges, a row a scheme and order."""
        ranges = ((run, order, value) for run in self.runs for order, value in run.ranges.items())
        return pd.DataFrame([{"method": run.method, "h": run.h, "order": order, "range": value} for run, order, value in ranges])

    def summary(self) -> dict[str, Any]:
        """Return the results, for JSON."""
        return {"runs": [run.summary() for run in self.runs]}

    def printed(self) -> Iterator[str | Table]:
        """Yield the ranges, a row an order, and which schemes have no shadow Hamiltonian."""
        first = self.runs[0]
        yield f"{self.ivp.problem}, case {self.ivp.case}, h = {first.h:g}, to t = {first.t[-1]:g}: range (maximum - minimum) by order"
        rows = [["energy" if order == 0 else str(order), *(f"{run.ranges[order]:.3g}" for run in self.runs)] for order in first.ranges]
        yield Table(["order", *(run.method for run in self.runs)], rows)
        for run in self.runs:
            if not run.derived:
                yield f"{run.method} does not claim to be symplectic on the manifold: it has no shadow Hamiltonian, and is for comparison."

    def plot(self) -> "Figure":
        """Return a figure of the range of each shadow Hamiltonian by its order, a curve a scheme."""
        with drawing():
            figure, axes = grid_of_axes(
                1, 1, 4.2, x="order of the shadow Hamiltonian; 0 is the energy itself", y="largest less smallest value"
            )
            for run in self.runs:
                ranges = {order: value for order, value in run.ranges.items() if value > 0}
                axes[0, 0].plot(list(ranges), list(ranges.values()), **curve_of(run.method))
            first = self.runs[0]
            axes[0, 0].set(yscale="log", title=f"{self.ivp.problem}, h = {first.h:g}, to t = {first.t[-1]:g}")
            legend_below(figure, axes[0, 0], 3)
        return figure


def shadow(
    problem: "str | ConstrainedHamiltonian | InitialValueProblem",
    *,
    method: Annotated[str, Option(several=True)],
    h: float,
    t_end: float,
    case: str | None = None,
    parameters: Mapping[str, float] | None = None,
    orders: Sequence[int] = ORDERS,
    compare: bool = False,
    on_singular: str | None = None,
    **start: Unpack[OwnStart],
) -> Shadow:
    """Compute the shadow Hamiltonian along the orbit of a scheme: the modified energy that it conserves, to increasing order.

    If a scheme keeps the two-form and its step resolves the motion, the range decreases by orders of magnitude with the order, down to
    round-off::

        >>> import daebench
        >>> energies = daebench.shadow("spherical_pendulum", method="rattle", h=0.05, t_end=5, orders=[8])
        >>> energies.ranges[0] > 1e-6, energies.ranges[8] < 1e-12
        (True, True)

    Parameters
    ----------
    problem : str, ConstrainedHamiltonian or InitialValueProblem
        Name in the catalogue, the path of a problem file, which is executed, a definition, or an initial value problem.
    method : str
        rattle, shake, symplectic_euler or symplectic_euler_adjoint.
    h : float
        Step size, s.
    t_end : float
        End time, s.
    case : str, optional
        Named initial values; by default the problem's first.
    parameters : mapping of str to float, optional
        Values of the problem's parameters.
    orders : sequence of int
        Even orders from 2 to 24.
    compare : bool
        Allow se, seproj and midpoint on the index-reduced equation for comparison, although they have no shadow Hamiltonian.
    on_singular : str, optional
        What to do where G loses rank: "stop", "continue" or "least-squares"; by default what the case declares.
    **start : OwnStart
        A start of one's own in place of the case's: q0, p0, v0, y0 and project, as for :func:`daebench.initial_value_problem`.

    Returns
    -------
    Shadow

    Raises
    ------
    BadInput
        If the scheme has no derivation, H is not quadratic in p, there is no energy to keep, or there are fewer steps than the order.
    RunFailed
        If the scheme does not reach the end.
    """
    actions = actions_of(method, compare=compare)
    ivp = initial_value_problem(problem, case, parameters, on_singular=on_singular, **start)
    if not ivp.on_manifold or ivp.arrays or ivp.facts.EXTENDED or ivp.facts.FORCED or not ivp.facts.QUADRATIC:
        raise BadInput(
            f"a shadow Hamiltonian needs a constrained system of at most 24 positions with constant energy that is quadratic in p, "
            f"and {ivp.problem} is not such a system.",
            "shadow-system-unsuitable",
        )
    for order in orders:
        central_weights(order)
    request = Request(value=h, t_end=t_end, every=1, watch=())
    stepper = FixedStep(method)
    stepper.check(ivp, request)
    if t_end / h > MOST_STEPS:
        raise BadInput(
            f"{t_end / h:.3g} steps are more than {MOST_STEPS}, the largest number of stored states; ask for a shorter run.",
            "shadow-too-many-steps",
        )
    run = stepper.solve(ivp, request)
    if run.failure is not None:
        raise RunFailed(run.failure, "shadow-run-failed")
    S = actions(ivp, run.p, run.q, h)
    shadows = {order: shadow_hamiltonian(run.p, run.q, S, h, order) for order in orders}
    return Shadow(ivp, method, h, method in DERIVED, run.t, np.asarray(ivp.along("H", run.p, run.q)), shadows)


Actions = Callable[[ConstrainedIvp, Array, Array, float], Array]
"""A function of problem, p, q, shape(n + 1, d), and h that returns the actions of the n steps."""


def verlet(ivp: ConstrainedIvp, p: Array, q: Array, h: float) -> Array:
    """Return S = P^T (q1 - q0) - h/2 (H(P, q0) + H(P, q1)) of RATTLE and SHAKE, HLW (1.26), with P = p_half.

    P solves q1 - q0 = h/2 (H_p(P, q0) + H_p(P, q1)). It is found from the positions, and differs from the scheme's by G^T mu at most,
    which dq does not see.
    """
    inverse, shift = ivp.along("H_pp", p, q), ivp.along("H_p", 0 * p, q)
    dq = np.diff(q, axis=0)
    P = momenta(inverse[:-1] + inverse[1:], 2 * dq / h - shift[:-1] - shift[1:])
    return np.asarray(np.sum(P * dq, axis=1) - h / 2 * (ivp.along("H", P, q[:-1]) + ivp.along("H", P, q[1:])))


def euler(ivp: ConstrainedIvp, p: Array, q: Array, h: float) -> Array:
    """Return S = P^T (q1 - q0) - h H(P, q0) of symplectic Euler, HLW (1.19), with P = p1 before the projection (1.20)."""
    return _euler(ivp, p, q, h, q[:-1])


def euler_adjoint(ivp: ConstrainedIvp, p: Array, q: Array, h: float) -> Array:
    """Return S = P^T (q1 - q0) - h H(P, q1) of the adjoint of symplectic Euler."""
    return _euler(ivp, p, q, h, q[1:])


def _euler(ivp: ConstrainedIvp, p: Array, q: Array, h: float, at: Array) -> Array:
    dq = np.diff(q, axis=0)
    P = momenta(ivp.along("H_pp", p[1:], at), dq / h - ivp.along("H_p", 0 * at, at))
    return np.asarray(np.sum(P * dq, axis=1) - h * ivp.along("H", P, at))


def midpoint(ivp: ConstrainedIvp, p: Array, q: Array, h: float) -> Array:
    """Return S = P^T (q1 - q0) - h H(P, Q) of the midpoint rule, with the means P of momenta and Q of positions."""
    P, Q = (p[1:] + p[:-1]) / 2, (q[1:] + q[:-1]) / 2
    return np.asarray(np.sum(P * np.diff(q, axis=0), axis=1) - h * ivp.along("H", P, Q))


def momenta(inverse: Array, velocity: Array) -> Array:
    """Return p with H_pp p = v, where v is the velocity less that of p = 0; ``inverse`` has H_pp for each, shape(n, d, d)."""
    full = np.broadcast_to(inverse, (len(velocity), *inverse.shape[-2:]))
    return np.asarray(np.linalg.solve(full, velocity[..., None])[..., 0])


DERIVED: dict[str, Actions] = {"rattle": verlet, "shake": verlet, "symplectic_euler": euler, "symplectic_euler_adjoint": euler_adjoint}
"""Schemes whose shadow Hamiltonian can be computed from their orbits."""

COMPARED: dict[str, Actions] = {"se": euler, "seproj": euler, "midpoint": midpoint}
"""Schemes on the index-reduced equation (1.18): the action is that of the scheme on a Hamiltonian system, which (1.18) is not."""

REASONS = {
    "lobatto": "its action needs the stages of each step, which an orbit does not have",
    "gauss": "its action needs the stages of each step, which an orbit does not have",
    "strang": "its action needs the states between its flows, which an orbit does not have",
    "lie": "its action needs the states between its flows, which an orbit does not have",
}
"""Why there is no derivation, by the beginning of a name."""


def actions_of(method: str, *, compare: bool) -> Actions:
    """Return the function that gives a scheme's actions; refuse a scheme without one in a sentence that says why."""
    if method in DERIVED:
        return DERIVED[method]
    if method in COMPARED:
        if compare:
            return COMPARED[method]
        reason = "it is not symplectic on the constraint manifold; --compare computes the same quantity for comparison"
    elif "/" in method:
        reason = "a composition has states within its step that an orbit does not have"
    else:
        reason = next((words for start, words in REASONS.items() if method.startswith(start)), "no action of its step is known")
    raise BadInput(f"{method} has no shadow Hamiltonian here: {reason}. Those of {', '.join(DERIVED)} are known.", "method-without-shadow")

"""``daebench.shadow``: the modified energy that a scheme conserves."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from daebench.diagnostics.shadow import central_weights, shadow_hamiltonian
from daebench.errors import BadInput, RunFailed
from daebench.methods.fixed_step.constrained import FixedStep
from daebench.methods.initial_value_problem import initial_value_problem
from daebench.runs.ivp import Array, ConstrainedIvp
from daebench.runs.notebook import Shown
from daebench.runs.request import Request
from daebench.studies.shadow.actions import DERIVED, actions_of

if TYPE_CHECKING:
    from daebench.runs.ivp import InitialValueProblem
    from daebench.systems.constrained import ConstrainedHamiltonian

ORDERS = (2, 4, 6, 8, 10, 12)
"""Orders where none are asked for."""

MOST_STEPS = 2_000_000
"""Most steps: all states are kept."""


@dataclass(frozen=True)
class Shadow(Shown):
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

    drawn_by: ClassVar[str] = "daebench.studies.shadow.figure"

    @property
    def ranges(self) -> dict[int, float]:
        """Range (largest minus smallest value) by order, J; that of the energy itself at 0."""
        return {0: float(np.ptp(self.H))} | {order: float(np.ptp(values)) for order, values in self.shadows.items()}

    def summary(self) -> dict[str, Any]:
        """Return what was found, for JSON."""
        about = {"problem": self.ivp.problem, "case": self.ivp.case, "parameters": dict(self.ivp.parameters), "method": self.method}
        ranges = [{"order": order, "range": value} for order, value in self.ranges.items()]
        return about | {"h": self.h, "t": float(self.t[-1]), "derived": self.derived, "ranges": ranges}


def shadow(
    problem: "str | ConstrainedHamiltonian | InitialValueProblem",
    *,
    method: str,
    h: float,
    t_end: float,
    case: str | None = None,
    parameters: Mapping[str, float] | None = None,
    orders: Sequence[int] = ORDERS,
    compare: bool = False,
    on_singular: str | None = None,
) -> Shadow:
    """Return the shadow Hamiltonian along the orbit of a scheme: the Hamiltonian of the system that the orbit solves exactly.

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
    h, t_end : float
        Step size and end time, s.
    case : str, optional
        Named initial values; by default the problem's first.
    parameters : mapping of str to float, optional
        Values of the problem's parameters.
    orders : sequence of int
        Even orders from 2 to 24.
    compare : bool
        Whether se, seproj and midpoint on the index-reduced equation are allowed for comparison, although they have no shadow Hamiltonian.
    on_singular : str, optional
        What to do where G loses rank: "stop", "continue" or "least-squares"; by default what the case declares.

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
    ivp = initial_value_problem(problem, case, parameters, on_singular=on_singular)
    if not ivp.on_manifold or ivp.arrays or ivp.facts.EXTENDED or ivp.facts.FORCED or not ivp.facts.QUADRATIC:
        raise BadInput(
            f"a shadow Hamiltonian needs a constrained system of at most 24 positions with constant energy that is quadratic in p, "
            f"and {ivp.problem} is not such a system."
        )
    for order in orders:
        central_weights(order)
    request = Request(value=h, t_end=t_end, every=1, watch=())
    stepper = FixedStep(method)
    stepper.check(ivp, request)
    if t_end / h > MOST_STEPS:
        raise BadInput(f"{t_end / h:.3g} steps are more than {MOST_STEPS}, the largest number of stored states; ask for a shorter run.")
    run = stepper.solve(ivp, request)
    if run.failure is not None:
        raise RunFailed(run.failure)
    S = actions(ivp, run.p, run.q, h)
    shadows = {order: shadow_hamiltonian(run.p, run.q, S, h, order) for order in orders}
    return Shadow(ivp, method, h, method in DERIVED, run.t, np.asarray(ivp.along("H", run.p, run.q)), shadows)

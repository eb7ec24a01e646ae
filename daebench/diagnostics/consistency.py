"""Consistent initial values: whether a start is on the manifold, and the nearest one that is."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from daebench.diagnostics.contradiction import contradiction
from daebench.diagnostics.inverse_mass import mass
from daebench.diagnostics.manifold import residual_scales
from daebench.diagnostics.nearest import EPS, ITERATIONS, nearest
from daebench.errors import BadInput, InconsistentStart
from daebench.runs.ivp import Array, ConstrainedIvp
from daebench.runs.scales import constrained_scales

Conditions = Callable[[Array], tuple[Array, Array]]

ROUNDINGS = 8.0
"""Roundings of q in the shortest time of a motion that its velocity may be off."""

TOLERANCE = 1e-12
"""Largest residual of a consistent start, relative to its change under a relative change of one in p and q."""


def consistency(ivp: ConstrainedIvp) -> tuple[float, float]:
    """Return the largest |g| and the largest |G H_p| of the initial values.

    Parameters
    ----------
    ivp : ConstrainedIvp
        The problem with its numbers.

    Returns
    -------
    g, Gv : float
        Largest modulus over the m components of g(q0), and of G H_p at (p0, q0), HLW (1.9), (1.11), in their units.

    Examples
    --------
    >>> import daebench
    >>> ivp = daebench.initial_value_problem("planar_pendulum", q0=[2.0, 0.0], p0=[0.0, 1.0], consistent=False)
    >>> consistency(ivp)
    (3.0, 0.0)
    """
    p, q = tuple(ivp.p0), tuple(ivp.q0)
    g, Gv = ivp.value("g", q), ivp.value("Gv", p, q)
    return float(np.max(np.abs(g), initial=0.0)), float(np.max(np.abs(Gv), initial=0.0))


def require_consistent(ivp: ConstrainedIvp, *, tolerance: float = TOLERANCE) -> None:
    """Accept initial values that are on the manifold up to rounding.

    The residuals are measured against :func:`daebench.diagnostics.manifold.residual_scales`, so that units do not matter.

    Parameters
    ----------
    ivp : ConstrainedIvp
        The problem with its numbers and initial values.
    tolerance : float
        Largest relative residual.

    Raises
    ------
    BadInput
        If a residual is not a finite number.
    InconsistentStart
        If a residual is larger; the message gives both and offers ``--project``.
    """
    with np.errstate(all="ignore"):
        g, Gv = consistency(ivp)
    if not np.isfinite(g + Gv):
        raise BadInput(
            f"the constraints of {ivp.problem}, case {ivp.case}, cannot be evaluated at the initial values: |g| = {g:.3g} and "
            f"|G H_p| = {Gv:.3g}; check the parameters, and that the mass matrix is regular there.",
            "start-not-evaluable",
        )
    g_most, Gv_most = allowed(ivp, tolerance)
    # Before the offer of --project, which cannot help if no positions satisfy the constraints.
    if not g <= g_most and (why := contradiction(ivp)):
        raise BadInput(why, "constraints-contradict")
    if not (g <= g_most and Gv <= Gv_most):
        worst = {name: _largest(ivp, name) for name in ("g", "Gv")}
        raise InconsistentStart(
            f"the initial values of {ivp.problem}, case {ivp.case}, are off the constraint manifold: |g| = {g:.3g}{worst['g']} and "
            f"|G H_p| = {Gv:.3g}{worst['Gv']}; correct them, or add --project to move them to the nearest consistent ones.",
            "off-the-manifold",
        )


def allowed(ivp: ConstrainedIvp, tolerance: float = TOLERANCE) -> tuple[float, float]:
    """Return the largest |g| and |G H_p| of a consistent start.

    They are parts of :func:`daebench.diagnostics.manifold.residual_scales`. A velocity is allowed some roundings of q in the shortest time
    of the motion too, without which a start that is nearly at rest would have to be consistent to much less than a rounding.

    Parameters
    ----------
    ivp : ConstrainedIvp
        The problem with its numbers and initial values.
    tolerance : float
        Largest relative residual.
    """
    g_scale, Gv_scale = residual_scales(ivp, ivp.p0, ivp.q0)
    length, rate = constrained_scales(ivp, 0.0, rated=True)
    # The slope of g per unit of position: it turns an allowed rounding of q into one of g, and with a rate into one of G v.
    steepness = g_scale / (float(np.max(np.abs(ivp.q0))) or 1.0)
    return tolerance * g_scale, max(tolerance * Gv_scale, ROUNDINGS * EPS * steepness * length * rate)


def _largest(ivp: ConstrainedIvp, name: str) -> str:
    """Return the constraint with the largest residual that is not zero, if there are several constraints."""
    values = np.abs(ivp.value(name, ivp.q0) if name == "g" else ivp.value(name, ivp.p0, ivp.q0))
    return f" ({ivp.named(int(np.argmax(values)))})" if ivp.m > 1 and np.max(values) > 0 else ""


def project(ivp: ConstrainedIvp, p: ArrayLike, q: ArrayLike) -> tuple[Array, Array, float, float]:
    """Return the consistent state nearest to a given one: positions first, then momenta.

    ::

        q1 = q + dq,   g(q1) = 0,               dq^T M dq least,      M = M(q)
        p1 = p + dp,   G(q1) H_p(p1, q1) = 0,   dp^T M^-1 dp least,   M = M(q1)

    Each is iterated until its increment is at round-off.

    Parameters
    ----------
    ivp : ConstrainedIvp
        The problem with its numbers.
    p, q : array_like, shape(d,)
        Momenta and positions.

    Returns
    -------
    p, q : ndarray, shape(d,)
        The consistent state.
    moved_q, moved_p : float
        Distances moved: sqrt(dq^T M dq) and sqrt(dp^T M^-1 dp).

    Raises
    ------
    BadInput
        If an iteration does not converge: the start is too far from the manifold, or G loses rank on the way.

    Examples
    --------
    >>> import daebench
    >>> ivp = daebench.initial_value_problem("planar_pendulum")
    >>> p, q, moved_p, moved_q = project(ivp, [1.0, 1.0], [2.0, 0.0])
    >>> q.round(12).tolist(), p.round(12).tolist()
    ([1.0, 0.0], [0.0, 1.0])
    """
    p0, q0 = np.array(p, dtype=float), np.array(q, dtype=float)
    M, H_pp = _metric(ivp, p0, q0)
    length, _ = constrained_scales(replace(ivp, p0=p0, q0=q0), 0.0, rated=False)
    q1 = _nearest(f"positions of {ivp.problem}", lambda x: (ivp.value("g", tuple(x)), ivp.value("G", tuple(x))), q0, H_pp, length)
    moved_q = float(np.sqrt((q1 - q0) @ M @ (q1 - q0)))
    # Positions first, then momenta at the new ones: each problem is smaller, and momenta never have to correct positions.
    M, H_pp = _metric(ivp, p0, q1)
    end = tuple(q1)
    p1 = _nearest(f"momenta of {ivp.problem}", lambda x: (ivp.value("Gv", tuple(x), end), ivp.value("Gv_p", tuple(x), end)), p0, M)
    return p1, q1, moved_q, float(np.sqrt((p1 - p0) @ H_pp @ (p1 - p0)))


def projected(ivp: ConstrainedIvp) -> tuple[ConstrainedIvp, float, float]:
    """Return the problem with its initial values projected by :func:`project`, and the distances moved in positions and momenta.

    Parameters
    ----------
    ivp : ConstrainedIvp
        The problem with its numbers.

    Returns
    -------
    ivp : ConstrainedIvp
        The same with consistent initial values.
    moved_q, moved_p : float
        Length of the change of q in the metric M, and of that of p in M^-1.

    Raises
    ------
    BadInput
        If the projection does not converge, as where constraints contradict each other, or vectors are arrays, which have no projection.
    """
    if ivp.arrays:
        raise BadInput(
            f"initial values of {ivp.problem} with {ivp.facts.NODES} nodes cannot be projected; give consistent ones, or fewer nodes.",
            "too-many-nodes-to-project",
        )
    try:
        p0, q0, moved_q, moved_p = project(ivp, ivp.p0, ivp.q0)
    except BadInput as failed:
        raise (BadInput(why, "constraints-contradict") if (why := contradiction(ivp)) else failed) from None
    return replace(ivp, p0=p0, q0=q0), moved_q, moved_p


def _metric(ivp: ConstrainedIvp, p: Array, q: Array) -> tuple[Array, Array]:
    """Return M and M^-1 at a state."""
    return mass(ivp, p, q), ivp.value("H_pp", tuple(p), tuple(q))


def _nearest(what: str, conditions: Conditions, x0: Array, W: Array, least: float = 0.0) -> Array:
    """Return the x nearest to x0 in the metric W^-1 that satisfies the conditions, given with their Jacobian at x."""

    def of_one(x: Array, rows: NDArray[np.intp]) -> tuple[Array, Array]:
        residual, C = conditions(x[0])
        return residual[None], C[None]

    x, increment, met = nearest(of_one, x0[None], W[None], np.array([least]))
    if met[0]:
        return np.asarray(x[0], dtype=float)
    last = f"the last increment is {increment[0]:.3g}" if np.isfinite(increment[0]) else "G loses rank on the way"
    raise BadInput(
        f"the {what} cannot be projected onto the constraints: after {ITERATIONS} iterations at most, "
        f"{last}; give initial values nearer to consistent ones.",
        "projection-did-not-converge",
    )

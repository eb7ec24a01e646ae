"""The members of an ensemble moved to the nearest consistent starts, all at once."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from daebench.diagnostics.nearest import nearest
from daebench.errors import BadInput
from daebench.runs.ivp import Array
from daebench.runs.members import Members
from daebench.runs.scales import constrained_scales_of


@dataclass(frozen=True)
class ProjectedMembers:
    """Members with starts on their manifolds, except those whose projection did not converge.

    Parameters
    ----------
    members : Members
        The members.
    moved_q, moved_p : ndarray, shape(n,)
        How far each was moved: sqrt(dq^T M dq) and sqrt(dp^T M^-1 dp).
    met : ndarray of bool, shape(n,)
        Whether the projection converged.
    """

    members: Members
    moved_q: Array
    moved_p: Array
    met: NDArray[np.bool_]


def project_members(members: Members) -> ProjectedMembers:
    """Return members with the start of each projected onto its manifold, as :func:`daebench.diagnostics.consistency.project` does one.

    Where parameters differ from member to member, so do the manifolds.

    Parameters
    ----------
    members : Members
        Members of a constrained problem, off the manifold.

    Raises
    ------
    BadInput
        If vectors are arrays, which have no projection.
    """
    if members.ivp.arrays:
        raise BadInput(
            f"initial values of {members.ivp.problem} with {members.ivp.facts.NODES} nodes cannot be projected; "
            "give consistent ones, or fewer nodes.",
            "too-many-nodes-to-project",
        )
    p0, q0 = members.start
    M, H_pp = members.along("mass", p0, q0), members.along("H_pp", p0, q0)
    # h = 0: the length of the problem without the length of a step, as ``project`` takes it for a single start.
    length, _ = constrained_scales_of(replace(members, h=0.0), rated=False)

    def on_positions(q: Array, rows: NDArray[np.intp]) -> tuple[Array, Array]:
        unmet = members.some(rows)
        return unmet.along("g", q), unmet.along("G", q)

    q1, _, met = nearest(on_positions, q0, H_pp, length)
    moved_q = _length(q1 - q0, M)
    M, H_pp = members.along("mass", p0, q1), members.along("H_pp", p0, q1)

    def on_momenta(p: Array, rows: NDArray[np.intp]) -> tuple[Array, Array]:
        unmet = members.some(rows)
        return unmet.along("Gv", p, q1[rows]), unmet.along("Gv_p", p, q1[rows])

    p1, _, also_met = nearest(on_momenta, p0, M, np.zeros(len(p0)))
    return ProjectedMembers(replace(members, start=(p1, q1)), moved_q, _length(p1 - p0, H_pp), met & also_met)


def _length(x: Array, metric: Array) -> Array:
    return np.asarray(np.sqrt(np.einsum("ni,nij,nj->n", x, metric, x)), dtype=float)


def require_projected(projected: ProjectedMembers, what: str) -> Members:
    """Return the members, all of whose projections have converged.

    Parameters
    ----------
    projected : ProjectedMembers
        The result of :func:`project_members`.
    what : str
        The set of starts, for example "a neighbourhood of size 0.1".

    Raises
    ------
    BadInput
        If some have not: their number, the first of them, and the advice.
    """
    lost = np.flatnonzero(~projected.met)
    if len(lost):
        ivp = projected.members.ivp
        raise BadInput(
            f"{len(lost)} of {len(projected.met)} starts of {what} of {ivp.problem} cannot be projected onto the constraints, the first of "
            f"them that of member {lost[0]}: they are too far from the manifold, or G loses rank there; stay nearer to consistent starts.",
            "starts-not-projectable",
        )
    return projected.members

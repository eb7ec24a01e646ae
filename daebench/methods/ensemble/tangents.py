"""Growth of tangent vectors along the members of an ensemble, by the tangent map of the scheme."""

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from daebench.compiler.under_way import uncollected
from daebench.diagnostics.manifold import constraint_jacobian
from daebench.errors import BadInput
from daebench.methods.fixed_step.base import FixedStepMethod
from daebench.methods.fixed_step.dual_kernel import seeds
from daebench.methods.fixed_step.reasons import IN_SHORT
from daebench.methods.fixed_step.stepping import Linked
from daebench.runs.directions import Directions, require_tuples
from daebench.runs.ivp import Ivp
from daebench.runs.machine import cores
from daebench.runs.members import Members
from daebench.runs.request import Progress, Request
from daebench.runs.trajectory import Array
from daebench.schemes.kernels.newton import UNSETTLED
from daebench.schemes.kernels.rank import RANK_LOST


@dataclass(frozen=True)
class TangentGrowth:
    """Growth of one tangent vector along each of n members, in k intervals of equal length.

    Parameters
    ----------
    growth : ndarray, shape(n, k)
        Logarithm of the growth of the vector in each interval; NaN in intervals that a member did not complete.
    interval : float
        Length of an interval, s.
    status : ndarray of int, shape(n,)
        0 if a member reached its end.
    sentence : callable
        ``sentence(i)`` says why a member stopped.
    """

    growth: Array
    interval: float
    status: NDArray[np.int64]
    sentence: Callable[[int], str] = field(repr=False)

    def reason(self, i: int) -> str:
        """Return why a member stopped in two or three words; "" if it reached its end."""
        return IN_SHORT.get(int(self.status[i]), "stopped") if self.status[i] else ""


def tangent_growth(
    method: FixedStepMethod[Any, Any],
    members: Members,
    vectors: Array,
    units: Array,
    *,
    every: int,
    intervals: int,
    threads: int | None = None,
    progress: Progress | None = None,
) -> TangentGrowth:
    """Return the growth of a tangent vector along each member: the derivative of each step is applied to it, exact to round-off.

    ::

        v_0 = v,     w = Phi_h'(x_n) v_n,     v_(n+1) = w,     and after each interval   growth = log |w|,   v = w / |w|

    The members are run in dual numbers, one after another on each core.

    Parameters
    ----------
    method : FixedStepMethod
        The method.
    members : Members
        Starts, with one common step size and common parameters.
    vectors : ndarray, shape(n, c)
        The vectors, tangent to the manifold, in the order in which a state is stored.
    units : ndarray, shape(c,)
        Factors of the entries of a vector in its Euclidean length.
    every : int
        Number of steps of an interval.
    intervals : int
        Number of intervals.
    threads : int, optional
        Number of cores. The default is all cores.
    progress : callable, optional
        Called with the fraction done.

    Raises
    ------
    BadInput
        If the method refuses the problem, or its steps have no derivative.
    """
    ivp = members.ivp
    if refusal := method.refusal(ivp):
        raise BadInput(refusal, "tangents-refused")
    require_tuples(method.name, ivp)
    if not method.compiled or members.parameters or np.ndim(members.h):
        raise BadInput(
            "tangent vectors need members with one step size and the same parameters, and a compiled kernel.", "tangents-members-differ"
        )
    mode = method.on_singular(ivp, Request(value=members.h))
    kernel = method.kernel(ivp, "tangent1", (), count=False, singular=mode)
    pivots = (np.inf, 0.0, 0.0) if mode else np.inf
    growth, ends = np.full((len(members), intervals), np.nan), np.zeros((len(members), 6))
    h = float(members.h)

    def one(i: int) -> None:
        member = members.member(i)
        ends[i] = _grown(method.linked(member, kernel, h), member, vectors[i], h, units, every, pivots, growth[i])
        if progress:
            progress((i + 1) / len(members))

    with uncollected():
        one(0)  # compiled once, before there are threads
        with ThreadPoolExecutor(threads or cores()) as pool:
            try:
                list(pool.map(one, range(1, len(members))))
            except BaseException:
                pool.shutdown(cancel_futures=True)
                raise

    def sentence(i: int) -> str:
        member, (before, after, tried, status, *numbers) = members.member(i), ends[i]
        done = int(before * every + after)
        if status == RANK_LOST:
            return f"{method.name} on {ivp.problem}, case {ivp.case}, stopped at t = {done * h:.9g}: G loses rank there; start elsewhere."
        linked = method.linked(member, kernel, h)
        return linked.failure(member, h, done, every * intervals, int(tried), (int(status), *numbers))

    return TangentGrowth(growth, every * h, ends[:, 3].astype(np.int64), sentence)


def tangent_vectors(members: Members, units: Array, seed: int) -> Array:
    """Return a vector tangent to the manifold at each start, of random direction and length 1 in these units, shape(n, c)."""
    v = np.random.default_rng(seed).standard_normal((len(members), len(units))) / units
    if members.ivp.on_manifold:
        C = constraint_jacobian(members.ivp, *members.start) / units
        size = np.linalg.norm(C, axis=2, keepdims=True)
        normals = np.linalg.pinv(C / np.where(size > 0, size, 1.0)) @ (C / np.where(size > 0, size, 1.0))
        v = (v * units - np.einsum("nij,nj->ni", normals, v * units)) / units
    return np.asarray(v / np.linalg.norm(v * units, axis=1, keepdims=True), dtype=float)


def _grown(linked: Linked, ivp: Ivp, vector: Array, h: float, units: Array, every: int, pivots: Any, growth: Array) -> tuple[float, ...]:
    """Fill the growth of one member; return the intervals done, the steps after these, those tried, and status, residual and pivot."""
    direction = Directions({}, np.zeros((len(ivp.par), 1)), vector[:, None], np.ones(1))
    begin = seeds(ivp, direction, lambda moved: linked.enter, len(linked.par) - len(ivp.par))
    parts = typed(tuple(ivp.vectors(units)))
    empty = np.empty((0, ivp.size)), np.empty((1, 0, ivp.size))
    with np.errstate(all="ignore"):
        done, after, tried, status, *numbers = linked.kernel.integrate_tangent(
            typed(linked.enter(ivp.start)),
            pivots,
            h,
            linked.weights,
            every,
            typed(linked.par),
            begin.x,
            parts if len(parts) > 1 else parts[0],
            empty,
            growth,
        )
    return done, after, tried, UNSETTLED if done < len(growth) and not status else status, *numbers


def typed(x: Any) -> Any:
    """Return a nested tuple of Python's numbers."""
    return tuple(map(typed, x)) if isinstance(x, tuple) or np.ndim(x) else float(x)

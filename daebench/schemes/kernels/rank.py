"""The rank of G along a run: its measure, and a test for its loss within the next step."""

from typing import Any

from daebench.schemes.kernels.language import RANK_WATCHED, SINGLE, G, rows, solve, zero
from daebench.schemes.kernels.spaces import Number, Vector

RANK_LOST = 7

if SINGLE:

    def independence(p: Vector, q: Vector) -> Number:
        """Return |G H_pp G^T| of one constraint: its relative pivot is always 1, and carries no information."""
        G0 = G(q)
        # Not in parts of |G|^2: a single constraint loses rank only where its gradient goes to zero.
        return abs((G0 @ rows(G0, p, q).T)[0][0])

else:

    def independence(p: Vector, q: Vector) -> Number:
        """Return the smallest relative pivot of G H_pp G^T."""
        G0 = G(q)
        return solve(G0 @ rows(G0, p, q).T, zero(q))[1]


if RANK_WATCHED:
    if SINGLE:

        def measured(y: Any, pivot: Number) -> Number:
            """Return the quantity that is extrapolated to zero, after a step that ended in the state y = (p, q)."""
            return independence(y[0], y[1])

    else:

        def measured(y: Any, pivot: Number) -> Number:
            """Return the quantity that is extrapolated to zero: the smallest relative pivot of the linear solves of a step."""
            return pivot

    def recalled(pivots: Any, pivot: Number, rank: Number) -> Any:
        """Return the smallest pivot so far, and the measures in this step and in the previous one."""
        return min(pivots[0], pivot), rank, pivots[1]

    def lost(before: Any, now: Any) -> bool:
        """Return whether G loses rank within the next step, given the records before and after this step.

        The measure behaves like the square of an angle: if G loses rank transversally, its root sigma goes to zero linearly. Given the
        last three values, the line through the last two reaches zero within one step, and that through the first two within three; no
        single rough step causes this. A minimum sigma^2 = delta^2 + c^2 t^2 does so only if c h is more than 1.5 delta, so that h does not
        resolve it::

            sigma_2 <= sigma_1 - sigma_2        sigma_1 <= 3 (sigma_0 - sigma_1)
        """
        # The two inequalities squared, so that no roots are taken.
        return bool(4.0 * now[1] <= now[2] and 16.0 * now[2] <= 9.0 * before[2])

else:

    def measured(y: Any, pivot: Number) -> Number:
        """Return the record unchanged."""
        return pivot

    def recalled(pivots: Any, pivot: Number, rank: Number) -> Any:
        """Return the smallest pivot so far."""
        return min(pivots, pivot)

    def lost(before: Any, now: Any) -> bool:
        """Return False: nothing is monitored."""
        return False

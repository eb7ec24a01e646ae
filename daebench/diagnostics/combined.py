"""Independent combinations of redundant constraints, for solvers that need a matrix G of full rank."""

from dataclasses import replace

import numpy as np

from daebench.diagnostics.freedom import freedom
from daebench.diagnostics.unit_rows import root, unit_rows
from daebench.runs.ivp import ConstrainedIvp
from daebench.systems.lazily import scipy, sympy


def combined(ivp: ConstrainedIvp) -> ConstrainedIvp:
    """Return a problem with independent combinations of its constraints if some are permanently redundant, otherwise the problem itself.

    ::

        n^T G(q) = 0,  n of shape(m, m - rank G), rows of G of length one       g_i - sum_j c_ij g_j,   c ~ n_i (n_j)^-1

    As many constraints as are redundant, those of which n has the largest pivots, are added to the others in the ratio that n has at the
    start, to an eighth. Leaving them out would be enough at the start, but their share of n may vanish on the way, and G of the others then
    loses rank; combinations keep their rank until n has turned by 90 degrees. Manifold and motion are those of all constraints together.

    Parameters
    ----------
    ivp : ConstrainedIvp
        The problem with its numbers, on the manifold.
    """
    freedom_at_start = freedom(ivp)
    # Constraints that depend on each other at the start only are needed later: nothing is combined.
    if freedom_at_start is None or not freedom_at_start.permanent:
        return ivp

    rows = np.array(ivp.value("G", ivp.q0) @ root(ivp, ivp.q0), dtype=float)
    length = np.linalg.norm(rows, axis=1)
    n = np.linalg.svd(unit_rows(ivp, ivp.q0))[0][:, freedom_at_start.rank :]
    added = sorted(map(int, scipy.linalg.qr(n.T, mode="r", pivoting=True)[1][: ivp.m - freedom_at_start.rank]))
    c = -n @ np.linalg.inv(n[added]) * length[:, None] / length[added]
    shares = {
        # Rounded to eighths, so that the combinations are exact, short, and the same on every machine.
        i: {j: sympy.Rational(eighths, 8) for j, x in zip(added, c[i], strict=True) if (eighths := round(8 * float(x)))}
        for i in range(ivp.m)
        if i not in added
    }
    return replace(ivp, source=ivp.source.combined(shares), on_singular="stop")

"""The two mixed second derivatives of H, which are each other's transposes unless there are forces without potential."""

from daebench.schemes.kernels.language import FORCED, H_pq
from daebench.schemes.kernels.spaces import Matrix, Vector

if FORCED:

    def by_position(p: Vector, q: Vector, by_momentum: Matrix) -> Matrix:
        """Return H_pq, given H_qp."""
        return H_pq(p, q)

else:

    def by_position(p: Vector, q: Vector, by_momentum: Matrix) -> Matrix:
        """Return H_pq = H_qp^T, given H_qp."""
        return by_momentum.T

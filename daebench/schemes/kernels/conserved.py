"""Constants of a motion on the manifold: H, and the distances from g = 0 and G H_p = 0, which are zero."""

from typing import Any

from daebench.schemes.kernels.language import Gv, H, g, mass, norm
from daebench.schemes.kernels.spaces import Number, Vector


def of_momenta(p: Vector, q: Vector) -> Any:
    """Return H, |g| and |G H_p|."""
    return H(p, q), norm(g(q)), norm(Gv(p, q))


def of_velocities(v: Vector, q: Vector) -> Any:
    """Return the same quantities for p = M v."""
    return of_momenta(mass(v, q) @ v, q)


def of_state(y: Vector) -> Number:
    """Return H of a Poisson system."""
    return H(y)  # type: ignore[call-arg]

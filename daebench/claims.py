"""What a scheme says of itself; the tests and the reports measure it."""

from dataclasses import dataclass


@dataclass(frozen=True, kw_only=True)
class Claims:
    """The claims of a scheme.

    Parameters
    ----------
    order : int
        Order of convergence of q and p.
    symmetric : bool
        Whether rho∘Phi∘rho∘Phi is the identity on the manifold, rho(p, q) = (-p, q).
    symplectic : bool
        Whether the two-form on the tangent space of the manifold is preserved.
    keeps_g, keeps_Gv : bool
        Whether g = 0, and G H_p = 0, hold to round-off after every step.
    system : str
        What it is applied to: "constrained", HLW (1.9), or "ode", the index-reduced (1.18).
    separable_only : bool
        Whether it needs H = 1/2 p^T M^-1 p + U(q) with constant M.
    source : str
        Where it is defined, with the equation number.
    """

    order: int
    symmetric: bool
    symplectic: bool
    keeps_g: bool
    keeps_Gv: bool
    system: str
    source: str
    separable_only: bool = False

    @property
    def on_manifold(self) -> bool:
        """Whether both constraints hold to round-off after every step."""
        return self.keeps_g and self.keeps_Gv

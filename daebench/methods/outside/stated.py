"""Claims of code from outside about itself."""

from dataclasses import dataclass


@dataclass(frozen=True, kw_only=True)
class Stated:
    """Claims of code from outside, see :class:`daebench.schemes.kernels.claims.Claims`; None if it claims nothing."""

    order: int | None = None
    symmetric: bool | None = None
    symplectic: bool | None = None
    keeps_g: bool | None = None
    keeps_Gv: bool | None = None
    conserves_energy: bool | None = None

    @property
    def on_manifold(self) -> bool:
        """Whether it claims that both constraints hold to round-off after every step."""
        return bool(self.keeps_g and self.keeps_Gv)

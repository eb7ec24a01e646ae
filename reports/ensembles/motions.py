"""The motions of the report on ensembles, and the methods that run on them."""

from dataclasses import dataclass

METHODS = ("rattle", "rattle/suzuki4", "rattle/kahan_li8", "lobatto3", "rk4")
"""Fixed-step methods; costs are relative to the first."""

STRUCTURED = METHODS[:4]
"""The methods that are symplectic on the manifold; their energy does not drift as long as the step is small."""

FRACTIONS = (1, 2, 4)
"""Divisors of the largest step: three costs, each twice the one before."""

MIDDLE = FRACTIONS[1]
"""The cost that pictures and sentences show if they show one cost."""

STARTS = 1024
"""Starts of each motion: the start of the case, and others of the same energy."""

SEED = 1
"""Seeds them."""


@dataclass(frozen=True)
class Motion:
    """A problem and a case, whose energy all starts have."""

    problem: str
    case: str
    """Names in the catalogue."""
    title: str
    """Display name on the page."""
    h: float
    """Largest step of the first method, s; others have steps of the same cost."""
    t_end: float
    """End, s."""

    @property
    def key(self) -> str:
        """Name in tables."""
        return f"{self.problem} {self.case}"


MOTIONS = (
    Motion("spherical_pendulum", "fig1.2", "fast spherical pendulum", 0.02, 20.0),
    Motion("double_pendulum", "horizontal", "double pendulum", 0.01, 20.0),
    Motion("double_spherical_pendulum", "swing", "double spherical pendulum", 0.02, 20.0),
    Motion("torus", "through_hole", "point on a torus", 0.04, 40.0),
    Motion("ellipsoid_geodesic", "round_short", "geodesic on an ellipsoid", 0.04, 40.0),
    Motion("slider_crank", "turning", "slider crank", 0.002, 10.0),
    Motion("two_bodies_on_sphere", "gni", "two bodies on a sphere", 0.01, 20.0),
)

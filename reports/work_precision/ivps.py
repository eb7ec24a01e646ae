"""Motions of the report on work against precision: a small standard set, each of a different character."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from types import MappingProxyType

from daebench.methods.initial_value_problem import initial_value_problem
from daebench.runs.ivp import PoissonIvp
from daebench.studies.grid.study import Study
from daebench.studies.work_precision.study import REPEAT, TOLERANCES, standard

EVERY_OTHER = TOLERANCES[1::2]
"""Tolerances of long runs: 1e-4, 1e-6, ... 1e-12."""

COARSE = MappingProxyType(dict.fromkeys(("scipy:Radau", "solve_dae:Radau"), EVERY_OTHER[:4]))
"""Tolerances of the two methods whose runs take longest, without the tightest."""

WANTED = (1e-3, 1e-6, 1e-9)
"""Accuracies for which a method is recommended."""


@dataclass(frozen=True)
class Work:
    """A motion up to a horizon.

    Parameters
    ----------
    problem, case : str
        Names; the case has a certified reference.
    t_end : float
        Horizon, s.
    title, character : str
        Its name, and the reason why it is in the set, as HTML.
    tol : tuple of float
        Tolerances.
    """

    problem: str
    case: str
    t_end: float
    title: str
    character: str
    tol: tuple[float, ...] = TOLERANCES

    @property
    def key(self) -> str:
        """Name in files and links."""
        return f"{self.problem}-{self.case}-{self.t_end:g}".replace(".", "_").replace(",", "_")

    @property
    def poisson(self) -> bool:
        """Whether it is a Poisson system."""
        return isinstance(initial_value_problem(self.problem, self.case), PoissonIvp)

    @property
    def letter(self) -> str:
        """Letter of the variable whose errors are measured: q, or y."""
        return "y" if self.poisson else "q"

    @property
    def error(self) -> str:
        """Column of the error."""
        return f"error_{self.letter}"

    def study(self) -> tuple[Study, Mapping[str, str]]:
        """Return the standard study, and the reasons why methods of the standard set are not in it."""
        study, left_out = standard(self.problem, case=self.case, t_end=self.t_end, tol=self.tol, repeat=REPEAT, anyway=self.poisson)
        coarse_tols = {method: tol for method, tol in COARSE.items() if method in study.methods}
        return replace(study, values={**study.values, **coarse_tols}), left_out


WORKS = (
    Work("spherical_pendulum", "fig1.2", 10.0, "Spherical pendulum, short", "the standard: one constraint, a fast swing (HLW Fig. 1.2)"),
    Work("spherical_pendulum", "fig1.2", 100.0, "Spherical pendulum, long", "the same motion over ten times the time", EVERY_OTHER),
    Work("double_pendulum", "horizontal", 10.0, "Double pendulum", "chaotic: errors grow exponentially, so the horizon is short"),
    Work("slider_crank", "turning", 10.0, "Slider crank", "a mechanism: two constraints, a mass matrix that is not diagonal"),
    Work("free_rigid_body", "hlw", 100.0, "Free rigid body", "a Poisson system with a quadratic Casimir function", EVERY_OTHER),
    Work("lotka_volterra", "4,2", 100.0, "Predator and prey", "a Poisson system in the plane, whose orbits are closed curves", EVERY_OTHER),
)
"""The standard set."""

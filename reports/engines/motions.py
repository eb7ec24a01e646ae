"""The motions on which engines are compared with reference solutions."""

from dataclasses import dataclass, field
from functools import cached_property
from types import MappingProxyType

from daebench.methods.initial_value_problem import initial_value_problem
from daebench.runs.ivp import ConstrainedIvp

T_END = 10.0
"""Time at which the accuracy is measured, s."""


@dataclass(frozen=True)
class Motion:
    """A motion.

    Parameters
    ----------
    key : str
        Its name on the page.
    problem, case : str
        Names in the catalogue.
    title, about : str
        Title and description, as HTML.
    parameters : mapping of str to float
        Parameters that differ from the case's.
    spacing : float
        Spacing of outputs, s, a power of two.
    budget : float
        Seconds of stepping at which contenders are compared.
    long : float
        Horizon of the verdict on the energy, s.
    """

    key: str
    problem: str
    case: str
    title: str
    about: str
    parameters: MappingProxyType[str, float] = field(default_factory=lambda: MappingProxyType({}))
    spacing: float = 1 / 8
    budget: float = 0.2
    long: float = 100.0

    @cached_property
    def ivp(self) -> ConstrainedIvp:
        """The initial value problem."""
        ivp = initial_value_problem(self.problem, self.case, self.parameters)
        assert isinstance(ivp, ConstrainedIvp)
        return ivp


MOTIONS = (
    Motion("pendulum", "planar_pendulum", "iftomm_a01", "Planar pendulum", "released at rest from the horizontal, IFToMM benchmark A01"),
    Motion("double", "double_pendulum", "horizontal", "Double pendulum", "released at rest from the horizontal: chaotic"),
    Motion("slider", "slider_crank", "turning", "Slider crank", "the crank at 8 rad/s, full turns"),
    Motion("fourbar", "four_bar", "swing", "Four-bar linkages", "two in a row, a swing of 0.1 rad, far from singular"),
    Motion(
        "iftomm",
        "four_bar",
        "iftomm",
        "Four-bar linkages through a singularity",
        "two in a row, IFToMM benchmark A02: G loses rank twice a turn",
    ),
    Motion(
        "chain10",
        "pendulum_chain",
        "hanging",
        "Chain of 10",
        "hanging, released 0.1 rad from the vertical",
        MappingProxyType({"links": 10}),
    ),
    Motion(
        "chain100",
        "pendulum_chain",
        "hanging",
        "Chain of 100",
        "hanging, released 0.1 rad from the vertical",
        MappingProxyType({"links": 100}),
        budget=2.0,
        long=50.0,
    ),
    Motion("butane", "butane", "tumbling", "Butane", "over the barriers of its torsion, and turning as a whole"),
    Motion(
        "top", "rigid_body_rotation", "heavy_top", "Heavy top", "spinning at 150 rad/s about its horizontal axis", spacing=1 / 64, long=20.0
    ),
)
"""All motions in the order of the page."""

BY_KEY = {motion.key: motion for motion in MOTIONS}

"""Initial value problems of the report on problems: the first case of each, with a step size and an end."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from types import MappingProxyType

from daebench.methods.catalogue import find_problem, problems
from daebench.methods.initial_value_problem import initial_value_problem
from daebench.runs.ivp import ConstrainedIvp
from daebench.runs.make_ivp import constrained
from daebench.systems.chain import ConstrainedChain
from daebench.systems.constrained import ConstrainedHamiltonian

STEPS = 400
"""Steps of every fixed-step run: h is the end divided by this."""

TOL = 1e-8
"""Tolerance of every tolerance-driven run, relative and absolute."""


@dataclass(frozen=True)
class Horizon:
    """Horizon of an initial value problem.

    Parameters
    ----------
    t_end : float
        End of all runs, in the problem's unit of time.
    drawn : float
        End of the drawn path; beyond this time it would cover itself.
    why : str
        The reason for the end, as the end of a sentence.
    unit : str
        Unit of time.
    length : str
        Unit of length.
    """

    t_end: float
    drawn: float
    why: str
    unit: str = "s"
    length: str = "m"


OTHERS = ("nonholonomic", "free", "poisson")
"""Kinds of problems of which there are pages, and no runs in this report."""

UNDECLARED = Horizon(10.0, 5.0, "no other horizon is declared for it")

HORIZONS: Mapping[str, Horizon] = MappingProxyType(
    {
        "planar_pendulum": Horizon(60.0, 3.7, "several swings"),
        "spherical_pendulum": Horizon(60.0, 20.0, "several swings"),
        "double_pendulum": Horizon(10.0, 3.0, "well before rounding decides the motion"),
        "pendulum_chain": Horizon(5.0, 1.5, "well before rounding decides the motion"),
        "double_spherical_pendulum": Horizon(20.0, 6.0, "several swings"),
        "two_bodies_on_sphere": Horizon(5.0, 5.0, "a few encounters; the step is for the nearest of them"),
        "ellipsoid_geodesic": Horizon(60.0, 40.0, "several turns round the ellipsoid"),
        "torus": Horizon(30.0, 15.0, "several times through the hole"),
        "slider_crank": Horizon(5.0, 0.9, "several turns of the crank"),
        "four_bar": Horizon(5.0, 1.3, "several swings of the uprights, each through the horizontal"),
        "four_bar_spring": Horizon(10.0, 3.0, "several swings"),
        "bricard": Horizon(5.0, 2.5, "down, up on the other side, and back"),
        "rigid_water": Horizon(10.0, 4.0, "a picosecond", unit="0.1 ps", length="Å"),
        "cyclohexane_ring": Horizon(20.0, 20.0, "from one boat to the next and back", unit="0.1 ps", length="Å"),
        "andrews_squeezer": Horizon(0.03, 0.03, "the end of the benchmark"),
        "butane": Horizon(10.0, 10.0, "a picosecond", unit="0.1 ps", length="Å"),
        "rigid_body_rotation": Horizon(20.0, 9.0, "a few turns"),
        "knife_edge": Horizon(6.0, 6.0, "one turn, over two arcs of the cycloid"),
        "sleigh": Horizon(20.0, 8.0, "until it has stopped turning"),
        "rolling_disc": Horizon(2.0, 2.0, "the end of the benchmark"),
        "ball_on_turntable": Horizon(20.0, 6.3, "three circles"),
        "snakeboard": Horizon(20.0, 10.0, "ahead and back twice"),
        "kepler": Horizon(60.0, 6.3, "several turns"),
        "henon_heiles": Horizon(100.0, 60.0, "several crossings"),
        "lotka_volterra": Horizon(40.0, 8.0, "several rounds"),
        "lotka_volterra_3d": Horizon(1.6, 1.6, "shortly before the motion goes to infinity"),
        "ablowitz_ladik": Horizon(1.0, 0.5, "a few recurrences"),
    }
)
"""Ends that suit the motions of the first cases; a problem that is not listed gets :data:`UNDECLARED`."""


def names() -> list[str]:
    """Return the constrained problems of the catalogue, slow ones first: unlisted problems, then :data:`HORIZONS` from its end."""
    ends = list(HORIZONS)
    return sorted(problems("constrained"), key=lambda name: (-ends.index(name) if name in ends else -len(ends), name))


@cache
def ivp_of(name: str, case: str | None = None) -> ConstrainedIvp:
    """Return a case of a problem, by default its first."""
    return constrained(initial_value_problem(name, case))


def usual(name: str) -> str:
    """Return the method that draws a problem: RATTLE, dla for constraints on velocities, on a Poisson system the symmetric splitting."""
    return {"poisson": "strang", "nonholonomic": "dla"}.get(find_problem(name).kind, "rattle")


def horizon(name: str) -> Horizon:
    """Return the horizon of the first case of a problem."""
    return HORIZONS.get(name, UNDECLARED)


def step_size(name: str) -> float:
    """Return the step size of all fixed-step runs on the first case of a problem."""
    return horizon(name).t_end / STEPS


def definition(ivp: ConstrainedIvp) -> ConstrainedHamiltonian:
    """Return the definition of a problem, with a chain written out."""
    problem = find_problem(ivp.problem)
    parameters = ivp.facts.CASES[ivp.case]["parameters"]
    declared = problem.define(**{name: int(value) for name, value in parameters.items() if name in problem.structure})
    system = declared.written_out() if isinstance(declared, ConstrainedChain) else declared
    assert isinstance(system, ConstrainedHamiltonian)
    return system

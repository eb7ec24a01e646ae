"""The motions on which engines are compared, and their reference solutions: certified, closed forms, and for chains two fine runs."""

from dataclasses import dataclass, field
from functools import cache, cached_property
from types import MappingProxyType

import numpy as np

from daebench.methods.initial_value_problem import initial_value_problem
from daebench.methods.names import method_of
from daebench.reference.keep import store
from daebench.reference.keep.dense_evaluation import states_at
from daebench.reference.solution import SAFETY, certified_for, reference_solution
from daebench.reports.engines.contender import Array
from daebench.runs.ivp import ConstrainedIvp
from daebench.runs.request import Request

T_END = 10.0
"""Time at which the accuracy is measured, s."""


@dataclass(frozen=True)
class Motion:
    """A motion."""

    key: str
    """Its name on the page."""
    problem: str
    case: str
    """Names in the catalogue."""
    title: str
    about: str
    """Title and description, as HTML."""
    parameters: MappingProxyType[str, float] = field(default_factory=lambda: MappingProxyType({}))
    """Parameters that differ from the case's."""
    spacing: float = 1 / 8
    """Spacing of outputs, s, a power of two."""
    budget: float = 0.2
    """Seconds of stepping at which contenders are compared."""
    long: float = 100.0
    """Horizon of the verdict on the energy, s."""

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


TOP = ("heavy_top_lie_poisson", "heavy_top")
"""Certified reference of the heavy top, in angular momentum and Gamma, the upward vertical, both seen from the body."""


FINE = "rattle/kahan_li8"
"""Method of the reference runs of chains."""


FINE_STEP = 1 / 256
"""Step size of the coarser of these two runs, s."""


@dataclass(frozen=True)
class Reference:
    """The motion at the end."""

    words: str
    """Description of the reference solution."""
    value: Array
    """Positions, or quantities in their place, see :func:`compared`."""
    bound: float
    """Error bound of a component."""


def compared(motion: Motion, q: Array) -> Array:
    """Return the compared part of a position: the whole position, or for the top the upward vertical seen from the body, its third row."""
    return q[..., 6:9] if motion.key == "top" else q


@cache
def reference_of(key: str) -> Reference:
    """Return the reference solution of a motion at its end."""
    motion, end = BY_KEY[key], np.array([T_END])
    if motion.key == "top":
        known = states_at(store.find(*TOP), end)
        return Reference(f"certified {'-'.join(TOP)}", known.states["y"][0, 3:], float(np.max(known.bound["y"])))
    if motion.problem == "pendulum_chain":
        return fine(motion.ivp)
    if reference := certified_for(motion.ivp, T_END):
        known = states_at(reference, end)
        return Reference(f"certified {reference.name}", known.states["q"][0], float(np.max(known.bound["q"])))
    solution = reference_solution(motion.ivp, end)
    return Reference(solution.kind, solution.states["q"][0], solution.bound["q"])


def fine(ivp: ConstrainedIvp) -> Reference:
    """Return the end of a run of order eight, and as its bound a multiple of the difference from a run with twice the step size."""
    method = method_of(ivp, FINE)
    coarse, finer = (
        method.solve(ivp, Request(value=h, t_end=T_END, every=0, watch=(), count=False)).complete().q[-1]
        for h in (FINE_STEP, FINE_STEP / 2)
    )
    return Reference(f"two runs of {FINE}", finer, SAFETY * float(np.max(np.abs(finer - coarse))))

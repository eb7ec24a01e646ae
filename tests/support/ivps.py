"""The problems that every scheme is swept over: problems of the catalogue, and those of ``definitions`` for every kind of H."""

from functools import cache

import definitions
import pytest

from daebench.compiler.definition import source_of
from daebench.methods.catalogue import problems
from daebench.methods.initial_value_problem import initial_value_problem
from daebench.runs.make_ivp import make_ivp

IN_TENS = {"methyl": 1.5035, "methylene": 1.4027, "C0": 0.928, "C1": 1.216, "C2": -1.312, "C3": -0.306, "C4": 2.624, "C5": -3.15}
"""Butane in units of 10 u and 10 kJ/mol: the same motion with momenta of order one."""

SMALLER = {
    "pendulum_chain": ("hanging", {"links": 3}),
    "rigid_body_rotation": ("free", {"gravity": 2.0}),
    "four_bar": ("swing", {"bars": 1}),
    "slider_crank": ("swing", {"gravity": 2.0}),
    "butane": ("tumbling", IN_TENS),
    "watt_six_bar": ("swing", {}),
    "rssr_four_bar": ("swing", {}),
    "double_wishbone": ("released", {"stiffness": 300.0}),
    "andrews_squeezer": ("bari", {"density": 1e4}),  # the same motion a hundred times as slowly
}
"""What is swept of problems whose first case would take minutes, is too fast for the sweep's steps, or so special that some schemes are
better there than they claim."""

CATALOGUE = {**problems("constrained"), **problems("nonholonomic")}
"""Problems of the catalogue with constraints."""


@cache
def ivp(name):
    """Return one of the initial value problems by name."""
    catalogue = {
        "spherical-slow": ("spherical_pendulum", "fig1.1"),
        "spherical-fast": ("spherical_pendulum", "fig1.2b"),
        "planar": ("planar_pendulum", "rotating"),
    }
    if name in CATALOGUE:
        return initial_value_problem(name, *SMALLER.get(name, ()))
    if name in catalogue:
        return initial_value_problem(*catalogue[name])
    problem, case = {
        "stretched-M": (definitions.stretched(), "swing"),
        "stretched-H": (definitions.stretched(given_as="H"), "swing"),
        "relativistic": (definitions.relativistic(), "tied"),
        "double-pendulum": (definitions.double_pendulum(), "bent"),
        "coupled-rods": (definitions.coupled(), "bent"),
    }[name]
    return make_ivp(source_of(problem, name), case)


OVER_CONSTRAINED = ("bricard", "cyclohexane_ring")
"""Problems with redundant constraints, of so many unknowns that each scheme would take minutes: what schemes do about redundancy is swept
over a small problem in ``tests/methods/test_redundant.py``, and these are run by a few methods in ``test_over_constrained.py``."""

IN_TIME = ("arevalo", "car_axis", "driven_slider_crank", "fekete", "slider_crank_sundials")
"""Problems in time and under forces, of which schemes claim other things: ``tests/systems/test_in_time.py`` measures these."""

NONHOLONOMIC = ("ball_on_turntable", "knife_edge", "rolling_disc", "sleigh", "snakeboard")
"""Problems with constraints on velocities, which most schemes refuse: ``tests/problems/test_nonholonomic.py`` runs these."""

IVPS = (
    "spherical-fast",
    "planar",
    "stretched-M",
    "stretched-H",
    "relativistic",
    *(name for name in problems("constrained") if name not in (*OVER_CONSTRAINED, *IN_TIME, *NONHOLONOMIC)),
)
"""Chosen cases and kinds, and the first case of every problem of the catalogue but ``SMALLER``, which is in the sweep by being there.

That of the spherical pendulum is spherical-slow.
"""

LARGE = ("andrews_squeezer", "butane", "double_wishbone", "rigid_body_rotation", "rigid_water", "watt_six_bar")
"""Problems of so many unknowns that a sweep over all schemes takes minutes, run as Python: they are swept among the slow tests."""

ALIKE = (
    *("double_spherical_pendulum", "double_wishbone", "ellipsoid_geodesic", "four_bar", "four_bar_spring", "pendulum_chain"),
    *("rigid_body_rotation", "rigid_water", "rssr_four_bar", "watt_six_bar"),
)
"""Problems of a kind that others are of, pendulums, linkages, surfaces and molecules: they are swept before a release, and have tests of
their own."""


def swept(names=IVPS):
    """Return parameters of a test that is swept over initial value problems of these names."""
    return [pytest.param(name, id=name, marks=_marks(name)) for name in names]


def _marks(name):
    if name in ALIKE:
        return (pytest.mark.slow, pytest.mark.exhaustive)
    return (pytest.mark.slow,) if name in LARGE else ()


ONE_OF_EACH_KIND = ("rattle", "shake", "lobatto3", "gauss2", "radau2_ggl", "energy_momentum", "se", "rk4")
"""Schemes of each kind, which the gate takes where others have the same answer by the same code."""

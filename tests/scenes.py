"""The scenes that every scheme is swept over: problems of the catalogue, and those of ``definitions`` for every kind of H."""

from functools import cache

import definitions

from daebench.catalogue import find_scene, problems
from daebench.scene import make_scene, source_of

SMALLER = {"pendulum_chain": ("hanging", {"links": 3}), "rigid_body_rotation": ("free", {"gravity": 2.0})}
"""What is swept of problems whose first case would take minutes, or is so special that some schemes are better there than they claim."""


@cache
def scene(name):
    """Return one of the scenes by name."""
    catalogue = {
        "spherical-slow": ("spherical_pendulum", "fig1.1"),
        "spherical-fast": ("spherical_pendulum", "fig1.2b"),
        "planar": ("planar_pendulum", "rotating"),
    }
    if name in problems("constrained"):
        return find_scene(name, *SMALLER.get(name, ()))
    if name in catalogue:
        return find_scene(*catalogue[name])
    problem, case = {
        "stretched-M": (definitions.stretched(), "swing"),
        "stretched-H": (definitions.stretched(given_as="H"), "swing"),
        "relativistic": (definitions.relativistic(), "tied"),
        "double-pendulum": (definitions.double_pendulum(), "bent"),
        "coupled-rods": (definitions.coupled(), "bent"),
    }[name]
    return make_scene(source_of(problem, name), case)


SCENES = (
    "spherical-fast",
    "planar",
    "stretched-M",
    "stretched-H",
    "relativistic",
    "double-pendulum",
    "coupled-rods",
    *problems("constrained"),
)
"""Chosen cases and kinds, and the first case of every problem of the catalogue but ``SMALLER``, which is in the sweep by being there.

That of the spherical pendulum is spherical-slow.
"""

"""Adapters: one file an engine, which poses motions in the engine's own words and maps its coordinates to daebench's q and p."""

import importlib
from dataclasses import dataclass
from importlib.metadata import version
from importlib.util import find_spec
from types import ModuleType


@dataclass(frozen=True)
class Engine:
    """An engine.

    Parameters
    ----------
    name : str
        What it is called.
    module : str
        Its adapter beside this file; nothing where there is none.
    package : str
        What is imported.
    distribution : str
        What is installed.
    about : str
        What it can express here, and what not, as HTML.
    """

    name: str
    module: str
    package: str
    distribution: str
    about: str

    @property
    def installed(self) -> bool:
        """Whether it is installed."""
        return bool(self.module) and find_spec(self.package) is not None

    @property
    def version(self) -> str:
        """Its version, where it is installed."""
        return version(self.distribution)

    @property
    def adapter(self) -> ModuleType:
        """Its adapter."""
        return importlib.import_module(f"{__name__}.{self.module}")


ENGINES = (
    Engine(
        "MuJoCo",
        "mujoco",
        "mujoco",
        "mujoco",
        "pendulums, chains and the top need no constraint in its reduced coordinates, and are shown so; they are shown as closed loops "
        "too, of tendons or a connected body. Slider crank and four-bar linkages are trees closed by <code>connect</code>. Left out are "
        "the chain of 100 as closed loops, and butane, whose torsion takes a callback at each step.",
    ),
    Engine(
        "EXUDYN",
        "exudyn",
        "exudyn",
        "exudyn",
        "point masses with distance constraints, bars with revolute joints, and a rigid body on the Lie group. Butane is left out: a "
        "torsion takes a Python function at each step.",
    ),
    Engine(
        "Pinocchio",
        "pinocchio",
        "pinocchio",
        "pin",
        "it gives accelerations, and the integrator is the user's: semi-implicit Euler as in its examples, and RK4, both loops in Python. "
        "Pendulums, chains and the top are in reduced coordinates alone. Butane is left out: it has no particles.",
    ),
    Engine(
        "OpenMM",
        "openmm",
        "openmm",
        "openmm",
        "a constraint may not end at a particle that is held, so that pendulums and chains are halves of molecules mirrored in the pivot, "
        "which is the same motion. Bars, sliders and tops are left out: it has no rigid bodies. So is the chain of 100.",
    ),
    Engine("Mici", "mici", "mici", "mici", "any U, g and constant M, as NumPy functions."),
    Engine(
        "jax-md",
        "jax_md",
        "jax_md",
        "jax-md",
        "it has projections for distance constraints and no integrator that calls them: they are put into the integrator of OpenMM's "
        "documentation here, so that these rows speak of the projections in this place, and of no integrator of jax-md. The top is one of "
        "its rigid bodies. Mechanisms of bars are left out, and the chain of 100.",
    ),
    Engine(
        "CasADi",
        "casadi",
        "casadi",
        "casadi",
        "the index is reduced by <code>dae_reduce_index</code> where that succeeds (pendulums, slider crank), else by hand with CasADi's "
        "own derivatives: it says of the others that structural detection failed. Code is interpreted here; it can be compiled.",
    ),
    Engine(
        "PyChrono",
        "",
        "",
        "",
        "it is distributed by conda alone: on PyPI <code>pychrono</code> is another package, and <code>projectchrono</code> a name held "
        "without content. There is no adapter.",
    ),
)
"""All engines in the order of the page."""

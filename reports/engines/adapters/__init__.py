"""Adapters: one file per engine, which models motions with the engine's means and maps its coordinates to daebench's q and p."""

import importlib
from dataclasses import dataclass
from importlib.metadata import version
from importlib.util import find_spec
from types import ModuleType


@dataclass(frozen=True)
class Engine:
    """An engine."""

    name: str
    """Display name."""
    module: str
    """Its adapter beside this file; empty if there is none."""
    package: str
    """Name of the imported package."""
    distribution: str
    """Name of the installed distribution."""
    about: str
    """What it can model here, and what it cannot, as HTML."""

    @property
    def installed(self) -> bool:
        """Whether it is installed."""
        return bool(self.module) and find_spec(self.package) is not None

    @property
    def version(self) -> str:
        """Its version, if it is installed."""
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
        "pendulums, chains and the top need no constraint in its reduced coordinates. They are shown in these, and also as closed loops "
        "of tendons or a connected body. Slider crank and four-bar linkages are trees closed by <code>connect</code>. The chain of 100 as "
        "closed loops is left out, and so is butane, whose torsion needs a callback at each step.",
    ),
    Engine(
        "EXUDYN",
        "exudyn",
        "exudyn",
        "exudyn",
        "point masses with distance constraints, bars with revolute joints, and a rigid body on the Lie group. Butane is left out: its "
        "torsion needs a Python function at each step.",
    ),
    Engine(
        "Pinocchio",
        "pinocchio",
        "pinocchio",
        "pin",
        "it gives accelerations, and the integrator is the user's: semi-implicit Euler as in its examples, and RK4, both loops in Python. "
        "Pendulums, chains and the top are in reduced coordinates only. Butane is left out: Pinocchio has no particles.",
    ),
    Engine(
        "OpenMM",
        "openmm",
        "openmm",
        "openmm",
        "a constraint may not end at a fixed particle, so pendulums and chains are halves of molecules mirrored in the pivot, "
        "which is the same motion. Bars, sliders and tops are left out because it has no rigid bodies. The chain of 100 is left out, too.",
    ),
    Engine("Mici", "mici", "mici", "mici", "any U, g and constant M, as NumPy functions."),
    Engine(
        "jax-md",
        "jax_md",
        "jax_md",
        "jax-md",
        "it has projections for distance constraints but no integrator that calls them. Here they are used in the integrator of OpenMM's "
        "documentation, so these rows test the projections in this integrator, not an integrator of jax-md. The top is one of "
        "its rigid bodies. Mechanisms of bars and the chain of 100 are left out.",
    ),
    Engine(
        "CasADi",
        "casadi",
        "casadi",
        "casadi",
        "the index is reduced by <code>dae_reduce_index</code> if it succeeds (pendulums, slider crank), otherwise by hand with CasADi's "
        "own derivatives: for the other motions it reports that structural detection failed. Code is interpreted here; it can be compiled.",
    ),
    Engine(
        "PyChrono",
        "",
        "",
        "",
        "it is distributed by conda only: on PyPI <code>pychrono</code> is a different package, and <code>projectchrono</code> is a "
        "reserved name without content. There is no adapter.",
    ),
)
"""All engines in the order of the page."""

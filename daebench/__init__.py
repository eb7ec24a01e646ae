"""daebench: what a treatment of constraints costs, and what it breaks.

A constrained Hamiltonian problem is written once. It is posed as an index-3, -2, -1 and stabilised DAE, and integrated by
structure-preserving schemes. Energy drift, manifold drift, order, symplecticity and cost are measured side by side. Notation and equation
numbers are those of Hairer, Lubich and Wanner, *Geometric Numerical Integration*, chapter VII (HLW).
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

from daebench.systems.renamed import current_name
from daebench.systems.renamed_modules import find_renamed_modules

if TYPE_CHECKING:
    from daebench.diagnostics.submanifold import as_poisson, symplectic_projection
    from daebench.errors import BadInput, DaebenchError, InconsistentStart, InvalidProblem, RunFailed
    from daebench.methods.gradient import Gradient, gradient
    from daebench.methods.initial_value_problem import initial_value_problem
    from daebench.methods.listing import list_methods, list_problems
    from daebench.methods.load import load
    from daebench.methods.run import run
    from daebench.pages.animation.animation import animation
    from daebench.pages.certificate.certify import certify
    from daebench.pages.generation.run import generate
    from daebench.runs.ivp import InitialValueProblem
    from daebench.runs.trajectory import PoissonTrajectory, Trajectory
    from daebench.studies.advise.advice import Advice
    from daebench.studies.advise.run import advise
    from daebench.studies.baumgarte.run import BaumgarteMap, baumgarte
    from daebench.studies.certificate.verify import verify_certificate
    from daebench.studies.chaos.result import Chaos
    from daebench.studies.chaos.run import chaos
    from daebench.studies.claims.check import check
    from daebench.studies.comparison.table import compare
    from daebench.studies.diagnose.verdict import diagnose
    from daebench.studies.ensemble.result import Ensemble
    from daebench.studies.ensemble.run import ensemble
    from daebench.studies.grid.study import Study
    from daebench.studies.modes.run import Modes, modes
    from daebench.studies.orders.study import order
    from daebench.studies.shadow.run import Shadow, shadow
    from daebench.studies.step_for.result import StepFor
    from daebench.studies.step_for.run import step_for
    from daebench.studies.tolerance_for import ToleranceFor, tolerance_for
    from daebench.systems.chain import ConstrainedChain
    from daebench.systems.constrained import Case, Chart, ConstrainedHamiltonian, KineticFlow, Picture, coordinates
    from daebench.systems.lattice import PoissonLattice
    from daebench.systems.poisson import DarbouxMap, Lift, Part, PoissonCase, PoissonSystem

__all__ = [
    "Advice",
    "BadInput",
    "BaumgarteMap",
    "Case",
    "Chaos",
    "Chart",
    "ConstrainedChain",
    "ConstrainedHamiltonian",
    "DaebenchError",
    "DarbouxMap",
    "Ensemble",
    "Gradient",
    "InconsistentStart",
    "InitialValueProblem",
    "InvalidProblem",
    "KineticFlow",
    "Lift",
    "Modes",
    "Part",
    "Picture",
    "PoissonCase",
    "PoissonLattice",
    "PoissonSystem",
    "PoissonTrajectory",
    "RunFailed",
    "Shadow",
    "StepFor",
    "Study",
    "ToleranceFor",
    "Trajectory",
    "advise",
    "animation",
    "as_poisson",
    "baumgarte",
    "certify",
    "chaos",
    "check",
    "compare",
    "coordinates",
    "diagnose",
    "ensemble",
    "generate",
    "gradient",
    "initial_value_problem",
    "list_methods",
    "list_problems",
    "load",
    "modes",
    "order",
    "run",
    "shadow",
    "step_for",
    "symplectic_projection",
    "tolerance_for",
    "verify_certificate",
]

_HOME = {
    **dict.fromkeys(("list_methods", "list_problems"), "methods.listing"),
    "run": "methods.run",
    **dict.fromkeys(("BadInput", "DaebenchError", "InconsistentStart", "InvalidProblem", "RunFailed"), "errors"),
    **dict.fromkeys(("Case", "Chart", "ConstrainedHamiltonian", "KineticFlow", "Picture", "coordinates"), "systems.constrained"),
    **dict.fromkeys(("DarbouxMap", "Lift", "Part", "PoissonCase", "PoissonSystem"), "systems.poisson"),
    **dict.fromkeys(("PoissonTrajectory", "Trajectory"), "runs.trajectory"),
    **dict.fromkeys(("as_poisson", "symplectic_projection"), "diagnostics.submanifold"),
    "generate": "pages.generation.run",
    **dict.fromkeys(("Gradient", "gradient"), "methods.gradient"),
    "Advice": "studies.advise.advice",
    "Chaos": "studies.chaos.result",
    "ConstrainedChain": "systems.chain",
    "Ensemble": "studies.ensemble.result",
    "PoissonLattice": "systems.lattice",
    "InitialValueProblem": "runs.ivp",
    "StepFor": "studies.step_for.result",
    "Study": "studies.grid.study",
    "advise": "studies.advise.run",
    "animation": "pages.animation.animation",
    "certify": "pages.certificate.certify",
    "chaos": "studies.chaos.run",
    "check": "studies.claims.check",
    "compare": "studies.comparison.table",
    "diagnose": "studies.diagnose.verdict",
    "ensemble": "studies.ensemble.run",
    "initial_value_problem": "methods.initial_value_problem",
    "load": "methods.load",
    **dict.fromkeys(("BaumgarteMap", "baumgarte"), "studies.baumgarte.run"),
    **dict.fromkeys(("Modes", "modes"), "studies.modes.run"),
    **dict.fromkeys(("Shadow", "shadow"), "studies.shadow.run"),
    "order": "studies.orders.study",
    "step_for": "studies.step_for.run",
    **dict.fromkeys(("ToleranceFor", "tolerance_for"), "studies.tolerance_for"),
    "verify_certificate": "studies.certificate.verify",
}

_PACKAGES = ("joints", "methods", "problems")
"""Packages that are attributes without a separate import."""

find_renamed_modules()


def __getattr__(name: str) -> Any:
    """Import a public name on first access: the import of NumPy alone would take longer than ``daebench list`` should."""
    if name in _PACKAGES:
        return import_module(f"daebench.{name}")
    if name == "__version__":
        from importlib.metadata import version

        return version("daebench")
    name = current_name(name)
    if name not in _HOME:
        raise AttributeError(f"module 'daebench' has no attribute {name!r}")
    return getattr(import_module(f"daebench.{_HOME[name]}"), name)


def __dir__() -> list[str]:
    """Return all names, including those that are imported on first access."""
    return sorted((*globals(), *__all__, *_PACKAGES, "__version__"))

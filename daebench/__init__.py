"""daebench: what a treatment of constraints really costs, and what it breaks.

One constrained Hamiltonian problem, written once, is posed as index-3, -2, -1 and stabilised DAE and handed to structure-preserving
schemes; energy drift, manifold drift, order, symplecticity and cost are measured side by side. Notation and equation numbers are those
of Hairer, Lubich and Wanner, *Geometric Numerical Integration*, chapter VII (HLW).
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

from daebench.renamed import current_name

if TYPE_CHECKING:
    from daebench.api import list_problems, methods, run
    from daebench.chains.chain import ConstrainedChain
    from daebench.claims_check import check
    from daebench.comparison import compare
    from daebench.errors import BadInput, DaebenchError, InconsistentStart, InvalidProblem, RunFailed
    from daebench.film.animation import animation
    from daebench.ivp import InitialValueProblem
    from daebench.ivp_constructor import initial_value_problem
    from daebench.order_study import order
    from daebench.poisson_lattice import PoissonLattice
    from daebench.poisson_system import DarbouxMap, Lift, Part, PoissonCase, PoissonSystem
    from daebench.problem import Case, Chart, ConstrainedHamiltonian, KineticFlow, Picture, coordinates
    from daebench.studies.study import Study
    from daebench.submanifold import as_poisson, symplectic_projection
    from daebench.trajectory import PoissonTrajectory, Trajectory

__all__ = [
    "BadInput",
    "Case",
    "Chart",
    "ConstrainedChain",
    "ConstrainedHamiltonian",
    "DaebenchError",
    "DarbouxMap",
    "InconsistentStart",
    "InitialValueProblem",
    "InvalidProblem",
    "KineticFlow",
    "Lift",
    "Part",
    "Picture",
    "PoissonCase",
    "PoissonLattice",
    "PoissonSystem",
    "PoissonTrajectory",
    "RunFailed",
    "Study",
    "Trajectory",
    "animation",
    "as_poisson",
    "check",
    "compare",
    "coordinates",
    "initial_value_problem",
    "list_problems",
    "methods",
    "order",
    "run",
    "symplectic_projection",
]

_HOME = {
    **dict.fromkeys(("list_problems", "methods", "run"), "api"),
    **dict.fromkeys(("BadInput", "DaebenchError", "InconsistentStart", "InvalidProblem", "RunFailed"), "errors"),
    **dict.fromkeys(("Case", "Chart", "ConstrainedHamiltonian", "KineticFlow", "Picture", "coordinates"), "problem"),
    **dict.fromkeys(("DarbouxMap", "Lift", "Part", "PoissonCase", "PoissonSystem"), "poisson_system"),
    **dict.fromkeys(("PoissonTrajectory", "Trajectory"), "trajectory"),
    **dict.fromkeys(("as_poisson", "symplectic_projection"), "submanifold"),
    "ConstrainedChain": "chains.chain",
    "PoissonLattice": "poisson_lattice",
    "InitialValueProblem": "ivp",
    "Study": "studies.study",
    "animation": "film.animation",
    "check": "claims_check",
    "compare": "comparison",
    "initial_value_problem": "ivp_constructor",
    "order": "order_study",
}


def __getattr__(name: str) -> Any:
    """Import what is asked for when it is asked for: NumPy alone takes longer than ``daebench list`` may."""
    if name == "problems":
        return import_module("daebench.problems")
    name = current_name(name)
    if name not in _HOME:
        raise AttributeError(f"module 'daebench' has no attribute {name!r}")
    return getattr(import_module(f"daebench.{_HOME[name]}"), name)

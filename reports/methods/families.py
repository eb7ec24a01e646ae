"""The methods of the report on methods, by family: the schemes of the catalogue, and some compositions, projections and forms."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

from daebench.methods.catalogue import schemes
from daebench.methods.fixed_step.compositions import COMPOSITIONS
from daebench.methods.fixed_step.constrained import FixedStep
from daebench.methods.fixed_step.forms import FORMS
from daebench.methods.fixed_step.parts import PROJECTIONS
from daebench.methods.formulations.table import FORMULATIONS
from daebench.methods.names import parse
from daebench.schemes.kernels.claims import WATER

COMPOSED, SPLIT = "rattle", "strang/suzuki4"
"""The scheme that every composition is applied to, and a composition of a splitting."""

BASES = ("midpoint", "rk4")
"""A symmetric and a non-symmetric method, which are combined with every projection and every form of the system."""

TITLES = {
    "symplectic": "constrained system (1.9), symplectic",
    "composed": "compositions of those",
    "other": "constrained system (1.9), not symplectic",
    "dae": "index 3, index 2 and GGL",
    "ode": "index-reduced ODE (1.18)",
    "projected": "(1.18), projected after each step",
    "form": "other forms of the system",
    "ida": "SUNDIALS IDA by formulation",
}
"""The families in the order of the page, by the equations that they solve."""

SYSTEMS = {"constrained": "(1.9)", "ode": "(1.18)", "index3": "index 3", "index2": "index 2", "ggl": "GGL", "local": "(2.22)"}
"""The equations that a method solves, in a word; a name that is missing here is displayed as it is."""


def left_out() -> list[str]:
    """Return the schemes for other systems: damped, rigid water, charged particles and constraints on velocities."""
    every = {name: method(name).claims for name in schemes()}
    reasons = {name: (its.conformal, its.charged_only, its.nonholonomic, its.constraints == WATER) for name, its in every.items()}
    return [name for name, special in reasons.items() if any(special)]


def names() -> list[str]:
    """Return the names of all fixed-step methods that apply to a motion of the report, by family, then by order, then by name."""
    applicable = [name for name in schemes() if name not in left_out()]
    method_names = [*applicable, *(f"{COMPOSED}/{composition}" for composition in COMPOSITIONS), SPLIT]
    method_names += [f"{base}+{projection}" for base in BASES for projection in PROJECTIONS]
    method_names += [f"{form}:{base}" for form in FORMS for base in BASES]
    return sorted(method_names, key=lambda name: (list(TITLES).index(family(name)), method(name).claims.order, name))


def solvers() -> list[str]:
    """Return IDA's methods, one per formulation."""
    return [f"ida:{formulation}" for formulation in FORMULATIONS]


def method(name: str, *, compiled: bool = False) -> FixedStep:
    """Return a fixed-step method: uncompiled, unless a run is so long that compilation saves time."""
    fixed_step = parse(name)
    assert isinstance(fixed_step, FixedStep)
    return replace(fixed_step, compiled=compiled)


def family(name: str) -> str:
    """Return the key of a method's family in :data:`TITLES`."""
    if name.startswith("ida:"):
        return "ida"
    fixed_step = method(name)
    parts = {"form": fixed_step.form, "composed": fixed_step.composition, "projected": fixed_step.projection}
    if variant := next((key for key, part in parts.items() if part), ""):
        return variant
    if fixed_step.claims.system == "constrained":
        return "symplectic" if fixed_step.claims.symplectic else "other"
    if fixed_step.claims.system == "ode":
        return "projected" if fixed_step.claims.on_manifold else "ode"
    return "dae"


def by_family(rows: Sequence[str]) -> Mapping[str, list[str]]:
    """Return names by the key of their family; families without names are left out."""
    names_by_family = {key: [name for name in rows if family(name) == key] for key in TITLES}
    return {key: members for key, members in names_by_family.items() if members}


SOFTENED = ("stiff", "soft")
"""The forms that replace the constraint by a spring, whose error no step size removes."""

"""The parts of a method's name: a table for constrained problems, and one for Poisson systems."""

from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, field
from functools import partial
from typing import TYPE_CHECKING, Any

from daebench.methods.catalogue import schemes
from daebench.methods.fixed_step.forms import FORMS, LIFTED, POISSON_FORMS
from daebench.methods.formulations.constrained import FORMULATIONS
from daebench.methods.formulations.poisson import POISSON_FORMULATIONS
from daebench.methods.registry import poisson_registry, registry
from daebench.methods.solvers.constrained_run import OnReducedOde
from daebench.methods.solvers.cvode import PROJECTED, Cvode, ProjectedCvode
from daebench.methods.solvers.heyoka_ode import HeyokaTaylor
from daebench.methods.solvers.ida import Ida
from daebench.methods.solvers.poisson_run import PoissonIda, PoissonOde
from daebench.methods.solvers.radau_dae import RadauDae
from daebench.methods.solvers.scipy_ode import ScipyOde

if TYPE_CHECKING:
    from daebench.runs.request import Method

Options = Mapping[str, float]
Solver = Callable[[str, "Options | None"], "Method[Any, Any]"]


@dataclass(frozen=True)
class Listed:
    """A method as the catalogue lists it, before anything heavy is imported."""

    name: str
    """Name in the grammar."""
    knob: str
    """"h" or "tol"."""
    system: str
    """Equations that it is applied to."""
    options: Options = field(default_factory=dict)
    """Free numbers and their defaults."""


@dataclass(frozen=True, eq=False)
class Kind:
    """Problems of one kind, and the parts of the names of their methods.

    Parameters
    ----------
    plural : str
        Plural of these problems in sentences.
    of_kind : str
        What follows "solver or form" in a sentence.
    solvers : mapping of str to callable
        Tolerance-driven solvers, each a function of the following part of a name and its free numbers.
    forms : mapping of str to str
        Prefixes of a scheme, with descriptions.
    schemes : callable
        Returns the names of the schemes.
    signs : mapping of str to str
        Suffixes of a scheme, by the sign before them, the outermost first.
    noun : callable
        Returns from a form, or "", what is unknown where a scheme is.
    listed : callable
        Returns all methods, schemes first.
    """

    plural: str
    of_kind: str
    solvers: Mapping[str, Solver]
    forms: Mapping[str, str]
    schemes: Callable[[], Collection[str]]
    signs: Mapping[str, str]
    noun: Callable[[str], str]
    listed: Callable[[], list[Listed]]


def solver_numbers(name: str) -> Options:
    """Return the free numbers of a solver's method and their defaults: ida:baumgarte has those of the form."""
    return FORMS["baumgarte"].options if name.startswith("ida:baumgarte") else {}


def _treated(variant: str) -> tuple[str, str | None]:
    """Return a formulation, and the treatment of its multipliers where one is named."""
    formulation, _, treatment = variant.partition(":")
    return formulation, treatment or None


def _cvode(variant: str, options: Options | None) -> "Method[Any, Any]":
    family, colon, manner = variant.partition(":")
    return ProjectedCvode.of(family, manner) if colon else Cvode(variant)


def _of_ode(solver: type[OnReducedOde], variant: str, options: Options | None) -> "Method[Any, Any]":
    return solver(variant)


def _of_poisson_ode(solver: type[OnReducedOde], variant: str, options: Options | None) -> "Method[Any, Any]":
    return PoissonOde(solver(variant))


ON_ODE: Mapping[str, type[OnReducedOde]] = {"cvode": Cvode, "scipy": ScipyOde, "heyoka": HeyokaTaylor}
"""Solvers of ODEs, each with its variants: of the index-reduced one, or of a Poisson system."""


def _constrained_methods() -> list[Listed]:
    fixed = [Listed(name, "h", member.claims.system, member.options) for name, (_, member) in sorted(registry().items())]
    solvers = [Listed(f"ida:{name}", "tol", name, solver_numbers(f"ida:{name}")) for name in FORMULATIONS]
    return [
        *fixed,
        *solvers,
        *_on_ode("ode"),
        Listed(f"cvode:{PROJECTED}", "tol", "ode"),
        Listed("solve_dae:Radau", "tol", "index2"),
    ]


def _poisson_methods() -> list[Listed]:
    ida = [Listed(f"ida:{name}", "tol", "poisson") for name in POISSON_FORMULATIONS]
    return [*(Listed(name, "h", "poisson") for name in poisson_registry()), *ida, *_on_ode("poisson")]


def _on_ode(system: str) -> list[Listed]:
    return [Listed(f"{name}:{variant}", "tol", system) for name, solver in ON_ODE.items() for variant in solver.variants]


CONSTRAINED = Kind(
    plural="constrained problems",
    of_kind="",
    solvers={
        "ida": lambda variant, options: Ida(*_treated(variant), options),
        **{name: partial(_of_ode, solver) for name, solver in ON_ODE.items()},
        "cvode": _cvode,
        "solve_dae": lambda variant, options: RadauDae.of(variant),
    },
    forms={name: form.about for name, form in FORMS.items()},
    schemes=schemes,
    signs={"+": "projection", "/": "composition"},
    noun=lambda form: "method",
    listed=_constrained_methods,
)
"""Constrained Hamiltonian systems."""

POISSON = Kind(
    plural="Poisson systems",
    of_kind=" of Poisson systems",
    solvers={
        "ida": lambda variant, options: PoissonIda(*_treated(variant)),
        **{name: partial(_of_poisson_ode, solver) for name, solver in ON_ODE.items()},
    },
    forms={
        **POISSON_FORMS,
        LIFTED: "a constrained system that maps to the Poisson system, HLW VII.5.3: any fixed-step method for constrained problems",
    },
    schemes=poisson_registry,
    signs={"/": "composition", "@": "splitting"},
    noun=lambda form: f"scheme after {form}:" if form else "method for Poisson systems",
    listed=_poisson_methods,
)
"""Poisson systems."""

KINDS = {"constrained": CONSTRAINED, "poisson": POISSON}
"""By the name of their state."""

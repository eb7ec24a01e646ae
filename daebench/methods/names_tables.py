"""The parts of a method's name: a table for constrained problems, and one for Poisson systems."""

from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, field
from functools import partial
from typing import TYPE_CHECKING, Any

from daebench.methods.catalogue import schemes
from daebench.methods.fixed_step.forms import FORMS, LIFTED, POISSON_FORMS
from daebench.methods.formulations.table import FORMULATIONS, POISSON_FORMULATIONS
from daebench.methods.registry import poisson_registry, registry
from daebench.methods.solvers import variants

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


def _ida(variant: str, options: Options | None) -> "Method[Any, Any]":
    from daebench.methods.solvers.ida import Ida

    formulation, _, treatment = variant.partition(":")
    return Ida(formulation, treatment or None, dict(options or {}))


def _poisson_ida(variant: str, options: Options | None) -> "Method[Any, Any]":
    from daebench.methods.solvers.poisson_run import PoissonIda

    formulation, _, treatment = variant.partition(":")
    return PoissonIda(formulation, treatment or None)


def _cvode(variant: str, options: Options | None) -> "Method[Any, Any]":
    from daebench.methods.solvers.cvode import Cvode

    return Cvode(variant)


def _projected_or_not(variant: str, options: Options | None) -> "Method[Any, Any]":
    family, colon, manner = variant.partition(":")
    if not colon:
        return _cvode(variant, options)
    from daebench.methods.solvers.cvode import ProjectedCvode

    return ProjectedCvode.of(family, manner)


def _scipy(variant: str, options: Options | None) -> "Method[Any, Any]":
    from daebench.methods.solvers.scipy_ode import ScipyOde

    return ScipyOde(variant)


def _heyoka(variant: str, options: Options | None) -> "Method[Any, Any]":
    from daebench.methods.solvers.heyoka_ode import HeyokaTaylor

    return HeyokaTaylor(variant)


def _solve_dae(variant: str, options: Options | None) -> "Method[Any, Any]":
    from daebench.methods.solvers.radau_dae import RadauDae

    return RadauDae.of(variant)


def _poisson_ode(solver: Callable[[str, Any], Any], variant: str, options: Options | None) -> "Method[Any, Any]":
    from daebench.methods.solvers.poisson_run import PoissonOde

    return PoissonOde(solver(variant, options))


ON_ODE: Mapping[str, tuple[Solver, Collection[str]]] = {
    "cvode": (_cvode, variants.CVODE),
    "scipy": (_scipy, variants.SCIPY),
    "heyoka": (_heyoka, variants.HEYOKA),
}
"""Solvers of ODEs and their variants: of the index-reduced one, or of a Poisson system. Each is imported when it is asked for."""


def _constrained_methods() -> list[Listed]:
    fixed = [Listed(name, "h", member.claims.system, member.options) for name, (_, member) in sorted(registry().items())]
    solvers = [Listed(f"ida:{name}", "tol", name, solver_numbers(f"ida:{name}")) for name in FORMULATIONS]
    return [
        *fixed,
        *solvers,
        *_on_ode("ode"),
        Listed(f"cvode:{variants.PROJECTED}", "tol", "ode"),
        Listed("solve_dae:Radau", "tol", "index2"),
    ]


def _poisson_methods() -> list[Listed]:
    ida = [Listed(f"ida:{name}", "tol", "poisson") for name in POISSON_FORMULATIONS]
    return [*(Listed(name, "h", "poisson") for name in poisson_registry()), *ida, *_on_ode("poisson")]


def _on_ode(system: str) -> list[Listed]:
    return [Listed(f"{name}:{variant}", "tol", system) for name, (_, variants) in ON_ODE.items() for variant in variants]


CONSTRAINED = Kind(
    plural="constrained problems",
    of_kind="",
    solvers={
        "ida": _ida,
        **{name: solver for name, (solver, _) in ON_ODE.items()},
        "cvode": _projected_or_not,
        "solve_dae": _solve_dae,
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
        "ida": _poisson_ida,
        **{name: partial(_poisson_ode, solver) for name, (solver, _) in ON_ODE.items()},
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

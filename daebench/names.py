"""The grammar of method names, parsed in this one place.

::

    method      = solver ":" variant | [ form ":" ] scheme [ "/" composition ] [ "+" projection ]
    Poisson     = solver ":" variant | [ "darboux:" ] scheme [ "@" splitting ] [ "/" composition ] | "lifted:" method
    solver      = "ida" | "cvode" | "scipy" | "heyoka" | "solve_dae"
    variant     = formulation [ ":" cure ] for ida, else the solver's own method on the index-reduced ODE
    cure        = "derivative" | "atol" | "none"      what keeps multipliers from spoiling IDA's error test
    form        = "local" | "stiff" | "baumgarte"     the form of the system that the scheme is run on
    scheme      = "rattle" | "lobatto3" | ...         any scheme in daebench/schemes
    composition = "suzuki4" | "kahan_li8" | ...       of a symmetric scheme of order 2
    projection  = "proj" | "symproj"                  after each step

Methods for Poisson systems have names of their own: their schemes are those in daebench/schemes/poisson, and the same name stands for
what the book calls so on either kind of system.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from daebench.catalogue import schemes
from daebench.errors import BadInput, unknown
from daebench.fixed_step import FixedStep
from daebench.forms import FORMS
from daebench.members import members
from daebench.method import Method
from daebench.pose import FORMULATIONS
from daebench.reference.cvode import Cvode
from daebench.reference.heyoka_ode import HeyokaTaylor
from daebench.reference.ida import Ida
from daebench.reference.radau_dae import RadauDae
from daebench.reference.scipy_ode import ScipyOde
from daebench.scene import Scene
from daebench.trajectory import Trajectory

ConstrainedMethod = Method[Scene, Trajectory]

ON_ODE = {each.solver: each for each in (Cvode, ScipyOde, HeyokaTaylor)}
"""Solvers of the index-reduced ODE by their names."""

SOLVERS = ("ida", *ON_ODE, "solve_dae")


@dataclass(frozen=True)
class Listed:
    """A method as the catalogue lists it, before anything heavy is imported.

    Parameters
    ----------
    name : str
        Name in the grammar.
    knob : str
        "h" or "tol".
    system : str
        What it is applied to.
    options : mapping of str to float
        Free numbers and their defaults.
    """

    name: str
    knob: str
    system: str
    options: Mapping[str, float] = field(default_factory=dict)


def listed() -> list[Listed]:
    """Return all methods, schemes first."""
    fixed = [Listed(name, "h", member.claims.system, member.options) for name, (_, member) in sorted(members().items())]
    solvers = [Listed(f"ida:{name}", "tol", name, _ida_numbers(f"ida:{name}")) for name in FORMULATIONS]
    solvers += [Listed(f"{each.solver}:{name}", "tol", "ode") for each in ON_ODE.values() for name in each.variants]
    return [*fixed, *solvers, Listed(RadauDae().name, "tol", RadauDae().formulation)]


def parse(name: str, options: Mapping[str, float] | None = None, *, compensated: bool = False) -> ConstrainedMethod:
    """Return the method of this name.

    Parameters
    ----------
    name : str
        A name in the grammar above.
    options : mapping of str to float, optional
        Free numbers of the method: alpha and beta of ida:baumgarte, eps of stiff:, rho_inf of generalized_alpha, ...
    compensated : bool
        Whether a fixed-step method compensates its sums over steps for rounding.

    Raises
    ------
    BadInput
        If the name or an option is unknown, or the parts of a name do not go together; the message has the nearest names.
    """
    if not isinstance(name, str):
        raise BadInput(f"a method is given by its name, not {name!r}.")
    head, colon, variant = name.partition(":")
    if colon and head in SOLVERS:
        if compensated:
            raise BadInput(f"{name} chooses its own steps and sums; compensated summation is for fixed-step methods.")
        return _solver(name, variant, options)
    if colon and head not in FORMS:
        raise unknown("solver or form", head, [*SOLVERS, *FORMS])
    return _fixed_step(name, head if colon else "", variant if colon else name, dict(options or {}), compensated)


def _fixed_step(name: str, form: str, rest: str, options: Mapping[str, float], compensated: bool) -> FixedStep:
    rest, plus, projection = rest.partition("+")
    scheme, slash, composition = rest.partition("/")
    if "/" in projection:
        first, _, second = projection.partition("/")
        raise BadInput(f"{name}: a composition comes before a projection; write {rest}/{second}+{first}.")
    if scheme not in schemes():
        known = schemes() if form or slash or plus else [each.name for each in listed()]
        raise unknown("method", scheme, known)
    for sign, part, what in ((slash, composition, "composition"), (plus, projection, "projection")):
        if sign and not part:
            raise BadInput(f"{name} ends with {sign}, and no {what} follows; name one, or leave it out.")
    return FixedStep(scheme, form, composition, projection, options, compensated)


def several(names: Sequence[str | ConstrainedMethod], options: Mapping[str, float] | None = None) -> list[ConstrainedMethod]:
    """Return the methods of these names, each with those of the options that it has; what is a method already stays as it is.

    Raises
    ------
    BadInput
        As :func:`parse`, or if an option is one of none of them.
    """
    given = dict(options or {})
    known = [free_numbers(parse(name)) if isinstance(name, str) else {} for name in names]
    for option in given:
        if not any(option in own for own in known):
            raise unknown("option of these methods", option, sorted({each for own in known for each in own}))
    return [
        parse(name, {x: given[x] for x in own if x in given}) if isinstance(name, str) else name
        for name, own in zip(names, known, strict=True)
    ]


def free_numbers(method: ConstrainedMethod) -> Mapping[str, float]:
    """Return the names of a method's free numbers and their defaults."""
    if isinstance(method, FixedStep):
        return method.free_numbers
    return _ida_numbers(method.name)


def _ida_numbers(name: str) -> Mapping[str, float]:
    """Return the free numbers of a solver's method: ida:baumgarte has those of the form."""
    return FORMS["baumgarte"].options if name.startswith("ida:baumgarte") else {}


def _solver(name: str, variant: str, options: Mapping[str, float] | None) -> ConstrainedMethod:
    allowed = _ida_numbers(name)
    for option in options or {}:
        if option not in allowed:
            raise unknown(f"option of {name}", option, allowed)
    if name.startswith("ida:"):
        formulation, _, cure = variant.partition(":")
        if formulation not in FORMULATIONS:
            raise unknown("formulation", formulation, FORMULATIONS)
        return Ida(formulation, cure or None, options)
    if name.startswith("solve_dae:"):
        return RadauDae.of(variant)
    return ON_ODE[name.partition(":")[0]](variant)

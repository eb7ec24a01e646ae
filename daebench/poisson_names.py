"""Names of methods for Poisson systems, parsed in this one place; the grammar is in :mod:`daebench.names`."""

from collections.abc import Callable, Mapping, Sequence
from functools import partial

from daebench import names
from daebench.errors import BadInput, unknown
from daebench.lifted import FORM as LIFTED
from daebench.lifted import Lifted
from daebench.members import poisson_members
from daebench.method import Method
from daebench.poisson_pose import FORMULATIONS
from daebench.poisson_step import FORMS, PoissonStep
from daebench.reference.poisson_ida import PoissonIda
from daebench.reference.poisson_ode import PoissonOde
from daebench.scene import PoissonScene
from daebench.trajectory import PoissonTrajectory

PoissonMethod = Method[PoissonScene, PoissonTrajectory]


def _on_ode(name: str, variant: str) -> PoissonOde:
    return PoissonOde(names.ON_ODE[name](variant))


SOLVERS: dict[str, Callable[[str], PoissonMethod]] = {
    "ida": lambda variant: PoissonIda(*_cured(variant)),
    **{name: partial(_on_ode, name) for name in names.ON_ODE},
}
"""Tolerance-driven solvers, each from the part of a name that follows it."""

ABOUT = {**FORMS, LIFTED: "a constrained system above, HLW VII.5.3: any fixed-step method for constrained problems, its states mapped down"}
"""What may come before a method for Poisson systems, and what it is."""


def listed() -> list[str]:
    """Return the names of all methods for Poisson systems, schemes first."""
    ida = [f"ida:{name}" for name in FORMULATIONS]
    others = [f"{each.solver}:{variant}" for each in names.ON_ODE.values() for variant in each.variants]
    return [*poisson_members(), *ida, *others]


def parse(name: str, options: Mapping[str, float] | None = None, *, compensated: bool = False, anyway: bool = False) -> PoissonMethod:
    """Return the method of this name.

    Parameters
    ----------
    name : str
        A name in the grammar for Poisson systems.
    options : mapping of str to float, optional
        Free numbers of the method; those that are lifted have some.
    compensated : bool
        Whether sums over steps are compensated; only methods that are lifted can.
    anyway : bool
        Whether a scheme may be run on a system that is not of the class for which it is a Poisson integrator.

    Raises
    ------
    BadInput
        If the name or an option is unknown, or the parts of a name do not go together; the message has the nearest names.
    """
    if not isinstance(name, str):
        raise BadInput(f"a method is given by its name, not {name!r}.")
    head, colon, rest = name.partition(":")
    if colon and head == LIFTED:
        return Lifted.of(names.parse(rest, options, compensated=compensated))
    if compensated and colon and head in SOLVERS:
        raise BadInput(f"{name} chooses its own steps and sums; compensated summation is for fixed-step methods.")
    if compensated:
        raise BadInput(f"{name} does not give its increments, which compensated summation needs; leave it out.")
    for option in options or {}:
        raise unknown(f"option of {name}", option, ())
    if colon and head in SOLVERS:
        return SOLVERS[head](rest)
    if colon and head not in FORMS:
        raise unknown("solver or form of Poisson systems", head, [*SOLVERS, *ABOUT])
    return _fixed_step(name, head if colon else "", rest if colon else name, anyway)


def _cured(variant: str) -> tuple[str, str | None]:
    """Return the formulation and the cure of ida:formulation[:cure]."""
    formulation, _, cure = variant.partition(":")
    return formulation, cure or None


def _fixed_step(name: str, form: str, rest: str, anyway: bool) -> PoissonStep:
    if "+" in rest:
        raise BadInput(f"{name}: projections are for constrained problems; leave out +{rest.partition('+')[2]}.")
    rest, slash, composition = rest.partition("/")
    scheme, at, splitting = rest.partition("@")
    for sign, part, what in ((slash, composition, "composition"), (at, splitting, "splitting")):
        if sign and not part:
            raise BadInput(f"{name} ends with {sign}, and no {what} follows; name one, or leave it out.")
    if not scheme:
        raise BadInput(f"{name} names no scheme; it has one of {', '.join(poisson_members())}.")
    if scheme not in poisson_members():
        raise unknown(f"scheme after {form}:" if form else "method for Poisson systems", scheme, poisson_members() if form else listed())
    return PoissonStep(scheme, form, splitting, composition, anyway)


def several(
    given: Sequence[str | PoissonMethod], options: Mapping[str, float] | None = None, *, anyway: bool = False
) -> list[PoissonMethod]:
    """Return the methods of these names, each with those of the options that it has; what is a method already stays as it is.

    Raises
    ------
    BadInput
        As :func:`parse`, or if an option is one of none of them.
    """
    values = dict(options or {})
    known = [free_numbers(parse(each, anyway=anyway)) if isinstance(each, str) else {} for each in given]
    for option in values:
        if not any(option in own for own in known):
            raise unknown("option of these methods", option, sorted({each for own in known for each in own}))
    return [
        parse(each, {x: values[x] for x in own if x in values}, anyway=anyway) if isinstance(each, str) else each
        for each, own in zip(given, known, strict=True)
    ]


def free_numbers(method: PoissonMethod) -> Mapping[str, float]:
    """Return the names of a method's free numbers and their defaults: those of the method that is lifted."""
    return names.free_numbers(method.method) if isinstance(method, Lifted) else {}

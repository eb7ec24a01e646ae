"""The grammar of method names, and its parser.

::

    name        = method | "FILE.py:NAME" | "LIBRARY.so:NAME" | "exec:PROGRAM"
    method      = solver ":" variant | [ form ":" ] scheme [ "/" composition ] [ "+" projection ]
    Poisson     = solver ":" variant | [ "darboux:" ] scheme [ "@" splitting ] [ "/" composition ] | "lifted:" method
    solver      = "ida" | "cvode" | "scipy" | "heyoka" | "solve_dae"
    variant     = formulation [ ":" treatment ] for ida, else the solver's own method on the index-reduced ODE; "bdf:projected" for cvode
    treatment   = "derivative" | "atol" | "none" | "suppress"     how multipliers enter IDA's error test
    form        = "local" | "canonical" | "stiff" | "soft" | "baumgarte"     the form of the system that the scheme is run on
    scheme      = "rattle" | "lobatto3" | ...         any scheme in daebench/schemes
    composition = "suzuki4" | "kahan_li8" | ...       of a symmetric scheme of order 2
    projection  = "proj" | "symproj"                  after each step

Methods for Poisson systems have separate names: their schemes are those in daebench/schemes/poisson, and a name has the meaning of the book
on either kind of system. The allowed parts are in ``names_tables``, with a table for each kind of problems.
"""

from collections.abc import Callable, Mapping, Sequence
from functools import cache
from typing import Any, cast

from daebench.errors import BadInput, unknown
from daebench.methods.fixed_step.base import FixedStepMethod
from daebench.methods.fixed_step.constrained import FixedStep
from daebench.methods.fixed_step.forms import LIFTED
from daebench.methods.fixed_step.lifted import Lifted
from daebench.methods.fixed_step.parts import Parts
from daebench.methods.fixed_step.poisson import PoissonStep
from daebench.methods.names_tables import CONSTRAINED, KINDS, POISSON, Kind, solver_numbers
from daebench.methods.outside.callables import method_of_callable
from daebench.methods.outside.method import OutsideMethod
from daebench.methods.outside.read import is_outside, method_from, program_of
from daebench.runs.ivp import Ivp
from daebench.runs.request import Method

Code = str | Callable[..., Any] | list[str]
"""A method: its name, or code from outside."""

__all__ = [
    "CONSTRAINED",
    "KINDS",
    "POISSON",
    "Code",
    "Kind",
    "fixed_step_method_of",
    "free_numbers",
    "kind_of",
    "method_of",
    "methods_of",
    "parse",
    "several",
]


def kind_of(ivp: Ivp) -> Kind:
    """Return the kind of a problem: :data:`CONSTRAINED` or :data:`POISSON`."""
    return KINDS[ivp.state.name]


def parse(
    name: Code, options: Mapping[str, float] | None = None, *, kind: Kind = CONSTRAINED, compensated: bool = False, anyway: bool = False
) -> Any:
    """Return the method of this name for problems of a kind.

    Parameters
    ----------
    name : str or callable
        A name in the grammar above, or code from outside, see :func:`daebench.methods.outside.callables.method_of_callable`; a list of
        words is a program with its arguments, as ``exec:`` has it.
    options : mapping of str to float, optional
        Free numbers of the method: alpha and beta of ida:baumgarte, eps of stiff:, impedance of soft:, rho_inf of generalized_alpha, ...
    kind : Kind
        :data:`CONSTRAINED` or :data:`POISSON`.
    compensated : bool
        Whether a fixed-step method compensates its sums over steps for rounding; for Poisson systems only lifted methods can.
    anyway : bool
        Whether a scheme may be run on a Poisson system outside of the class for which it is a Poisson integrator.

    Returns
    -------
    Method

    Raises
    ------
    BadInput
        If the name or an option is unknown, or the parts of a name do not fit together; the message has the nearest names.

    Examples
    --------
    >>> parse("rattle/suzuki4").claims.order
    4
    >>> parse("ida:index2").knob
    'tol'
    """
    if not isinstance(name, str) or is_outside(name):
        return _outside(name, options, compensated=compensated)
    head, colon, rest = name.partition(":")
    if colon and head == LIFTED and LIFTED in kind.forms:
        return Lifted.of(parse(rest, options, compensated=compensated))
    solver = kind.solvers.get(head) if colon else None
    if compensated:
        _require_increments(kind, name, chooses_steps=solver is not None)
    if kind is POISSON or solver:
        _require_options(name, options, solver_numbers(name) if kind is CONSTRAINED else {})
    if solver:
        return solver(rest, options)
    if colon and head not in kind.forms:
        raise unknown(f"solver or form{kind.of_kind}", head, [*kind.solvers, *kind.forms])
    form, rest = (head, rest) if colon else ("", name)
    scheme, parts = _parts(kind, name, form, rest)
    if kind is POISSON:
        return PoissonStep(scheme, form, parts["splitting"], parts["composition"], anyway)
    return FixedStep(scheme, form, parts["composition"], parts["projection"], dict(options or {}), compensated)


def _outside(code: Code, options: Mapping[str, float] | None, *, compensated: bool) -> OutsideMethod:
    """Return the method of a callable, or that at a place, or of a program; it has no options, and sums over its steps itself."""
    place = program_of(code) if isinstance(code, list) else code
    method = method_from(place) if isinstance(place, str) else method_of_callable(place)
    _require_options(method.name, options, {})
    if compensated:
        raise BadInput(f"{method.name} is from outside, and sums over its steps itself; leave compensated out.", "compensated-from-outside")
    return method


def _require_increments(kind: Kind, name: str, *, chooses_steps: bool) -> None:
    if chooses_steps:
        raise BadInput(f"{name} chooses its own steps and sums; compensated summation is for fixed-step methods.", "compensated-own-steps")
    if kind is POISSON:
        raise BadInput(
            f"{name} does not give its increments, which compensated summation needs; leave it out.", "compensated-no-increments"
        )


def _require_options(name: str, options: Mapping[str, float] | None, allowed: Mapping[str, float]) -> None:
    for option in options or {}:
        if option not in allowed:
            raise unknown(f"option of {name}", option, allowed)


def _parts(kind: Kind, name: str, form: str, rest: str) -> tuple[str, dict[str, str]]:
    """Return the scheme, and what follows it: composition, and projection or splitting."""
    before, plus, after = rest.partition("+")
    if plus and "+" not in kind.signs:
        raise BadInput(f"{name}: projections are for constrained problems; leave out +{after}.", "projection-unconstrained")
    if "/" in after:
        projection, _, composition = after.partition("/")
        raise BadInput(
            f"{name}: a composition comes before a projection; write {before}/{composition}+{projection}.", "composition-after-projection"
        )
    scheme, parts, empty = rest, {}, []
    for sign, part in kind.signs.items():
        scheme, present, parts[part] = scheme.partition(sign)
        if present and not parts[part]:
            empty.append(f"{name} ends with {sign}, and no {part} follows; name one, or leave it out.")
    if scheme not in kind.schemes():
        raise _unknown_scheme(kind, name, form, scheme, alone=scheme == rest)
    if empty:
        raise BadInput(empty[0], "method-part-empty")
    return scheme, parts


def _unknown_scheme(kind: Kind, name: str, form: str, scheme: str, *, alone: bool) -> BadInput:
    """Return the error for a scheme that is not known; where it stands alone, a solver may have been meant."""
    if kind is POISSON and not scheme:
        return BadInput(f"{name} names no scheme; it has one of {', '.join(kind.schemes())}.", "no-scheme-named")
    known = [method.name for method in kind.listed()] if alone and not form else kind.schemes()
    return unknown(kind.noun(form), scheme, known)


def several(
    names: Sequence[Code | Method[Any, Any]],
    options: Mapping[str, float] | None = None,
    *,
    kind: Kind = CONSTRAINED,
    anyway: bool = False,
) -> list[Any]:
    """Return the methods of these names, or of code from outside, each with its own options; a method is returned unchanged.

    Raises
    ------
    BadInput
        As :func:`parse`, or if no method has an option.
    """
    values = dict(options or {})
    given = [name if isinstance(name, str) or _is_method(name) else parse(cast(Code, name)) for name in names]
    # Parsed once without options: only the method itself says which of them it has, and one that it has not would be refused.
    known = [free_numbers(parse(name, kind=kind, anyway=anyway)) if isinstance(name, str) else {} for name in given]
    for option in values:
        if not any(option in numbers for numbers in known):
            raise unknown("option of these methods", option, sorted({number for numbers in known for number in numbers}))
    return [
        parse(name, {x: values[x] for x in numbers if x in values}, kind=kind, anyway=anyway) if isinstance(name, str) else name
        for name, numbers in zip(given, known, strict=True)
    ]


def _is_method(code: Any) -> bool:
    """Return whether an object is a method, and not code that could become one."""
    return hasattr(code, "knob") and hasattr(code, "refusal")


def free_numbers(method: Method[Any, Any]) -> Mapping[str, float]:
    """Return the names of a method's free numbers and their defaults; a lifted method has those of its method."""
    scheme = method.method if isinstance(method, Lifted) else method
    return scheme.free_numbers if isinstance(scheme, Parts) else solver_numbers(method.name)


def method_of(
    ivp: Ivp,
    name: Code,
    options: Mapping[str, float] | None = None,
    *,
    compensated: bool = False,
    anyway: bool = False,
) -> Any:
    """Return the method of this name for problems of this kind.

    Raises
    ------
    BadInput
        If the name or an option is unknown, the parts of a name do not fit together, or the method is for the other kind of problems.
    """
    _require_kind(ivp, [name], anyway)
    return parse(name, options, kind=kind_of(ivp), compensated=compensated, anyway=anyway)


def fixed_step_method_of(
    ivp: Ivp, name: Code, options: Mapping[str, float] | None = None, *, anyway: bool = False
) -> FixedStepMethod[Any, Any]:
    """Return the method of this name for runs from many starts at once.

    Raises
    ------
    BadInput
        As :func:`method_of`, or if it is not a fixed-step method of daebench.
    """
    method = method_of(ivp, name, options, anyway=anyway)
    if not isinstance(method, FixedStepMethod):
        raise BadInput(
            f"{name} is not a fixed-step method of daebench, which ensembles need; choose one, for example rattle.",
            "not-a-fixed-step-method",
        )
    return method


def methods_of(
    ivp: Ivp, names: Sequence[Code | Method[Any, Any]], options: Mapping[str, float] | None = None, *, anyway: bool = False
) -> list[Any]:
    """Return the methods of these names for problems of this kind, each with its own options.

    Raises
    ------
    BadInput
        As :func:`method_of`, or if no method has an option.
    """
    _require_kind(ivp, names, anyway)
    return several(names, options, kind=kind_of(ivp), anyway=anyway)


def _require_kind(ivp: Ivp, names: Sequence[Any], anyway: bool) -> None:
    """Refuse known methods for the other kind of problems; code from outside is for either kind, and is not executed here."""
    kind = kind_of(ivp)
    other = CONSTRAINED if kind is POISSON else POISSON
    if anyway and kind is CONSTRAINED:
        raise BadInput(
            f"anyway is for schemes on Poisson systems, and {ivp.problem} is {ivp.state.words}; leave it out.", "anyway-not-on-poisson"
        )
    for name in names:
        if isinstance(name, str) and not is_outside(name) and _known(other, name) and not _known(kind, name):
            raise BadInput(
                f"{name} is for {other.plural}, and {ivp.problem} is {ivp.state.words}; daebench list methods has those for both.",
                "method-of-other-kind",
            )


@cache
def _known(kind: Kind, name: str) -> bool:
    try:
        parse(name, kind=kind)
    except BadInput:
        return False
    return True

"""The grammar of method names, parsed in this one place.

::

    method   = solver ":" variant | scheme
    solver   = "ida" | "cvode" | "scipy"
    variant  = formulation [ ":" cure ] for ida, else the solver's own method on the index-reduced ODE
    cure     = "derivative" | "atol" | "none"      what keeps multipliers from spoiling IDA's error test
    scheme   = "rattle" | "se" | ...      any file in daebench/schemes
"""

from collections.abc import Mapping
from dataclasses import dataclass

from daebench.catalogue import schemes
from daebench.errors import BadInput, unknown
from daebench.method import Method

FORMULATIONS = {
    "index3": "(1.9) as it stands: q, p (or v), lam with 0 = g(q)",
    "index2": "(1.9) with 0 = G H_p, HLW (1.11), in place of g = 0",
    "index1": "(1.9) with HLW (1.12) in place of g = 0",
    "ggl": "Gear-Gupta-Leimkuhler: both g = 0 and G H_p = 0, with a second multiplier",
    "baumgarte": "index1 with (1.12) + 2 alpha G H_p + beta^2 g = 0; alpha = beta = 10 by default",
    "ode": "HLW (1.18): lam(p, q) solved for and inserted",
}
CVODE = ("adams", "bdf")
SCIPY = ("DOP853", "RK45", "RK23", "Radau", "BDF", "LSODA")
SOLVERS = ("ida", "cvode", "scipy")


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
    """

    name: str
    knob: str
    system: str


def listed() -> list[Listed]:
    """Return all methods, schemes first."""
    from daebench.fixed_step import FixedStep

    fixed = [Listed(name, "h", FixedStep(name).claims.system) for name in schemes()]
    solvers = [Listed(f"ida:{name}", "tol", name) for name in FORMULATIONS]
    solvers += [Listed(f"{solver}:{name}", "tol", "ode") for solver, names in (("cvode", CVODE), ("scipy", SCIPY)) for name in names]
    return fixed + solvers


def parse(name: str, options: Mapping[str, float] | None = None) -> Method:
    """Return the method of this name.

    Parameters
    ----------
    name : str
        A name in the grammar above.
    options : mapping of str to float, optional
        Free numbers of the method: alpha and beta of ida:baumgarte.

    Raises
    ------
    BadInput
        If the name or an option is unknown; the message has the nearest names.
    """
    if not isinstance(name, str):
        raise BadInput(f"a method is given by its name, not {name!r}.")
    solver, colon, variant = name.partition(":")
    allowed = ("alpha", "beta") if name.startswith("ida:baumgarte") else ()
    for option in options or {}:
        if option not in allowed:
            raise unknown(f"option of {name}", option, allowed)
    if not colon:
        if name not in schemes():
            raise unknown("method", name, [each.name for each in listed()])
        from daebench.fixed_step import FixedStep

        return FixedStep(name)
    if solver not in SOLVERS:
        raise unknown("method", name, [each.name for each in listed()])
    return _solver(solver, variant, options)


def _solver(solver: str, variant: str, options: Mapping[str, float] | None) -> Method:
    if solver == "ida":
        formulation, _, cure = variant.partition(":")
        if formulation not in FORMULATIONS:
            raise unknown("formulation", formulation, FORMULATIONS)
        from daebench.reference.ida import Ida

        return Ida(formulation, cure or None, options)
    known = CVODE if solver == "cvode" else SCIPY
    if variant not in known:
        raise unknown(f"method of {solver}", variant, known)
    if solver == "cvode":
        from daebench.reference.cvode import Cvode

        return Cvode(variant)
    from daebench.reference.scipy_ode import ScipyOde

    return ScipyOde(variant)

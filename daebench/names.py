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
from daebench.fixed_step import FixedStep
from daebench.method import Method
from daebench.pose import FORMULATIONS
from daebench.reference.cvode import Cvode
from daebench.reference.ida import Ida
from daebench.reference.scipy_ode import ScipyOde

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
    fixed = [Listed(name, "h", FixedStep(name).claims.system) for name in schemes()]
    solvers = [Listed(f"ida:{name}", "tol", name) for name in FORMULATIONS]
    solvers += [Listed(f"{each.solver}:{name}", "tol", "ode") for each in (Cvode, ScipyOde) for name in each.variants]
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
    if not colon and name in schemes():
        return FixedStep(name)
    if not colon or solver not in SOLVERS:
        raise unknown("method", name, [each.name for each in listed()])
    return _solver(solver, variant, options)


def _solver(solver: str, variant: str, options: Mapping[str, float] | None) -> Method:
    if solver == "ida":
        formulation, _, cure = variant.partition(":")
        if formulation not in FORMULATIONS:
            raise unknown("formulation", formulation, FORMULATIONS)
        return Ida(formulation, cure or None, options)
    return Cvode(variant) if solver == "cvode" else ScipyOde(variant)

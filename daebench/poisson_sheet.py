"""The sheet of a Poisson system: its size, names and initial values as plain Python, so that a second run needs no SymPy."""

import sympy as sp

from daebench import codegen
from daebench.poisson_derivation import PoissonDerivation


def source(problem: str, derivation: PoissonDerivation) -> str:
    """Return the source of a Poisson system's sheet.

    The sheet has KIND, N (size), PARAMETERS (name to default, in the order of ``par``), POSITIVE (parameters that must be), CASES (name
    to its parameters and about), CASIMIRS and INTEGRALS (names), DOMAIN (texts of what stays positive), CONSTANT, BILINEAR (classes of B,
    see :data:`daebench.claims.CLASSES`), HALVES, SPLITTINGS (names), LINEAR and QUADRATIC (names of integrals that are), CLOSED_FORM,
    DARBOUX, LIFT (name of the problem above, or ""), SITES (of a lattice, or 0), and INITIAL (case to a function of
    ``par`` that returns y).
    """
    definition = derivation.problem
    facts = {
        "KIND": "poisson",
        "N": derivation.n,
        "PARAMETERS": {str(symbol): float(value) for symbol, value in definition.parameters.items()},
        "POSITIVE": tuple(str(symbol) for symbol in definition.parameters if symbol.is_positive),
        "CASES": {name: {"parameters": dict(case.parameters), "about": case.about} for name, case in definition.cases.items()},
        "CASIMIRS": tuple(definition.casimirs),
        "INTEGRALS": tuple(definition.integrals),
        "DOMAIN": tuple(map(str, definition.domain)),
        "CONSTANT": derivation.constant,
        "BILINEAR": derivation.bilinear,
        "HALVES": derivation.halves,
        "SPLITTINGS": {name: tuple(parts) for name, parts in definition.splittings.items()},
        "LINEAR": derivation.linear,
        "QUADRATIC": derivation.quadratic,
        "CLOSED_FORM": definition.closed_form is not None,
        "SITES": 0,
        "DARBOUX": definition.darboux is not None,
        "LIFT": definition.lift.problem if definition.lift else "",
    }
    lines = [f'"""Facts about {problem}."""', "from numpy import *", *(f"{name} = {value!r}" for name, value in facts.items())]
    for k, case in enumerate(definition.cases.values()):
        values = [sp.sympify(value) for value in case.y]
        lines.append(codegen.expressions(f"initial_{k}", {}, values, (derivation.n,), derivation.parameters))
    pairs = ", ".join(f"{name!r}: initial_{k}" for k, name in enumerate(definition.cases))
    return "\n".join([*lines, f"INITIAL = {{{pairs}}}", ""])

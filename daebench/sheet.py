"""The sheet of a problem: its sizes, names and initial values as plain Python, so that a second run needs no SymPy."""

from typing import Any

import sympy as sp

from daebench import codegen
from daebench.chains.chain import ConstrainedChain
from daebench.derive import Derivation
from daebench.problem import ConstrainedHamiltonian


def source(problem: str, derivation: Derivation) -> str:
    """Return the source of a problem's sheet.

    The sheet has KIND, D and M (sizes), PARAMETERS (name to default, in the order of ``par``), POSITIVE (parameters that must be),
    CASES (name to its parameters, about and on_singular), INTEGRALS (names), SEPARABLE, QUADRATIC, EXPLICIT, CLOSED_FORM, KINETIC_FLOW,
    CHART, and INITIAL (case to a function of ``par`` that returns p and q).
    """
    definition = derivation.problem
    facts = common_facts(definition, derivation.d, derivation.m) | {
        "INTEGRALS": tuple(definition.integrals),
        "SEPARABLE": derivation.separable,
        "QUADRATIC": derivation.quadratic,
        "EXPLICIT": derivation.explicit,
        "CLOSED_FORM": definition.closed_form is not None,
        "KINETIC_FLOW": definition.kinetic_flow is not None,
        "CHART": definition.chart is not None,
    }
    lines = [f'"""Facts about {problem}."""', "from numpy import *", *(f"{name} = {value!r}" for name, value in facts.items())]
    for k, case in enumerate(definition.cases.values()):
        values = [sp.sympify(value) for value in (*case.p, *case.q)]
        lines.append(codegen.expressions(f"initial_{k}", {}, values, (2, derivation.d), derivation.parameters))
    pairs = ", ".join(f"{name!r}: initial_{k}" for k, name in enumerate(definition.cases))
    return "\n".join([*lines, f"INITIAL = {{{pairs}}}", ""])


def common_facts(definition: ConstrainedHamiltonian | ConstrainedChain, d: int, m: int) -> dict[str, Any]:
    """Return what sheets say of constrained systems however they are written: kind, sizes, parameters and cases."""
    return {
        "KIND": "constrained",
        "D": d,
        "M": m,
        "PARAMETERS": {str(symbol): float(value) for symbol, value in definition.parameters.items()},
        "POSITIVE": tuple(str(symbol) for symbol in definition.parameters if symbol.is_positive),
        "CASES": {
            name: {"parameters": dict(case.parameters), "about": case.about, "on_singular": case.on_singular}
            for name, case in definition.cases.items()
        },
    }

"""The facts of a definition: sizes, names and starts as plain Python, so that a second run needs no SymPy."""

import types
from typing import Any

CASE = {"constrained": ("about", "on_singular"), "poisson": ("about",)}
"""Facts of a case besides its parameters, by the kind of the problem."""


def facts(problem: str, derivation: Any) -> str:
    """Return the source of a module with the facts of a problem.

    The module has KIND, PARAMETERS (name to default, in the order of ``par``), POSITIVE (parameters that must be positive), CASES (name
    to its parameters and to what :data:`CASE` names), the facts that the derivation gives, and INITIAL (case to a function of ``par``
    that returns p and q, or y).
    """
    definition = derivation.definition
    values = {
        "KIND": derivation.states,
        "PARAMETERS": {str(symbol): float(value) for symbol, value in definition.parameters.items()},
        "POSITIVE": tuple(str(symbol) for symbol in definition.parameters if symbol.is_positive),
        "CASES": {
            name: {"parameters": {parameter: _plain(value) for parameter, value in case.parameters.items()}}
            | {fact: getattr(case, fact) for fact in CASE[derivation.states]}
            for name, case in definition.cases.items()
        },
    }
    # The values are written as Python writes them: inf and nan among them are names of NumPy, as are the functions of initial values.
    lines = [f'"""Facts about {problem}."""', "import numpy", "from numpy import *"]
    lines += [f"{name} = {value!r}" for name, value in (values | dict(derivation.facts())).items()]
    lines += [derivation.initial(f"initial_{k}", case) for k, case in enumerate(definition.cases.values())]
    pairs = ", ".join(f"{name!r}: initial_{k}" for k, name in enumerate(definition.cases))
    return "\n".join([*lines, f"INITIAL = {{{pairs}}}", ""])


def _plain(value: Any) -> float:
    """Return a number as one of Python: others, such as NumPy's, write themselves as calls."""
    return value if type(value) is int else float(value)


WORK = ("H_p", "H_q", "g", "G", "second", "solve", "newton")
"""On constrained problems: evaluations of H_p, H_q, g, G, second derivatives, linear solves, Newton iterations."""

POISSON_WORK = ("field", "half", "flow", "second", "solve", "newton")
"""On Poisson systems: evaluations of B grad H, of one half of its components, and of flows of parts; then as in :data:`WORK`."""


WRITTEN_OUT = 24
"""Number of positions up to which vectors are tuples. At this size straight-line code takes minutes to compile, and beyond far longer."""

PLAIN = ("float64", "float32", "complex128")
"""Number types of which there are arrays."""


def in_loops(facts: types.ModuleType, precision: str = "float64") -> bool:
    """Return whether compiled functions of a problem with these facts use arrays and loops. Long chains have their own representation."""
    if facts.KIND != "constrained" or getattr(facts, "NODES", 0):
        return False
    return int(facts.D) > WRITTEN_OUT and precision in PLAIN

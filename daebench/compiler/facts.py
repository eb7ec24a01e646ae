"""Quantities derived from a definition, and its facts: sizes, names and starts as plain Python, so that a second run needs no SymPy."""

import types
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from typing import Any


class Derived(ABC):
    """Quantities derived from the definition of a problem of any kind; the interface for the linker and the facts."""

    definition: Any
    """The definition, with its ``parameters`` and ``cases``."""

    states: str
    """Kind of the problem, "constrained" or "poisson": the name of the file in ``kernels/`` that defines a state."""

    work: Sequence[str]
    """Kinds of work that are counted."""

    @abstractmethod
    def facts(self) -> Mapping[str, Any]:
        """Return the facts that problems of this kind have, by name."""

    @abstractmethod
    def initial(self, name: str, case: Any) -> str:
        """Return the source of a function of this name and of ``par`` that returns the initial values of a case."""

    @property
    def costs(self) -> Mapping[str, list[int]]:
        """Work of one call, for functions whose work does not follow from their names: none."""
        return {}

    def needs(self, name: str) -> Sequence[str]:
        """Return the names of other functions of the problem that this one calls: none."""
        return ()

    @property
    def named(self) -> Mapping[str, tuple[str, str]]:
        """Functions of the problem that are attributes: names of their arguments, and letters of their shapes; none."""
        return {}

    @property
    def sizes(self) -> Mapping[str, int]:
        """Sizes by the letters of shapes: none."""
        return {}

    @property
    def _rules(self) -> Mapping[str, Callable[[], Any]]:
        """Arguments, values and shape of each other function; nothing is derived before a rule is called."""
        return {}

    def rule(self, name: str) -> Any:
        """Return the arguments, entries and shape of the problem's function of this name, or None if it has no expression."""
        if name in self._rules:
            return self._rules[name]()
        if name not in self.named:
            return None
        arguments, shape = self.named[name]
        value = getattr(self, name)
        return {x: list(getattr(self, x)) for x in arguments.split()}, value if shape else [value], tuple(self.sizes[x] for x in shape)

    def tracer(self, linker: Any) -> Any:
        """Return the tracer that writes its functions from loops over nodes; None, except for a chain."""
        return None


CASE = {"constrained": ("about", "on_singular"), "poisson": ("about",)}
"""Facts of a case besides its parameters, by the kind of the problem."""


def facts(problem: str, derivation: Derived) -> str:
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

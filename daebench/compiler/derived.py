"""The base of the derivations of all kinds of problems: quantities as functions, for the linker and the facts."""

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from daebench.compiler.codegen import Arguments, expressions
from daebench.compiler.expressions import Expressions, Symbols

Rule = tuple[Arguments, Expressions, tuple[int, ...]]
"""Arguments, values and shape of a function."""

Rules = dict[str, Callable[[], Rule]]
"""What returns these, by the names of functions."""


class Derived(ABC):
    """Quantities derived from the definition of a problem of any kind; the interface for the linker and the facts."""

    definition: Any
    """The definition, with its ``parameters`` and ``cases``."""

    states: str
    """Kind of the problem, "constrained" or "poisson": the name of the file in ``kernels/`` that defines a state."""

    work: Sequence[str]
    """Kinds of work that are counted."""

    parameters: Symbols
    """Symbols of the parameters."""

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

    def text(self, name: str, arguments: Arguments, values: Sequence[Any], shape: tuple[int, ...] = (1,)) -> str:
        """Return the source of name(*arguments, par), a function of tuples; of values without a shape, as a tuple."""
        return expressions(name, arguments, values, shape, self.parameters)

    def source(self, name: str) -> str | None:
        """Return the source of the problem's function of this name, or None if it is not an expression of this problem."""
        rule = self.rule(name)
        return None if rule is None else self.text(name, *rule)

    def tracer(self, linker: Any) -> Any:
        """Return the tracer that writes its functions from loops over nodes; None, except for a chain."""
        return None

"""Functions that are written beside those of a generated module."""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any


@dataclass(frozen=True)
class Wrapper:
    """Functions that are written beside those of a generated module, and call them."""

    text: str
    """Their source."""
    roots: tuple[str, ...]
    """Names of the functions that are called from Python."""
    derived: Callable[[Any], str] | None = field(default=None, repr=False)
    """Returns the source of further functions, given the derivation of the problem, which alone determines it."""

    def source(self, derivation: Any) -> str:
        """Return their source."""
        return f"{self.text}\n\n{self.derived(derivation)}" if self.derived else self.text

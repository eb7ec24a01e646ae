"""Functions that are written beside those of a generated module."""

import sys
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any


@dataclass(frozen=True)
class Wrapper:
    """Functions that are written beside those of a generated module, and call them.

    Parameters
    ----------
    text : str
        Their source.
    roots : tuple of str
        Names of the functions that are called from Python.
    called_back : bool
        Whether some are called from C, see :data:`daebench.compiler.callbacks.SIGNATURES`.
    derived : callable, optional
        Returns the source of further functions, given the derivation of the problem, which alone determines it.
    """

    text: str
    roots: tuple[str, ...]
    called_back: bool = False
    derived: Callable[[Any], str] | None = field(default=None, repr=False)

    def source(self, derivation: Any) -> str:
        """Return their source."""
        return f"{self.text}\n\n{self.derived(derivation)}" if self.derived else self.text

    def decorated(self, derivation: Any, *, cached: bool) -> str:
        """Return their source, decorated for numba."""
        from daebench.compiler.callbacks import IMPORTS, NUMBA, noted
        from daebench.compiler.syntax import NONE, decorated
        from daebench.compiler.written import constants, text_of

        text = self.source(derivation)
        if not self.called_back:
            return decorated(text, self.roots, cached)
        needed = [IMPORTS, constants(sys.modules[noted.__module__]), f"@linked_only\n{text_of(noted)}"]
        return "\n\n".join([*needed, decorated(text, self.roots, cached, NONE, NUMBA)])

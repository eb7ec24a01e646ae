"""Libraries that are slow to import, each imported where it is first used: ``from daebench.systems.lazily import pandas as pd``.

lazy_loader would do the same, but leaves an unfinished module in ``sys.modules``, where other libraries look for what is there.
"""

from contextlib import suppress
from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import matplotlib as matplotlib
    import matplotlib.colors
    import matplotlib.patches
    import matplotlib.ticker
    import mpmath as mpmath
    import pandas as pandas
    import scipy as scipy
    import sympy as sympy
else:

    class Later:
        """A library, or a package of one, by its name."""

        def __init__(self, name: str) -> None:
            self._name = name

        def __getattr__(self, attribute: str) -> Any:
            if attribute.startswith("__"):  # those who ask whether this is a function or a wrapper do not need the library
                raise AttributeError(attribute)
            module = import_module(self._name)
            with suppress(ModuleNotFoundError):  # a package within this one
                import_module(f"{self._name}.{attribute}")
            value = getattr(module, attribute)
            setattr(self, attribute, value)
            return value

    matplotlib, mpmath, pandas, scipy, sympy = map(Later, ("matplotlib", "mpmath", "pandas", "scipy", "sympy"))

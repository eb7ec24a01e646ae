"""The problem collection: one file a problem, each with a function ``problem(*, ...)`` that returns its definition.

The package is also what ``daebench.problems()`` calls: a table of all that is in it.
"""

import sys
import types
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import pandas as pd


class _Collection(types.ModuleType):
    """The package made callable, because the same name stands for the collection and for the table of it."""

    def __call__(self) -> "pd.DataFrame":
        """Return all problems, one a row: problem, summary, parameters, cases."""
        from importlib import import_module

        table = import_module("daebench.api").problems()
        return table  # type: ignore[no-any-return]


sys.modules[__name__].__class__ = _Collection

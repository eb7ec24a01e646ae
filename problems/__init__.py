"""The problem collection: one file a problem, each with a function ``problem(*, ...)`` that returns its definition."""

import sys
import types
import warnings
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import pandas as pd


class _OldCall(types.ModuleType):
    """The package with its old call, which goes with the next release."""

    def __call__(self) -> "pd.DataFrame":
        warnings.warn("daebench.problems() is now daebench.list_problems(); the old call goes with the next release.", FutureWarning, 2)
        table: pd.DataFrame = sys.modules["daebench"].list_problems()
        return table


sys.modules[__name__].__class__ = _OldCall

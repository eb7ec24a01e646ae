"""Elimination, handed to numba once for all generated modules that call it: it takes longer to compile than most of what calls it."""

import inspect

from daebench import elimination
from daebench.cache import generated

HEADER = '''"""Gaussian elimination."""

from typing import Any

import numpy as np
from daebench.machine_code import njit
'''


def source(cached: bool) -> str:
    """Return the source of a module of all functions of :mod:`daebench.elimination`, handed to numba."""
    keep = ", cache=True" * cached
    return "\n\n".join([HEADER, *(f"@njit(error_model='numpy'{keep})\n{inspect.getsource(each)}" for each in elimination.FUNCTIONS)])


_MODULE = generated("elimination", "elimination", source)
eliminate, finite = _MODULE.eliminate, _MODULE.finite

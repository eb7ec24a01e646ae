"""Elimination, handed to numba once for all generated modules that call it: it takes longer to compile than most of what calls it."""

import inspect

from daebench.compiler.cache import generated
from daebench.compiler.linear import elimination

HEADER = '''"""Gaussian elimination."""

from typing import Any

import numpy as np
from daebench.compiler.machine_code import njit
'''


def source(cached: bool) -> str:
    """Return the source of a module of all functions of :mod:`daebench.compiler.linear.elimination`, handed to numba."""
    keep = ", cache=True" * cached
    return "\n\n".join([HEADER, *(f"@njit(error_model='numpy'{keep})\n{inspect.getsource(each)}" for each in elimination.FUNCTIONS)])


_MODULE = generated("elimination", "elimination", source)
eliminate, finite = _MODULE.eliminate, _MODULE.finite

"""daebench: what a treatment of constraints costs, and what it breaks.

A constrained Hamiltonian problem is written once. It is posed as an index-3, -2, -1 and stabilised DAE, and integrated by
structure-preserving schemes. Energy drift, manifold drift, order, symplecticity and cost are measured side by side. Notation and equation
numbers are those of Hairer, Lubich and Wanner, *Geometric Numerical Integration*, chapter VII (HLW).
"""

from typing import Any

import lazy_loader

_lazy, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)


def __getattr__(name: str) -> Any:
    """Import a public name on first access: the import of NumPy alone would take longer than ``daebench list`` should."""
    if name == "__version__":
        from importlib.metadata import version

        return version("daebench")
    return _lazy(name)

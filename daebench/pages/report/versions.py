"""Versions of Python and of the packages that the numbers of a page come from."""

import platform
from importlib.metadata import version
from importlib.util import find_spec

PACKAGES = ("daebench", "numpy", "scipy", "sympy", "mpmath", "llvmlite", "pandas", "matplotlib", "scikit-sundae")
PEERS = ("heyoka", "solve_dae")
"""Packages that methods come from where they are installed."""


def versions() -> dict[str, str]:
    """Return the versions of Python and of the packages that the numbers come from."""
    releases = {"Python": platform.python_version()} | {name: version(name) for name in PACKAGES}
    return releases | {name: version(name) for name in PEERS if find_spec(name)}

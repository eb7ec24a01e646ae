"""Solvers whose packages are extras, which need not be installed."""

from importlib.util import find_spec

PACKAGES = ("heyoka", "solve_dae")
"""Packages of solvers; a method's name begins with that of its package."""


def not_installed(name: str) -> str | None:
    """Return that the package of a method is not installed, and how to install it, as a sentence; None if nothing is missing."""
    package = name.partition(":")[0]
    try:
        if package not in PACKAGES or find_spec(package) is not None:
            return None
    except ValueError:  # it was looked for before, and found missing
        pass
    return f"{name} needs {package}, which is not installed; install it by pip install 'daebench[peers]'."

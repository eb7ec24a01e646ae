"""Solvers whose packages are extras, which need not be installed."""

from importlib.util import find_spec

from daebench.runs.provenance import EXTRAS


def not_installed(name: str) -> str | None:
    """Return that the package of a method is not installed, and how to install it, as a sentence; None if nothing is missing."""
    package = name.partition(":")[0]
    try:
        if package not in EXTRAS or find_spec(package) is not None:
            return None
    except ValueError:  # it was looked for before, and found missing
        pass
    return f"{name} needs {package}, which is not installed; install it by pip install 'daebench[peers]'."

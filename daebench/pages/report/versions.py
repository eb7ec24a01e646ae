"""Versions of Python and of the packages that the numbers and pictures of a page come from."""

from importlib.metadata import version

from daebench.runs import provenance


def versions() -> dict[str, str]:
    """Return the versions of Python and of the packages that the numbers and pictures come from."""
    return provenance.versions() | {"matplotlib": version("matplotlib")}

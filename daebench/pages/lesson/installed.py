"""Whether what lessons need is installed."""

from importlib.util import find_spec

from daebench.errors import BadInput

NEEDED = ("marimo", "latex2mathml")


def require_marimo() -> None:
    """Go on if what lessons need is installed.

    Raises
    ------
    BadInput
        If it is not, with how to install it.
    """
    if absent := missing():
        raise BadInput(f"lessons need {' and '.join(absent)}, which is not installed; call pip install 'daebench[lessons]'.")


def missing() -> list[str]:
    """Return the packages that lessons need and that are not installed."""
    return [name for name in NEEDED if find_spec(name) is None]

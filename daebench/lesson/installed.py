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
    if missing := [name for name in NEEDED if find_spec(name) is None]:
        raise BadInput(f"lessons need {' and '.join(missing)}, which is not installed; call pip install 'daebench[lessons]'.")

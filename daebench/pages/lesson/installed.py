"""The package that lessons need beside daebench itself: it writes formulas."""

from importlib.util import find_spec

from daebench.errors import BadInput

NEEDED = ("latex2mathml",)


def require_installed() -> None:
    """Refuse to write a lesson where a package is missing that it needs."""
    if absent := missing():
        raise BadInput(
            f"lessons need {' and '.join(absent)}, which is not installed; call pip install 'daebench[lessons]'.", "lesson-packages-missing"
        )


def missing() -> list[str]:
    """Return the packages that lessons need and that are not installed."""
    return [name for name in NEEDED if find_spec(name) is None]

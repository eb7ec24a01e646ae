"""Requirements of lessons: the name of one, and the packages that they need."""

from importlib.util import find_spec

from daebench.errors import BadInput, unknown
from daebench.methods.catalogue import lessons

NEEDED = ("marimo", "latex2mathml")


def require_lesson(name: str) -> None:
    """Refuse a lesson that there is not, or that needs what is not installed."""
    if name not in lessons():
        raise unknown("lesson", name, lessons())
    if absent := missing():
        raise BadInput(f"lessons need {' and '.join(absent)}, which is not installed; call pip install 'daebench[lessons]'.")


def missing() -> list[str]:
    """Return the packages that lessons need and that are not installed."""
    return [name for name in NEEDED if find_spec(name) is None]

"""Points and rods in one line of text, such as "A 0 0, B 1 0" and "A B, B C", which is shorter than mappings."""

from daebench.errors import InvalidProblem
from daebench.joints.bodies import Rod
from daebench.systems.picture import Exact


def points(text: str) -> dict[str, tuple[str, ...]]:
    """Return points by their names, of a text such as "A 0.1 0.2, B 1/3 0": decimals are exact."""
    by_name: dict[str, tuple[str, ...]] = {}
    for name, coordinates in _entries(text):
        if len(coordinates) not in (2, 3):
            raise InvalidProblem(
                f"point {name} has {len(coordinates)} coordinates in {text!r}; give two or three, and commas between points.",
                "written-point-malformed",
            )
        if name in by_name:
            raise InvalidProblem(f"{name} is the name of two points in {text!r}; rename one.", "written-point-twice")
        by_name[name] = coordinates
    return by_name


def rods(text: str, *, mass: Exact) -> dict[str, Rod]:
    """Return rods of equal mass by names such as "A-B", of a text such as "A B, B C"."""
    by_name: dict[str, Rod] = {}
    for first, others in _entries(text):
        rod = Rod(first, *others, mass=mass)
        name = "-".join(rod.names[:2])
        if name in by_name:
            raise InvalidProblem(f"{text!r} has two rods {name}; leave one out.", "written-rod-twice")
        by_name[name] = rod
    return by_name


def _entries(text: str) -> list[tuple[str, tuple[str, ...]]]:
    """Return the words between commas, the first apart."""
    words = [entry.split() for entry in text.split(",")]
    if not all(words):
        raise InvalidProblem(f"{text!r} has a comma with nothing before or after it; leave it out.", "written-comma-alone")
    return [(first, tuple(others)) for first, *others in words]

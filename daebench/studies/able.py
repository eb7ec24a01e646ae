"""Which of some methods can be run on a problem, and why the others cannot."""

from collections.abc import Sequence

from daebench.errors import BadInput
from daebench.names import methods_of
from daebench.scene import PoissonScene, Scene


def able(scene: Scene | PoissonScene, names: Sequence[str]) -> tuple[list[str], dict[str, str]]:
    """Return those of these methods that can be run, and why the others cannot, as sentences."""
    found: list[str] = []
    refused: dict[str, str] = {}
    for name in names:
        try:
            (solver,) = methods_of(scene, [name], anyway=isinstance(scene, PoissonScene))
            why = solver.refusal(scene)
        except BadInput as error:
            why = str(error)
        if why:
            refused[name] = why
        else:
            found.append(name)
    return found, refused

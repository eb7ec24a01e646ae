"""Methods for problems of either kind, constrained Hamiltonian systems and Poisson systems, each kind with names of its own."""

from collections.abc import Callable, Mapping, Sequence
from functools import cache
from typing import Any

from daebench import names, poisson_names
from daebench.errors import BadInput
from daebench.method import Method
from daebench.scene import PoissonScene, Scene


def kind_of(scene: Scene | PoissonScene) -> str:
    """Return what a problem is, in words."""
    return "a Poisson system" if isinstance(scene, PoissonScene) else "a constrained problem"


def method_of(
    scene: Scene | PoissonScene,
    name: str,
    options: Mapping[str, float] | None = None,
    *,
    compensated: bool = False,
    anyway: bool = False,
) -> Any:
    """Return the method of this name for problems of the scene's kind.

    Raises
    ------
    BadInput
        If the name or an option is unknown, the parts of a name do not go together, or the method is for the other kind of problems.
    """
    _require_kind(scene, [name], anyway)
    if isinstance(scene, PoissonScene):
        return poisson_names.parse(name, options, compensated=compensated, anyway=anyway)
    return names.parse(name, options, compensated=compensated)


def methods_of(
    scene: Scene | PoissonScene, given: Sequence[str], options: Mapping[str, float] | None = None, *, anyway: bool = False
) -> list[Any]:
    """Return the methods of these names for problems of the scene's kind, each with those of the options that it has.

    Raises
    ------
    BadInput
        As :func:`method_of`, or if an option is one of none of them.
    """
    _require_kind(scene, given, anyway)
    if isinstance(scene, PoissonScene):
        return list(poisson_names.several(given, options, anyway=anyway))
    return list(names.several(given, options))


def free_numbers(scene: Scene | PoissonScene, method: Any) -> Mapping[str, float]:
    """Return the names of the free numbers of a method for problems of the scene's kind, and their defaults."""
    return poisson_names.free_numbers(method) if isinstance(scene, PoissonScene) else names.free_numbers(method)


def _require_kind(scene: Scene | PoissonScene, given: Sequence[str], anyway: bool) -> None:
    """Refuse methods that are known, but for the other kind of problems."""
    poisson = isinstance(scene, PoissonScene)
    if anyway and not poisson:
        raise BadInput(f"anyway is for schemes on Poisson systems, and {scene.problem} is {kind_of(scene)}; leave it out.")
    for name in given:
        here, there = _known(poisson_names.parse, name), _known(names.parse, name)
        if (there and not here) if poisson else (here and not there):
            kind = "constrained problems" if poisson else "Poisson systems"
            raise BadInput(f"{name} is for {kind}, and {scene.problem} is {kind_of(scene)}; daebench list methods has those for both.")


@cache
def _known(parse: Callable[[str], Any], name: str) -> bool:
    try:
        parse(name)
    except BadInput:
        return False
    return True


def knob_value(method: Method[Any, Any], *, h: float | None, tol: float | None) -> float:
    """Return the value of a method's knob.

    Raises
    ------
    BadInput
        If it is missing, or the other one is given.
    """
    own, other = (h, tol) if method.knob == "h" else (tol, h)
    if own is None or other is not None:
        wanted, unwanted = ("a step size h", "a tolerance") if method.knob == "h" else ("a tolerance tol", "a step size")
        raise BadInput(f"{method.name} is steered by {wanted}; {'give one' if own is None else f'leave out {unwanted}'}.")
    return own

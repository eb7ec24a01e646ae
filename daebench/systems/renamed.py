"""Public names that have changed: an old name works for one release, with a warning."""

import sys
import warnings
from collections.abc import Callable, Mapping
from functools import wraps
from typing import Any, ParamSpec, TypeVar

P = ParamSpec("P")
T = TypeVar("T")

NAMES = {
    "scene_of": "initial_value_problem",
    "setting_of": "initial_value_problem",
}
"""New names of ``daebench``, by their old ones."""


def current_name(name: str) -> str:
    """Return the present name of an object of ``daebench``, with a FutureWarning if it was renamed."""
    if name not in NAMES:
        return name
    _warn(f"daebench.{name}", f"daebench.{NAMES[name]}", level=4)
    return NAMES[name]


def renamed_here(module: str, names: Mapping[str, str]) -> Callable[[str], Any]:
    """Return the ``__getattr__`` of a module, which returns an object for its old name, with a warning."""

    def get(name: str) -> Any:
        if name not in names:
            raise AttributeError(f"module {module!r} has no attribute {name!r}")
        _warn(f"{module}.{name}", names[name])
        return getattr(sys.modules[module], names[name])

    return get


class OldAttribute:
    """The old name of an attribute or method; it warns and returns the value of the new ``name``."""

    def __init__(self, name: str) -> None:
        self.name = name

    def __set_name__(self, owner: type, old: str) -> None:
        self.old = old

    def __get__(self, instance: Any, owner: type) -> Any:
        """Return the value under the new name."""
        if instance is None:
            return self
        _warn(f"{owner.__name__}.{self.old}", self.name)
        return getattr(instance, self.name)


def old_keywords(**names: str) -> Callable[[Callable[P, T]], Callable[P, T]]:
    """Return a decorator that also accepts old names of keyword arguments, with a warning; ``names`` maps old names to new ones."""

    def decorate(function: Callable[P, T]) -> Callable[P, T]:
        @wraps(function)
        def call(*args: P.args, **kwargs: P.kwargs) -> T:
            for old in names.keys() & kwargs.keys():
                _warn(f"argument {old} of {function.__name__}", names[old])
                kwargs[names[old]] = kwargs.pop(old)
            return function(*args, **kwargs)

        return call

    return decorate


def _warn(old: str, new: str, level: int = 3) -> None:
    warnings.warn(f"{old} is now called {new}; the old name will be removed.", FutureWarning, stacklevel=level)

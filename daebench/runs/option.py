"""The form in which a command takes an argument of a study, if name and type of the argument do not determine it."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True, init=False)
class Option:
    """An option of a command, in the annotation of an argument: its names, and the function that reads its text."""

    names: tuple[str, ...]
    """Names such as "--tol"; by default that of the argument."""
    read: Callable[[str], Any] | None
    """``read(text)`` returns the value of the argument, or raises BadInput."""
    several: bool
    """Whether the option names several values, separated by commas: the study is then made once for each."""

    command: bool
    """Whether the command has it; other arguments are for Python alone."""

    def __init__(self, *names: str, read: Callable[[str], Any] | None = None, several: bool = False, command: bool = True) -> None:
        for name, value in (("names", names), ("read", read), ("several", several), ("command", command)):
            object.__setattr__(self, name, value)

"""The form in which a command takes an argument of a study, if name and type of the argument do not determine it."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True, init=False)
class Option:
    """An option of a command, in the annotation of an argument: its names, and the function that reads its text."""

    names: tuple[str, ...]
    """Names such as "--tol", by default that of the argument; of an argument that is given by its place, how the help writes it."""
    read: Callable[[Any], Any] | None
    """``read(text)`` returns the value of the argument, or raises BadInput; it gets a list of texts if the option is repeatable."""
    several: bool
    """Whether the option names several values, separated by commas: the study is then made once for each."""
    repeatable: bool
    """Whether the option is given once for each of its values."""

    command: bool
    """Whether the command has it; other arguments are for Python alone."""

    def __init__(
        self,
        *names: str,
        read: Callable[[Any], Any] | None = None,
        several: bool = False,
        repeatable: bool = False,
        command: bool = True,
    ) -> None:
        given = {"names": names, "read": read, "several": several, "repeatable": repeatable, "command": command}
        for name, value in given.items():
            object.__setattr__(self, name, value)

"""A control: a named choice among values, declared once for the live lesson and for the static page."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from daebench.errors import BadInput

Values = Mapping[str, Any]
"""Values of controls by name."""

NO_YES = (False, True)
"""The values of a switch."""


def plain(value: Any) -> str:
    """Return a value as it is written beside its control."""
    return ("no", "yes")[value] if isinstance(value, bool) else f"{value:g}" if isinstance(value, int | float) else str(value)


@dataclass(frozen=True)
class Control:
    """A choice among values: a slider of numbers, a switch of ``NO_YES``, or a list of names.

    Parameters
    ----------
    name : str
        Its name in the lesson.
    label : str
        Its label, with the unit, as plain text.
    values : sequence
        Its possible values, in order.
    default : Any
        Its initial value.
    offered : sequence
        Values that the static page offers; with none, it keeps the default there.
    text : callable
        Writes a value.

    Raises
    ------
    BadInput
        If the default, or a value that the page offers, is not among the values, or the page leaves out the default.
    """

    name: str
    label: str
    values: Sequence[Any]
    default: Any
    offered: Sequence[Any] = ()
    text: Callable[[Any], str] = plain

    def __post_init__(self) -> None:
        if strangers := [value for value in (self.default, *self.offered) if value not in self.values]:
            raise BadInput(f"control {self.name}: {strangers[0]!r} is not among its values; choose one of {list(self.values)}.")
        if self.offered and self.default not in self.offered:
            raise BadInput(f"control {self.name}: its static page leaves out the default {self.default!r}; add it.")

    @property
    def is_switch(self) -> bool:
        """Whether it is on or off."""
        return tuple(self.values) == NO_YES

    @property
    def is_slider(self) -> bool:
        """Whether its values are numbers."""
        return not self.is_switch and all(isinstance(value, int | float) for value in self.values)


def defaults(controls: Sequence[Control]) -> dict[str, Any]:
    """Return the values that controls have at first, by name."""
    return {control.name: control.default for control in controls}

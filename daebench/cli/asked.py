"""What several commands ask of methods in the same words."""

from typing import TYPE_CHECKING, Any

from daebench.cli.console import numbers, words
from daebench.errors import positive

if TYPE_CHECKING:
    from daebench.studies.stability.extreme import Asked


def asked_of(problem: str, case: str | None, *, methods: str | None, h: str | None, t_end: float | None, **more: Any) -> "Asked":
    """Return what is asked by comma-separated names of methods and step sizes; refuse steps and ends that are not positive."""
    from daebench.studies.stability.extreme import Asked

    return Asked(
        problem=problem,
        case=case,
        methods=words(methods) if methods else (),
        t_end=None if t_end is None else positive("--t-end", t_end),
        h=[positive("--h", value) for value in numbers("--h", h) or ()],
        **more,
    )

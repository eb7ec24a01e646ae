"""The certified reference of a case, read and checked once a process: a study asks for it several times a run."""

from collections.abc import Callable
from functools import lru_cache

from daebench.reference.certified import store
from daebench.reference.certified.record import Reference


def reference_of(problem: str, case: str) -> Reference:
    """Return the certified reference of a problem's case.

    Raises
    ------
    BadInput, Damaged
        As :func:`daebench.reference.certified.store.find`.
    """
    return _found(store.find, problem, case)


@lru_cache(maxsize=32)
def _found(find: Callable[[str, str], Reference], problem: str, case: str) -> Reference:
    return find(problem, case)

"""A problem file that gives another system each time it is read is refused: two methods in one table would run on two systems."""

import contextlib
import hashlib
import io
import re
from collections.abc import Callable, Iterable, Mapping
from typing import TYPE_CHECKING

from daebench.compiler.cache import generated
from daebench.errors import InvalidProblem
from daebench.systems.files.read import Problem

if TYPE_CHECKING:
    from daebench.systems.files.read import Definition

DUMMY = re.compile(r"dummy_index=\d+")
"""Number of a symbol that SymPy makes unlike all others: it differs between two readings of the same text."""


def require_same(
    problem: Problem, structure: Mapping[str, int], definition: "Definition", again: "Callable[[], Iterable[Definition]]"
) -> None:
    """Accept a definition that is the same whenever its file is read: at first several times, then once in each process.

    Parameters
    ----------
    problem : Problem
        The file.
    structure : mapping of str to int
        Values of its structural parameters.
    definition : Definition
        What it has given.
    again : callable
        Gives it once more, in each of the ways in which it may come to be asked for.

    Raises
    ------
    InvalidProblem
        If it is another one than before.
    """
    digest = digest_of(definition)

    def build(cached: bool) -> str:
        with contextlib.redirect_stderr(io.StringIO()):  # it has told everything once
            for other in again():
                _require_equal(problem, digest, digest_of(other))
        return f'"""Definition of {problem.path.stem}."""\n\nDIGEST = {digest!r}'

    key = f"definition {problem.digest} {sorted(structure.items())}"
    _require_equal(problem, digest, generated(f"{problem.path.stem}_definition", key, build).DIGEST)


def digest_of(definition: "Definition") -> str:
    """Return the content hash of the mathematics of a definition and of the values of its parameters."""
    text = f"{definition.fingerprint} {[float(value) for value in definition.parameters.values()]}"
    numbers: dict[str, str] = {}
    return hashlib.sha256(DUMMY.sub(lambda match: numbers.setdefault(match[0], f"dummy{len(numbers)}"), text).encode()).hexdigest()


def _require_equal(problem: Problem, one: str, other: str) -> None:
    if one != other:
        raise InvalidProblem(
            f"{problem.name} gives another system each time it is read, so that two methods would not run on the same one; let problem() "
            "depend on its arguments alone, and on no clock, environment, other file, or random number without a seed."
        )

"""Refusal of a problem file that defines another system each time it is read: two methods in one table would run on two systems."""

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
"""Number that SymPy gives to a symbol to make it unique; it differs between two readings of the same text."""


def require_same(
    problem: Problem, structure: Mapping[str, int], definition: "Definition", again: "Callable[[], Iterable[Definition]]"
) -> None:
    """Check that a definition is the same whenever its file is read: several times at first, then once in each process."""
    digest = digest_of(definition)

    def build() -> str:
        with contextlib.redirect_stderr(io.StringIO()):  # its messages have been shown once
            for other in again():
                _require_equal(problem, digest, digest_of(other))
        return f'"""Definition of {problem.path.stem}."""\n\nDIGEST = {digest!r}'

    key = f"definition {problem.digest} {sorted(structure.items())}"
    _require_equal(problem, digest, generated(f"{problem.path.stem}_definition", key, build).DIGEST)


def digest_of(definition: "Definition") -> str:
    """Return the content hash of the mathematics of a definition and of the values of its parameters."""
    numbers: dict[str, str] = {}
    text = DUMMY.sub(lambda match: numbers.setdefault(match[0], f"dummy{len(numbers)}"), definition.mathematics)
    return hashlib.sha256(text.encode()).hexdigest()


def _require_equal(problem: Problem, one: str, other: str) -> None:
    if one != other:
        raise InvalidProblem(
            f"{problem.name} defines another system each time it is read, so two methods would not run on the same one; let problem() "
            "depend only on its arguments, not on a clock, the environment, another file, or a random number without a seed."
        )

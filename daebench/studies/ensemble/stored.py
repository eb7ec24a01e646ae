"""Ensembles in pieces: each is a row of a store, is made by any executor, and is not made again."""

from collections.abc import Iterator, Mapping
from concurrent.futures import Executor
from typing import Any

import numpy as np

from daebench.errors import BadInput
from daebench.methods.ensemble.result import EnsembleRun
from daebench.records.store import Store
from daebench.runs.members import Members
from daebench.runs.request import Progress, Request
from daebench.studies.grid.member_runs import MemberRuns, joined, packed
from daebench.studies.grid.runs import computed
from daebench.studies.grid.specification_key import key_of

PIECE = 256
"""Members of a piece at most: whole vectors, and little lost with what computes it."""

NUMBERS = 2**20
"""Numbers of states of a piece, about."""

MOST_NUMBERS = 2**26
"""Numbers of states of one member that a row of a store can have."""


def kept_run(
    store: Store, executor: Executor | None, settings: Mapping[str, Any], some: Members, asked: Request, method: Any
) -> EnsembleRun:
    """Return the runs of all members, each to the bit as :func:`daebench.methods.ensemble.run.run_members` has it."""
    pieces = list(_pieces(settings, some, asked))
    tell = _telling(asked.progress, len(pieces))
    rows = computed(pieces, store, executor=executor, tell=tell)
    return joined(method.name, some, [rows[key_of(piece)] for piece in pieces])


def _telling(progress: Progress | None, pieces: int) -> Any:
    return (lambda done, of, _: progress(done / of)) if progress else None


def _pieces(settings: Mapping[str, Any], some: Members, asked: Request) -> Iterator[MemberRuns]:
    """Give the members piece by piece."""
    n = len(some)
    assert asked.steps is not None
    stored = asked.steps // asked.every if asked.every else 1
    of_one = some.ivp.size * (stored + 1)
    if of_one > MOST_NUMBERS:
        raise BadInput(f"{of_one} numbers of states of each member are more than a row of a store can have; take fewer --points.")
    h = np.broadcast_to(some.h, (n,))
    numbers = np.concatenate([*(vectors.T for vectors in some.start), h[None], *(values[None] for values in some.parameters.values())])
    watch = asked.watched(some.ivp.state)
    size = max(1, min(PIECE, NUMBERS // of_one))
    for first in range(0, n, size):
        part = slice(first, min(n, first + size))
        value = float(np.max(h[part]))
        yield MemberRuns(
            **settings,
            value=value,
            t_end=asked.steps * value,
            metrics=(),
            first=first,
            members=part.stop - first,
            differing=tuple(some.parameters),
            numbers=packed(numbers[:, part]),
            every=asked.every or 0,
            steps=asked.steps,
            watch=tuple(watch),
            work=asked.count,
        )


def settings_of(problem: Any, case: str, method: str, given: Mapping[str, Any]) -> dict[str, Any]:
    """Return the fields that name problem and method, of settings of :func:`daebench.run`."""
    if not isinstance(problem, str):
        raise BadInput("a stored ensemble needs a problem of the catalogue or in a file; give its name or path.")
    pairs = {name: tuple((given.get(name) or {}).items()) for name in ("parameters", "options")}
    plain = {name: given[name] for name in ("compensated", "anyway") if name in given}
    known = {*pairs, *plain, "on_singular", "watch", "count", "case"}
    if others := sorted(name for name in given if name not in known and given[name] is not None):
        raise BadInput(f"{', '.join(others)} cannot be given for a stored ensemble.")
    return {"problem": problem, "case": case, "method": method, "on_singular": given.get("on_singular") or "", **pairs, **plain}

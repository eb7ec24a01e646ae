"""Runs from several starts, as one piece of a study: members of an ensemble, made together and kept as one row of a store."""

import base64
import io
import os
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any, Self

import numpy as np

from daebench.errors import BadInput
from daebench.methods.ensemble.result import EnsembleRun
from daebench.methods.ensemble.run import run_members
from daebench.runs.machine import cores
from daebench.runs.members import Members, members
from daebench.runs.request import Request
from daebench.runs.trajectory import Array
from daebench.runs.zipped import UNREADABLE, arrays_in
from daebench.studies.grid.run_specification import GridRun, Row

PER_MEMBER = ("ends", "steps", "status", "pivots")
"""Arrays of :class:`daebench.methods.ensemble.result.EnsembleRun` that have a row for each member."""


@dataclass(frozen=True, kw_only=True)
class MemberRuns(GridRun):
    """Runs of one method from several starts, each with a step size and parameters of its own if they differ.

    ``value`` is the largest step size, and ``parameters`` are those that all have in common.

    Parameters
    ----------
    first, members : int
        Number of the first member in its ensemble, and how many members these are.
    differing : tuple of str
        Names of the parameters that differ from member to member.
    numbers : str
        Start, step size and these parameters of each member: the float64 of an array of shape(c + 1 + k, n), in base64.
    every : int
        Steps between states that are stored; 0 for the end alone.
    steps : int
        Steps of each member.
    watch : tuple of str
        What is monitored.
    work : bool
        Whether work is counted.
    """

    first: int
    members: int
    differing: tuple[str, ...]
    numbers: str
    every: int
    steps: int
    watch: tuple[str, ...]
    work: bool

    @property
    def count(self) -> int:
        """How many runs these are."""
        return self.members

    def of_any_kind(self) -> Self:
        """Return the runs without what compiles nothing anew."""
        return replace(super().of_any_kind(), first=0, members=1, differing=(), numbers="", every=0, steps=0, watch=())

    def rows(self, row: Mapping[str, Any]) -> Iterator[Row]:
        """Give the row of each member, of what was computed for all of them; states are left out."""
        arrays = unpacked(row["arrays"])
        failures = dict(zip(row["failed"], row["failure"], strict=True))
        common = {name: row[name] for name in ("problem", "case", "method", "value", "t_end")}
        maxima = {name.replace("maxima ", "max_"): values for name, values in arrays.items() if name.startswith("maxima ")}
        for i in range(self.members):
            of_member = {name: float(values[i]) for name, values in maxima.items()}
            yield {**common, "member": self.first + i, "steps": int(arrays["steps"][i]), "failure": failures.get(i, ""), **of_member}


def members_of(specification: MemberRuns) -> Members:
    """Return the members."""
    ivp, n, differing = specification.ivp, specification.members, specification.differing
    raw = base64.b64decode(specification.numbers)
    if len(raw) != 8 * n * (ivp.size + 1 + len(differing)):
        raise BadInput(
            f"members of {specification.problem} in this row lack numbers that they need; remove the store.",
            "stored-members-incomplete",
        )
    rows = np.frombuffer(raw, dtype="<f8").astype(float).reshape(-1, n)
    start, h = tuple(ivp.vectors(rows[: ivp.size].T)), rows[ivp.size]
    numbers = dict(zip(differing, rows[ivp.size + 1 :], strict=True))
    return members(ivp, start, float(h[0]) if np.all(h == h[0]) else h, numbers)


def packed(array: Array) -> str:
    """Return the float64 of an array as text."""
    return base64.b64encode(np.ascontiguousarray(array, dtype="<f8").tobytes()).decode()


def member_row(specification: MemberRuns) -> Row:
    """Return the outcome of members: their arrays as a compressed archive of NumPy in text, and why some stopped."""
    asked = Request(
        value=specification.value,
        steps=specification.steps,
        every=specification.every,
        watch=specification.watch,
        count=specification.work,
        on_singular=specification.on_singular or None,
    )
    run = run_members(specification.solver, members_of(specification), asked, threads=_threads())
    arrays = {"states": run.states, "index": run.index} | {name: getattr(run, name) for name in PER_MEMBER}
    arrays |= {f"maxima {name}": values for name, values in run.maxima.items()}
    arrays |= {f"work {name}": values for name, values in run.work.items()}
    content = io.BytesIO()
    named: dict[str, Any] = arrays
    np.savez_compressed(content, **named)
    return {
        **{name: getattr(specification, name) for name in ("problem", "case", "method", "value", "t_end")},
        "arrays": base64.b64encode(content.getvalue()).decode(),
        "failed": run.failed.tolist(),
        "failure": [run.failure(int(i)) for i in run.failed],
        "seconds": run.seconds,
        "compile_seconds": run.compile_seconds,
        "lanes": run.lanes,
    }


def _threads() -> int:
    """Return how many threads members may take: one where processes are side by side, which their environment says."""
    alone = os.environ.get("OMP_NUM_THREADS") != "1"
    return cores() if alone else 1


def unpacked(text: str) -> dict[str, Array]:
    """Return the arrays of a row by name; raise BadInput if they cannot be read."""
    try:
        arrays = arrays_in(io.BytesIO(base64.b64decode(text)), "a row of members")
        _require_members(arrays)
    except UNREADABLE as error:
        raise BadInput(
            f"the arrays of members in this store cannot be read: {error}; name another store, or remove it.", "stored-members-unreadable"
        ) from error
    return arrays


def _require_members(arrays: Mapping[str, Array]) -> None:
    """Refuse arrays that are not those of members: an entry for each, and a state for each at each output."""
    states, index, n = arrays["states"], arrays["index"], len(arrays["steps"])
    of_each = [values for name, values in arrays.items() if name in PER_MEMBER or name.startswith(("maxima ", "work "))]
    lengths = all(values.ndim >= 1 and len(values) == n for values in of_each) and {*PER_MEMBER} <= {*arrays}
    if (
        not lengths
        or states.ndim != 3
        or states.shape[:2] != (len(index), n)
        or any(values.dtype.kind == "U" for values in arrays.values())
    ):
        raise ValueError("they are not of the same members")


def joined(method: str, some: Members, rows: list[Row]) -> EnsembleRun:
    """Return the runs of all members of an ensemble, given the rows of its pieces in their order."""
    parts = [unpacked(row["arrays"]) for row in rows]

    def whole(name: str, axis: int = 0) -> Any:
        return np.concatenate([part[name] for part in parts], axis=axis)

    failures: dict[int, str] = {}
    first = 0
    for row, part in zip(rows, parts, strict=True):
        failures |= {first + i: why for i, why in zip(row["failed"], row["failure"], strict=True)}
        first += len(part["steps"])
    named = {kind: [name for name in parts[0] if name.startswith(f"{kind} ")] for kind in ("maxima", "work")}
    of_each: dict[str, Any] = {name: whole(name) for name in PER_MEMBER}
    return EnsembleRun(
        members=some,
        method=method,
        index=parts[0]["index"].astype(np.int64),
        states=whole("states", axis=1),
        **of_each,
        maxima={name.partition(" ")[2]: whole(name) for name in named["maxima"]},
        work={name.partition(" ")[2]: whole(name) for name in named["work"]},
        seconds=sum(row["seconds"] for row in rows),
        compile_seconds=max(row["compile_seconds"] for row in rows),
        lanes=max(row["lanes"] for row in rows),
        sentence=failures.__getitem__,
    )

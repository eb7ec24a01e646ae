"""Values of a reference at any time: stored digits if there are any, otherwise integrated from the nearest ones; and their export."""

import json
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from daebench.errors import BadInput, unknown
from daebench.reference.keep.record import Reference
from daebench.reference.solution import EPS, SAFETY, ReferenceSolution, integrated
from daebench.runs.csv_files import write_rows
from daebench.runs.files import atomic
from daebench.runs.ivp import Array, Ivp
from daebench.systems.lazily import mpmath as mp
from daebench.systems.lazily import pandas as pd

EXACT_DIGITS = 50
"""Digits of a closed form. At the double nearest to a rank loss, multipliers still have 17 of them."""

TINY = 1e-40
"""Error of a number that is zero, as a fraction of the motion."""

BESIDE = 1e-7
"""Relative distance of the neighbour with which the growth of a rounded start is measured."""


@dataclass(frozen=True)
class At:
    """States of a reference at given times."""

    t: Array
    """Times, s; shape (n,)."""
    states: dict[str, Array]
    """Every part of the reference: positions, momenta and multipliers lam(p, q), or y; shape (n, components)."""
    bound: dict[str, Array]
    """Largest error of each number, in the same shapes; it includes the rounding of stored digits to double precision."""
    row: NDArray[np.intp]
    """Row of the reference if the time is stored, otherwise -1; shape (n,)."""

    @property
    def stored(self) -> NDArray[np.bool_]:
        """Whether each time is a stored one, shape(n,)."""
        return self.row >= 0


def states_at(reference: Reference, times: ArrayLike) -> At:
    """Return the states at these times, in the order given.

    Between stored times the index-reduced equation, HLW (1.18), or y' = B(y) grad H(y), is integrated forwards or backwards from the
    nearest stored state by DOP853. The bound is that of :func:`daebench.reference.solution.integrated` plus ten times the growth of the
    rounding of that state on the way, measured with a neighbour. That equation cannot pass a rank loss; a motion that does is computed
    from its closed form with 50 digits, and the bound is that of rounding it to double precision.

    Shapes: times (n,).
    """
    t = np.asarray(times, dtype=float).reshape(-1)
    _require_inside(reference, t)
    nearest = _nearest(reference.t, t)
    row = np.where(reference.t[nearest] == t, nearest, -1)
    parts = {part: values[nearest] for part, values in reference.values.items()}
    bound = {part: reference.bound[part][nearest] + EPS * np.abs(parts[part]) for part in parts}
    if np.any(row < 0):
        ivp = reference.ivp()
        for places, states, errors in _exact(reference, t, row) if reference.rank_losses else _integrated(ivp, reference, nearest, t, row):
            for part in parts:
                parts[part][places] = states[part]
                bound[part][places] = errors[part]
    return At(t, parts, bound, row)


Found = tuple[NDArray[np.intp], Mapping[str, Array], Mapping[str, Any]]
"""Indices of times, states at these times, and bounds."""


def _integrated(ivp: Ivp, reference: Reference, nearest: NDArray[np.intp], t: Array, row: NDArray[np.intp]) -> Iterator[Found]:
    """Yield the states between stored times, integrated from the nearest."""
    for places in _ways(reference.t, nearest, t, row):
        solution, growth = _travelled(ivp, reference, int(nearest[places[0]]), t[places])
        yield places, solution.states, {part: solution.bound[part] + growth[part] for part in growth}


def _exact(reference: Reference, t: Array, row: NDArray[np.intp]) -> Iterator[Found]:
    """Yield the states between stored times from the closed form."""
    from daebench.reference.keep.definition import define
    from daebench.reference.make.mathematics import mathematics

    places = np.flatnonzero(row < 0)
    with mp.workdps(EXACT_DIGITS):
        system = mathematics(define(reference.problem, reference.case))
        rows = [system.parts(x) for x in system.exact([mp.mpf(0), *(mp.mpf(float(x)) for x in t[places])])[1:]]
        states = {part: np.array([[float(x) for x in state[part]] for state in rows]) for part in rows[0]}
    yield places, states, {part: 2 * EPS * np.abs(values) + TINY * reference.size(part) for part, values in states.items()}


def _require_inside(reference: Reference, t: Array) -> None:
    outside = t[~((t >= 0) & (t <= reference.horizon))]
    if outside.size:
        reach = f"which reaches from 0 to its horizon at {reference.horizon:g}"
        raise BadInput(f"t = {float(outside[0])!r} is outside {reference.name}, {reach}.", "time-outside-reference")


def _nearest(stored: Array, t: Array) -> NDArray[np.intp]:
    """Return the index of the nearest stored time; of two equally near ones, the earlier."""
    after = np.minimum(np.searchsorted(stored, t), len(stored) - 1)
    before = np.maximum(after - 1, 0)
    return np.where(t - stored[before] <= stored[after] - t, before, after)


def _ways(stored: Array, nearest: NDArray[np.intp], t: Array, row: NDArray[np.intp]) -> Iterator[NDArray[np.intp]]:
    """Yield the indices of times on one side of one stored time, ordered by their distance from it."""
    between = np.flatnonzero(row < 0)
    distance = t[between] - stored[nearest[between]]
    side = 2 * nearest[between] + (distance > 0)
    order = np.lexsort((np.abs(distance), side))
    yield from np.split(between[order], np.flatnonzero(np.diff(side[order])) + 1)


def _travelled(ivp: Ivp, reference: Reference, k: int, t: Array) -> tuple[ReferenceSolution, dict[str, float]]:
    """Return the motion from stored state k to times on one side of it, and ten times the growth of its rounding."""
    start = reference.restarted(ivp, k)
    distances, places = np.unique(np.abs(t - reference.t[k]), return_inverse=True)
    signed = distances if t[0] > reference.t[k] else -distances
    solution = integrated(start, signed)
    growth = _growth(start, reference.state.columns, solution, signed[-1:])
    return replace(solution, states={part: rows[places] for part, rows in solution.states.items()}), growth


def _growth(start: Ivp, state: Sequence[str], solution: ReferenceSolution, furthest: Array) -> dict[str, float]:
    """Return ten times the growth of the rounding of a state on the way to a time, measured with neighbours in each of its parts."""
    growth = dict.fromkeys(solution.states, 0.0)
    for name in state:
        value = getattr(start, f"{name}0")
        moved = BESIDE * np.abs(value).max()
        changes: dict[str, Any] = {f"{name}0": value + moved}
        beside = integrated(replace(start, **changes), furthest)
        for part in growth:
            apart = float(np.abs(beside.states[part][-1] - solution.states[part][-1]).max())
            growth[part] += SAFETY * EPS / BESIDE * max(apart, moved if part == name else 0.0)
    return growth


def text_of(reference: Reference, at: At) -> dict[str, list[str]]:
    """Return columns t, q1, ..., p1, ..., lam1, ..., or y1, ..., as decimal strings: stored digits if there are any, otherwise 17."""
    columns = {"t": [repr(float(t)) for t in at.t]}
    for name, values in _columns(at.states).items():
        stored = reference.text[name]
        columns[name] = [stored[k] if k >= 0 else f"{value:.17g}" for k, value in zip(at.row, values, strict=True)]
    return columns


def _columns(parts: Mapping[str, Array], prefix: str = "") -> dict[str, Array]:
    """Return the components of the parts of a state by their names."""
    return {f"{prefix}{part}{i + 1}": column for part, rows in parts.items() for i, column in enumerate(rows.T)}


def write(path: Path, kind: str, reference: Reference, times: Sequence[float] | None = None) -> None:
    """Write a reference to a file at these times, by default at all stored times."""
    if kind not in WRITERS:
        raise unknown("format", kind, WRITERS)
    at = states_at(reference, reference.t if times is None else times)
    with atomic(path) as scratch:
        WRITERS[kind](scratch, reference, at)


def _csv(path: Path, reference: Reference, at: At) -> None:
    bounds = {name: [f"{x:.3g}" for x in values] for name, values in _columns(at.bound, "bound_").items()}
    columns = text_of(reference, at) | bounds
    write_rows(path, columns, zip(*columns.values(), strict=True))


def _json(path: Path, reference: Reference, at: At) -> None:
    about = {name: reference.certificate[name] for name in ("name", "problem", "case", "definition", "horizon", "checksum")}
    bounds = {part: rows.tolist() for part, rows in at.bound.items()}
    whole = about | {"columns": text_of(reference, at), "stored": at.stored.tolist(), "bound": bounds}
    path.write_text(json.dumps(whole), encoding="ascii")


def _npz(path: Path, _: Reference, at: At) -> None:
    arrays = {"t": at.t} | at.states | {f"bound_{part}": rows for part, rows in at.bound.items()}
    with path.open("wb") as file:
        np.savez_compressed(file, **arrays)  # type: ignore[arg-type]


def _parquet(path: Path, _: Reference, at: At) -> None:

    columns = {"t": at.t} | _columns(at.states) | _columns(at.bound, "bound_")
    try:
        pd.DataFrame(columns).to_parquet(path, engine="pyarrow", index=False)
    except ImportError as error:
        raise BadInput(
            "writing Parquet needs pyarrow, which is not installed; install it by pip install 'daebench[scale]'.",
            "pyarrow-missing-for-parquet",
        ) from error


WRITERS: dict[str, Callable[[Path, Reference, At], None]] = {"csv": _csv, "json": _json, "npz": _npz, "parquet": _parquet}
"""Formats, with the function that writes each."""

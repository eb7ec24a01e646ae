"""Digits in which a user's trajectory agrees with a certified reference, and the time and component of its first departure."""

import decimal
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from daebench.errors import BadInput, positive, whole
from daebench.reference.keep import store
from daebench.reference.keep.dense_evaluation import states_at
from daebench.reference.keep.record import EPS, Reference
from daebench.reference.keep.trajectory_file import TrajectoryFile, read, split
from daebench.runs.ivp import Array

Rows = NDArray[np.intp]

WITHIN = 0.01
"""Fraction of the motion that a trajectory must differ by to count as having left the reference."""

BETWEEN = 500
"""Largest number of compared rows between stored times: each takes several short integrations."""

DIGITS = (12, 9, 6, 3)
"""Numbers of digits whose loss is reported."""

SPARE = decimal.Context(prec=60)
"""Context for differences of decimal numbers, with enough digits for every relevant number."""


@dataclass(frozen=True)
class Place:
    """Place of an event: time, s, and column."""

    t: float
    column: str


@dataclass(frozen=True)
class Column:
    """Agreement of one component."""

    name: str
    """q1, ..., p1, ..., lam1, ..., or y1, ..."""
    digits: float
    """-log10(largest error / size); limited by the reference's bound and the digits of the file."""
    error: float
    """Largest difference from the reference."""
    t: float
    """Time of the largest difference, s."""
    size: float
    """Largest modulus of its part, such as q, in the whole reference."""
    allowed: float
    """Largest number of digits that the reference's bound and the digits of the file allow."""


@dataclass(frozen=True)
class FileAgreement:
    """Result of the comparison of a file with a reference."""

    file: str
    reference: str
    """The compared file, and the reference."""
    rows: int
    compared: int
    passed_over: int
    beyond: int
    """Numbers of rows: of the file; compared; omitted between stored times; after the horizon."""
    horizon: float
    double_horizon: float
    """Last time of the reference, s, and the time beyond which no run in double precision can follow."""
    ignored: tuple[str, ...]
    """Columns of the file that are not components."""
    missing: tuple[str, ...]
    """Components of the reference that the file does not contain."""
    columns: tuple[Column, ...]
    """One for each component."""
    within: float
    """Fraction of the motion beyond which the trajectory has left."""
    left: Place | None
    """First place at which it leaves."""
    lost: Mapping[int, Place | None]
    """First places at which the file agrees to fewer than 12, 9, 6 and 3 digits."""
    t_end: float
    """Last compared time, s."""
    possible: float
    """Digits that a run in double precision can have until then, given the growth of the rounding of a state on its way."""

    @property
    def worst(self) -> Column:
        """The component with the fewest digits."""
        return min(self.columns, key=lambda column: column.digits)

    @property
    def digits(self) -> float:
        """Digits of agreement of all components."""
        return self.worst.digits


def agreement(path: Path, name: str, folder: Path | None = None, *, within: float = WITHIN, between: int = BETWEEN) -> FileAgreement:
    """Return the number of digits in which a file agrees with a reference.

    At stored times the difference is that of decimal numbers, so that a program of any precision can be compared. Between them the
    reference is integrated from the nearest stored state, and the requested number of rows is compared, evenly chosen.
    """
    within, between = positive("within", within), whole("between", between, 0)
    reference = store.load(name, folder)
    given = read(Path(path), reference.state)
    _require_components(given, reference)
    inside = _inside(given, reference)
    chosen = _chosen(given.values["t"][inside], reference.t, between)
    t, error, allowed = _errors(given, reference, inside[chosen])
    sizes = np.array([reference.size(split(column)[0]) for column in given.components])
    relative = np.maximum(error, allowed) / sizes
    names = given.components
    return FileAgreement(
        file=str(given.path),
        reference=reference.name,
        rows=len(given.lines),
        compared=len(chosen),
        passed_over=len(inside) - len(chosen),
        beyond=len(given.lines) - len(inside),
        horizon=reference.horizon,
        double_horizon=reference.double_horizon,
        ignored=given.ignored,
        missing=tuple(name for name in reference.text if name != "t" and name not in names),
        columns=tuple(_column(*entry, t) for entry in zip(names, error.T, allowed.T, sizes, strict=True)),
        within=within,
        left=_first(error / sizes > within, error / sizes, t, names),
        lost={digits: _first(relative > 10.0**-digits, relative, t, names) for digits in DIGITS},
        t_end=float(t[-1]),
        possible=float(-np.log10(EPS * np.interp(t[-1], reference.t, reference.worst_amplification))),
    )


def _require_components(given: TrajectoryFile, reference: Reference) -> None:
    missing = next((name for name in given.components if name not in reference.text), None)
    if missing is not None:
        raise BadInput(
            f"{given.path}, line 1: column {missing} is not in {reference.name}, which has {', '.join(reference.text)}; "
            "compare with the reference of the problem that was solved.",
            "column-not-in-reference",
        )


def _inside(given: TrajectoryFile, reference: Reference) -> Rows:
    """Return the rows up to the horizon."""
    inside = np.flatnonzero(given.values["t"] <= reference.horizon)
    if not inside.size:
        first = given.values["t"][0]
        raise BadInput(
            f"{given.path}: its first time, t = {first:g}, is beyond the horizon of {reference.name} at t = {reference.horizon:g}; "
            "compare an earlier part.",
            "first-time-beyond-horizon",
        )
    return inside


def _chosen(t: Array, stored: Array, most: int) -> Rows:
    """Return the rows to compare: all at stored times, and the requested number of others, evenly chosen."""
    others = np.flatnonzero(~np.isin(t, stored))
    if len(others) > most:
        others = others[np.unique(np.linspace(0, len(others) - 1, most).round().astype(int))] if most else others[:0]
    return np.sort(np.concatenate([np.flatnonzero(np.isin(t, stored)), others]))


def _errors(given: TrajectoryFile, reference: Reference, rows: Rows) -> tuple[Array, Array, Array]:
    """Return times, absolute differences, and the part of them that the reference's bound and the digits of the file leave undetermined."""
    t = given.values["t"][rows]
    states = states_at(reference, t)
    places = np.searchsorted(reference.t, t)
    error, allowed = np.empty((2, len(rows), len(given.components)))
    for j, name in enumerate(given.components):
        part, i = split(name)
        error[:, j] = np.abs(given.values[name][rows] - states.states[part][:, i])
        allowed[:, j] = states.bound[part][:, i]
        for k in np.flatnonzero(states.stored):
            error[k, j] = _difference(given.text[name][rows[k]], reference.text[name][places[k]])
            allowed[k, j] = reference.bound[part][places[k], i]
        allowed[:, j] = np.maximum(allowed[:, j], given.half_unit(name))
    return t, error, allowed


def _difference(one: str, other: str) -> float:
    return float(SPARE.abs(SPARE.subtract(decimal.Decimal(one.strip()), decimal.Decimal(other))))


def _column(name: str, error: Array, allowed: Array, size: float, t: Array) -> Column:
    k = int(np.argmax(error))
    digits, most = (float(-np.log10(np.max(deviation) / size)) for deviation in (np.maximum(error, allowed), allowed))
    return Column(name, digits, float(error[k]), float(t[k]), size, most)


def _first(happens: NDArray[np.bool_], relative: Array, t: Array, names: list[str]) -> Place | None:
    """Return the first time of an event, and the component with the largest difference at that time."""
    rows = np.flatnonzero(happens.any(axis=1))
    if not rows.size:
        return None
    k = int(rows[0])
    return Place(float(t[k]), names[int(np.argmax(relative[k]))])

"""The members of an ensemble: one problem with many starts, parameters and step sizes."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from daebench.compiler.native import no_machine_code
from daebench.compiler.written import Wrapper
from daebench.errors import BadInput, positive
from daebench.runs.ivp import Array, Ivp

SUMMED = 1e-12
"""Largest accepted deviation from 1 of the sum of the weights of a composition."""


@dataclass(frozen=True)
class Members:
    """Many initial value problems of one definition, each with a step size.

    Parameters
    ----------
    ivp : InitialValueProblem
        The problem, with the parameters that all members share.
    start : tuple of ndarray, each shape(n, d)
        Initial values, in the order of :attr:`daebench.runs.ivp.InitialValueProblem.start`, a row for each member.
    h : float or ndarray, shape(n,)
        Step size of all members, or of each, s.
    parameters : mapping of str to ndarray, shape(n,)
        Parameters that differ from member to member.
    weights : ndarray, shape(n, s), optional
        Weights of the s substeps of a composition, for each member; those of the composition if left out.
    """

    ivp: Ivp
    start: tuple[Array, ...]
    h: Any
    parameters: Mapping[str, Array]
    weights: Array | None = None

    def __len__(self) -> int:
        """Return the number of members."""
        return len(self.start[0])

    @property
    def par(self) -> tuple[Any, ...]:
        """Run-time parameters in the form that kernels take: a number that all members share, or an array."""
        return tuple(self.parameters.get(name, value) for name, value in self.ivp.parameters.items())

    def step_size(self, i: int) -> float:
        """Return the step size of a member, s."""
        return float(self.h if np.ndim(self.h) == 0 else self.h[i])

    def member(self, i: int) -> Ivp:
        """Return the initial value problem of a member."""
        numbers = dict(self.ivp.parameters) | {name: float(values[i]) for name, values in self.parameters.items()}
        return replace(self.ivp.at(*(vectors[i] for vectors in self.start)), parameters=numbers)

    def some(self, rows: Any) -> "Members":
        """Return the members with these numbers."""
        h = self.h if np.ndim(self.h) == 0 else self.h[rows]
        start = tuple(vectors[rows] for vectors in self.start)
        weights = None if self.weights is None else self.weights[rows]
        return Members(self.ivp, start, h, {name: values[rows] for name, values in self.parameters.items()}, weights)

    def weighted(self, weights: Any) -> "Members":
        """Return the members with individual weights for the substeps of a composition, array_like of shape(n, s).

        Raises
        ------
        BadInput
            If the number of rows differs from that of members, or the weights of a member are not finite or do not sum to 1.
        """
        rows = np.array(weights, dtype=float)
        if rows.ndim != 2 or len(rows) != len(self):
            raise BadInput(
                f"weights must be an array of shape ({len(self)}, s), s of each member; this one is of shape {rows.shape}.",
                "member-weights-shape",
            )
        wrong = np.flatnonzero(~(np.abs(np.sum(rows, axis=1) - 1) <= SUMMED))
        if len(wrong):
            of_one = f"those of member {wrong[0]} sum to {np.sum(rows[wrong[0]]):.12g}"
            raise BadInput(f"the weights of each member must sum to 1, so that a step has length h; {of_one}.", "member-weights-sum")
        return replace(self, weights=rows)

    def rows(self, name: str, *arguments: Array) -> tuple[Array, Any]:
        """Return one of the problem's functions for each member, as machine code gives it.

        Parameters
        ----------
        name : str
            Name in ``kernels/language.py`` or ``kernels/composed.py``.
        arguments : ndarray, shape(..., n, d)
            Vectors of each member, in rows.

        Returns
        -------
        rows : ndarray, shape(N, k)
            The k numbers of each value.
        like : nested tuple or float
            The form of a value.
        """
        points = tuple(np.ascontiguousarray(x, dtype=float).reshape(-1, x.shape[-1]) for x in arguments)
        # Vectors that are arrays have compiled functions already, and without machine code a loop in Python is all there is.
        if self.ivp.arrays or no_machine_code():
            return self._singly(name, points)
        par = tuple(np.ascontiguousarray(x, dtype=float) if np.ndim(x) else float(x) for x in self.par)
        call = self._over(name, tuple(x.shape[1] for x in points))
        # A call without rows: it returns the form of a value, which says how wide the result is.
        like = call(tuple(x[:0] for x in points), par, len(self), np.empty((0, 0)))
        rows = np.empty((len(points[0]), len(flat(like))))
        with np.errstate(all="ignore"):
            call(points, par, len(self), rows)
        return rows, like

    def _singly(self, name: str, points: tuple[Array, ...]) -> tuple[Array, Any]:
        """Return the rows of :meth:`rows`, with one call of Python for each."""
        call, vector = getattr(self.ivp.functions(name), name), np.asarray if self.ivp.arrays else tuple
        pars = [tuple(map(np.float64, self.member(i).par)) for i in range(len(self))]
        with np.errstate(all="ignore"):
            values = [call(*map(vector, row), pars[k % len(self)]) for k, row in enumerate(zip(*points, strict=True))]
        return np.array(list(map(flat, values))), values[0]

    def _over(self, name: str, lengths: tuple[int, ...]) -> Any:
        """Return the function that computes another for rows of vectors of these lengths, with the parameters of their members."""
        vectors = [f"({''.join(f'points[{k}][i, {j}], ' for j in range(d))})" for k, d in enumerate(lengths)]
        par = "".join(f"par[{k}][i % n], " if np.ndim(x) else f"par[{k}], " for k, x in enumerate(self.par))
        text = f"""def over(points, par, n, rows):
    for i in range(points[0].shape[0]):
        value = {name}({", ".join(vectors)}, ({par}))
        fill(rows, i, value)
    return value
"""
        singular = {"singular": self.ivp.singular} if self.ivp.singular else {}
        title = f"{name} of {self.ivp.problem}."
        return self.ivp.source.linked(f"{name}_over", title, (name,), wrapper=Wrapper(text, ("over",)), **singular).over

    def along(self, name: str, *arguments: Array) -> Array:
        """Return one of the problem's functions for each member, with its parameters, shape(..., n, ...).

        Parameters are those of :meth:`rows`.
        """
        rows, like = self.rows(name, *arguments)
        return self.ivp.with_columns(name, rows.reshape(*arguments[0].shape[:-1], *np.shape(like)))

    def of_states(self, name: str, states: Array) -> Array:
        """Return a function of stored states, shape(..., n, N); for "g", states contain the positions only."""
        vectors = self.ivp.vectors(states)
        return self.along(name, *(vectors[1:] if name == "g" else vectors))


def flat(x: Any) -> list[float]:
    """Return the numbers of nested tuples, or of an array."""
    return [number for part in x for number in flat(part)] if isinstance(x, tuple) else np.ravel(x).tolist()


def members(ivp: Ivp, start: tuple[Any, ...], h: Any, parameters: Mapping[str, Any]) -> Members:
    """Return members after checking their numbers."""
    arrays = tuple(np.ascontiguousarray(vectors, dtype=float) for vectors in start)
    lengths = [len(vector) for vector in ivp.start]
    n = len(arrays[0]) if arrays and arrays[0].ndim == 2 else 0
    if [array.shape for array in arrays] != [(n, length) for length in lengths] or not n:
        wanted = " and ".join(f"(n, {length})" for length in lengths)
        given = " and ".join(str(array.shape) for array in arrays)
        raise BadInput(
            f"starts of {ivp.problem} are arrays of shape {wanted}, one row per member; these are of shape {given}.", "member-starts-shape"
        )
    sizes = positive("h", h) if np.ndim(h) == 0 else _of_each("h", h, n)
    if np.ndim(sizes) and not np.all(sizes > 0):
        raise BadInput("each h must be greater than 0.", "member-step-not-positive")
    numbers = {}
    for name, values in parameters.items():
        if name not in ivp.parameters:
            raise BadInput(f"{ivp.problem} has no parameter {name!r}; it has {', '.join(ivp.parameters)}.", "member-parameter-unknown")
        numbers[name] = _of_each(name, values, n)
    return Members(ivp, arrays, sizes, numbers)


def _of_each(name: str, values: Any, n: int) -> Array:
    array = np.array(values, dtype=float)
    if array.shape != (n,) or not np.all(np.isfinite(array)):
        raise BadInput(f"{name} must be one number, or {n} finite ones, one for each member.", "member-values-malformed")
    return array

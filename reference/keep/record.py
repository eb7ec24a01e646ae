"""The record of a certified reference: numbers, their bounds, and what is known about them."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np

from daebench.errors import BadInput
from daebench.methods.foreign import ForeignName, Trust, admit
from daebench.methods.initial_value_problem import initial_value_problem
from daebench.runs.ivp import Array, Ivp
from daebench.runs.state import State, state_of_columns

EPS = 2.0**-53
"""Relative rounding of a number in double precision."""


@dataclass(frozen=True, eq=False)
class Reference:
    """A trajectory of which every digit has been checked.

    It is stored as a CSV of 34-digit decimal strings, with every t exact in double precision, beside a JSON certificate. Parameters are the
    decimal numbers as written: gravity 9.81 is 981/100, not the nearest double. The certificate contains

    - the definition with exact initial values, and its hash;
    - how the digits were made, and how they were checked: by quadruple precision or a closed form, by a second computation with another
        step or method, by the motion in other coordinates, and by mpmath;
    - a bound for every number at every time, and the amplification of a rounded start;
    - two horizons: the end of the certified digits, and the time up to which a run in double precision can follow;
    - drifts of the stored digits, and the smallest singular value of G M^-1 G^T;
    - the accuracy that IDA reaches on this motion, for each tolerance: error, its own estimate, and work.

    Parameters
    ----------
    name : str
        PROBLEM-CASE.
    certificate : mapping
        The content of ``certificate.json``.
    text : mapping of str to sequence of str
        Columns t and q1, ..., p1, ..., lam1, ..., or y1, ..., as decimal strings.
    """

    name: str
    certificate: Mapping[str, Any] = field(repr=False)
    text: Mapping[str, Sequence[str]] = field(repr=False)

    @property
    def problem(self) -> str:
        """Name of the problem."""
        return str(self.certificate["problem"])

    @property
    def case(self) -> str:
        """Name of the case."""
        return str(self.certificate["case"])

    @property
    def parameters(self) -> dict[str, float]:
        """Run-time parameters."""
        return {name: float(value) for name, value in self.certificate["definition"]["parameters"].items()}

    @property
    def structure(self) -> dict[str, int]:
        """Structural parameters."""
        return {name: int(value) for name, value in self.certificate["definition"]["structure"].items()}

    @cached_property
    def state(self) -> State:
        """Parts of a row."""
        return state_of_columns(self.text)

    @cached_property
    def t(self) -> Array:
        """Times, s, shape(n,); each is exact in double precision."""
        return np.array([float(x) for x in self.text["t"]])

    @cached_property
    def values(self) -> dict[str, Array]:
        """Every part rounded to double precision, shape(n, components): "q", "p" and "lam", or "y" of a Poisson system."""
        return {part: self._columns(part) for part in self.state.stored}

    @property
    def q(self) -> Array:
        """Positions rounded to double precision, shape(n, d)."""
        return self._part("q")

    @property
    def p(self) -> Array:
        """Momenta rounded to double precision, shape(n, d)."""
        return self._part("p")

    @property
    def lam(self) -> Array:
        """Multipliers lam(p, q), HLW (1.12), rounded to double precision, shape(n, m)."""
        return self._part("lam")

    @property
    def y(self) -> Array:
        """States of a Poisson system rounded to double precision, shape(n, size)."""
        return self._part("y")

    @cached_property
    def bound(self) -> dict[str, Array]:
        """Largest error of every stored number, in the shapes of ``values``."""
        return {part: np.array(self.certificate["bound"][part]) for part in self.state.stored}

    @cached_property
    def amplification(self) -> Array:
        """Largest growth of a perturbation from the start, along the manifold if there is one, shape(n,)."""
        return np.array(self.certificate["amplification"]["values"])

    @cached_property
    def worst_amplification(self) -> Array:
        """The same from any earlier stored time, shape(n,): the largest growth of the rounding of a step."""
        return np.array(self.certificate["amplification"]["worst"])

    @cached_property
    def step_amplification(self) -> Array:
        """The same from the previous stored time, shape(n,), 1 at the start."""
        return np.array(self.certificate["amplification"]["step"])

    @property
    def rank_losses(self) -> tuple[float, ...]:
        """Times of rank loss that the motion passes, s."""
        return tuple(self.certificate.get("rank", {}).get("lost", ()))

    @cached_property
    def conditioning(self) -> Array:
        """Factor by which rounding affects multipliers more than elsewhere, shape(n,): 1 unless the motion passes a rank loss."""
        rank = self.certificate.get("rank", {})
        return np.array([rank["largest"] / value for value in rank["values"]]) if self.rank_losses else np.ones(len(self.t))

    def size(self, part: str) -> float:
        """Return the largest modulus of a part; 1 if all its numbers are zero."""
        return float(np.abs(self.values[part]).max()) or 1.0

    @property
    def horizon(self) -> float:
        """Last stored time, s."""
        return float(self.t[-1])

    @property
    def double_horizon(self) -> float:
        """Time after which no run in double precision can follow, s; infinite if there is no such time before the horizon."""
        horizon = self.certificate["horizon"]["double"]
        return float("inf") if horizon is None else float(horizon)

    def ivp(self) -> Ivp:
        """Return the problem, case and parameters in double precision.

        Raises
        ------
        BadInput
            If the problem of this name now has other parameters, or another definition.
        """
        self.require_named()
        ivp = initial_value_problem(self.problem, self.case)
        if dict(ivp.parameters) != self.parameters:
            raise BadInput(
                f"{self.name} was made with parameters {self.parameters}, but case {self.case} of {self.problem} has "
                f"{dict(ivp.parameters)} today; build the reference again.",
                "reference-of-other-parameters",
            )
        from daebench.reference.keep.definition import define  # imports SymPy, which nothing else here needs

        if define(self.problem, self.case).hash != self.certificate["definition"]["sha256"]:
            raise BadInput(
                f"{self.name} was made from another definition of {self.problem} than today's; build the reference again.",
                "reference-of-other-definition",
            )
        self.require_sizes(ivp)
        return ivp

    def require_named(self) -> None:
        """Accept a problem of daebench, or one that the name of the reference has; raise BadInput for another, which is foreign."""
        problem = ForeignName(self.problem, is_method=False)
        if self.name != f"{self.problem}-{self.case}":
            admit(self.name, [problem], Trust())

    def require_sizes(self, ivp: Ivp) -> None:
        """Accept an initial value problem whose states have as many components as the stored ones; raise BadInput for another."""
        sizes = dict(zip(ivp.state.vectors, map(len, ivp.start), strict=True)) | {"lam": ivp.m}
        for part, values in self.values.items():
            if values.shape[-1] != sizes.get(part):
                raise BadInput(
                    f"{self.name} has {values.shape[-1]} components of {part}, and {ivp.problem} does not; build the reference again.",
                    "reference-of-other-size",
                )

    def restarted(self, ivp: Ivp, row: int) -> Ivp:
        """Return an initial value problem that starts from a stored row, rounded to double precision.

        Parameters
        ----------
        ivp : InitialValueProblem
            The problem with its numbers, as returned by :meth:`ivp`.
        row : int
            Index of the row, from 0.
        """
        changes: dict[str, Any] = {f"{part}0": self.values[part][row] for part in self.state.columns}
        return replace(ivp, **changes)

    def _part(self, part: str) -> Array:
        if part not in self.values:
            raise AttributeError(f"{self.name} has {', '.join(self.values)}, but no {part}.")
        return self.values[part]

    def _columns(self, part: str) -> Array:
        names = [name for name in self.text if name.rstrip("0123456789") == part]
        return np.array([[float(x) for x in self.text[name]] for name in names]).T

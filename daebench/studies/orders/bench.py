"""The runs of one method in an order study: errors of q, p, lam and stage multipliers, or of y on a Poisson system."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, cast

import numpy as np

from daebench.methods.fixed_step.constrained import FixedStep
from daebench.methods.outside.method import OutsideMethod
from daebench.reference.solution import EPS, multipliers_between
from daebench.runs.ivp import Array, ConstrainedIvp, PoissonIvp
from daebench.runs.request import Request
from daebench.runs.state import CONSTRAINED, POISSON, State
from daebench.runs.trajectory import PoissonTrajectory, Trajectory
from daebench.schemes.kernels.claims import Member
from daebench.studies.measurable import PoissonScheme
from daebench.studies.orders.runs import CLEAR, ROUND_OFF, Runs, at_common_times, largest

ON_GRID = 1e-6
"""Times this close to a grid point, in steps, are it."""

MOST_STAGE_MULTIPLIERS = 2e7
"""Stage multipliers are measured in runs of at most so many numbers, for those of all steps have to be kept."""


@dataclass(frozen=True)
class Bench(Runs):
    """Where the runs of one method are made and compared with the reference at the common times."""

    ivp: ConstrainedIvp
    """What is solved."""
    method: FixedStep | OutsideMethod
    """What is measured."""
    state = ("q", "p", "lam")
    leading = ("q", "p")

    @property
    def _member(self) -> Member | None:
        """The scheme in its file; None of a composition, and of a method from outside."""
        return None if isinstance(self.method, OutsideMethod) or self.method.composition else self.method.member

    @property
    def _stage_multipliers(self) -> Mapping[str, float]:
        """Names and nodes of the stage multipliers; those of a composition belong to its substeps and are not given."""
        return self._member.multipliers() if self._member else {}

    def _exact(self, name: str) -> Array:
        return self.known.states[self._like(name)]

    def _like(self, name: str) -> str:
        """Return the component that one is compared with: stage multipliers stand for lam."""
        return name if name in self.state else "lam"

    def _floor(self, name: str, h: Sequence[float], errors: Sequence[float]) -> float:
        size = max(self._size("p"), self._push()) if name == "p" else self._size(name)
        lost = 0.0 if name in self.state else self._lost(h, errors)
        return max(self.known.bound[self._like(name)], ROUND_OFF * EPS * size, lost)

    def _push(self) -> float:
        """Return the change of a momentum by the forces in T/32: their rounding is in p, however small they leave it."""
        return largest(self.ivp.along("H_q", self.known.states["p"], self.known.states["q"])) * float(self.known.t[-1]) / 32

    def _lost(self, h: Sequence[float], errors: Sequence[float]) -> float:
        """Return the largest error of a stage multiplier that the rounding of positions may have made, eps |G| |q| / (h^2 G M^-1 G^T)."""
        p, q = (self.known.states[name][:1] for name in ("p", "q"))
        G, M_inverse = self.ivp.along("G", q)[0], self.ivp.along("H_pp", p, q)[0]
        least = float(np.linalg.svd(G @ M_inverse @ G.T, compute_uv=False)[-1])
        unit = EPS * float(np.linalg.norm(G)) * self._size("q") / least
        return max((error for step, error in zip(h, errors, strict=True) if error * step * step <= CLEAR * unit), default=0.0)

    def _run(self, h: float, steps: int, n: int) -> Trajectory:
        stage_multipliers = (
            bool(self._stage_multipliers) and steps * (2 * self.ivp.d + len(self._stage_multipliers) * self.ivp.m) <= MOST_STAGE_MULTIPLIERS
        )
        request = Request(value=h, steps=steps, every=1 if stage_multipliers else n, raw=stage_multipliers, watch=(), count=False)
        return cast(Trajectory, self.method.solve(self.ivp, request))

    def _errors(self, run: Trajectory, n: int, *, halved: bool) -> tuple[dict[str, float], float]:
        """Return the errors and the bound; stage multipliers only after halvings.

        The rounding of a state makes an error in a stage multiplier that grows with 1/h, so that slopes between close step sizes are lost.
        """
        errors, bound = self._raw_errors(run, n) if halved else ({}, 0.0)
        return self._state_errors(run) | errors, bound

    def _state_errors(self, run: Trajectory) -> dict[str, float]:
        q, p = at_common_times(run.q), at_common_times(run.p)
        states = {"q": q, "p": p, "lam": self.ivp.along("lam", p, q)}
        return {name: largest(rows - self._exact(name)) for name, rows in states.items()}

    def _raw_errors(self, run: Trajectory, n: int) -> tuple[dict[str, float], float]:
        if not run.raw:
            return {}, 0.0
        chosen = {name: self._at_common_times(*series, run.value, n) for name, series in run.raw.items()}
        times = np.concatenate([t for t, _ in chosen.values()])
        exact, bound = multipliers_between(self.ivp, self.known, times)
        parts = np.split(exact, np.cumsum([len(t) for t, _ in chosen.values()])[:-1])
        vanishing = self._member.vanishing if self._member else ()
        parts = [0.0 * part if name in vanishing else part for name, part in zip(chosen, parts, strict=True)]
        return {name: largest(chosen[name][1] - part) for name, part in zip(chosen, parts, strict=True)}, bound

    def _at_common_times(self, t: Array, values: Array, h: float, n: int) -> tuple[Array, Array]:
        """Return the times and values at common times, or in the steps that begin there; the grid's times exactly."""
        step = np.rint(t / h)
        if np.all(np.abs(t / h - step) < ON_GRID):
            mask = step % n == 0
            return np.concatenate([[0.0], self.known.t])[(step[mask] // n).astype(int)], values[mask]
        mask = np.floor(t / h) % n == 0
        return t[mask], values[mask]


@dataclass(frozen=True)
class PoissonBench(Runs):
    """Where the runs of one method are made and compared with the reference at the common times."""

    ivp: PoissonIvp
    """What is solved."""
    method: PoissonScheme
    """What is measured."""
    state = leading = ("y",)

    def _floor(self, name: str, h: Sequence[float], errors: Sequence[float]) -> float:
        return max(self.known.bound["y"], ROUND_OFF * EPS * self._size("y"))

    def _run(self, h: float, steps: int, n: int) -> PoissonTrajectory:
        return self.method.solve(self.ivp, Request(value=h, steps=steps, every=n, watch=(), count=False))

    def _errors(self, run: PoissonTrajectory, n: int, *, halved: bool) -> tuple[dict[str, float], float]:
        return {"y": largest(at_common_times(run.y) - self._exact("y"))}, 0.0


BENCHES: Mapping[State, Any] = {CONSTRAINED: Bench, POISSON: PoissonBench}

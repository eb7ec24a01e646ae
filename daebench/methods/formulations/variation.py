"""Formulations with their variational equations: how the solution changes with parameters and initial values.

::

    F(t, y, y', a) = 0,      F_y s + F_y' s' + F_a da = 0      in each direction (da, s(0))
"""

import types
from abc import abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass, field, fields
from typing import Any

import numpy as np

from daebench.compiler.cache import generated
from daebench.methods.formulations.constrained import Array, Dae, Posed
from daebench.methods.formulations.poisson import PoissonDae
from daebench.runs.directions import STEP, Directions, imaginary, moved_by


@dataclass(frozen=True, eq=False)
class Varied(Posed):
    """A formulation whose unknowns are followed by their derivatives in k directions: y, s_1, ..., s_k.

    Directions are scaled, so that derivatives are as large as unknowns and have their tolerances; ``par`` has the numbers, and their change
    in each direction. Blocks are those of y.
    """

    directions: Directions = field(repr=False, kw_only=True)
    """The directions."""

    @property
    def copies(self) -> int:
        """How many times the blocks follow each other: k + 1."""
        return 1 + len(self.directions.units)

    @abstractmethod
    def sensitivities(self, Y: Array) -> dict[str, dict[str, Array]]:
        """Return the derivatives of the states, by what they are taken by and by name, of rows of unknowns that begin with the start."""


@dataclass(frozen=True, eq=False)
class VariedDae(Varied, Dae):
    """A constrained system in a formulation with its variational equations."""

    def sensitivities(self, Y: Array) -> dict[str, dict[str, Array]]:
        """Return the derivatives of q and p; p = M v is differentiated by complex step."""
        d, chosen = self.d, self.directions
        y, *S = np.split(Y, self.copies, axis=1)
        rows = np.empty((len(S), len(Y), 2 * d))
        for s, par, of in zip(S, chosen.par.T, rows, strict=True):
            q, v = (y[:, part] + 1j * STEP * s[:, part] for part in (slice(d), slice(d, 2 * d)))
            p = np.einsum("rij,rj->ri", moved_by(self.ivp, par).along("M", q), v) if self.mechanical else v
            of[:, :d], of[:, d:] = imaginary(p), s[:, :d]
        rows[:, 0] = chosen.start.T  # as it is asked for, without the round-off of p = M v
        return chosen.results(rows, {"q": slice(d, 2 * d), "p": slice(d)})


@dataclass(frozen=True, eq=False)
class VariedPoisson(Varied, PoissonDae):
    """A Poisson system in a formulation with its variational equations."""

    def sensitivities(self, Y: Array) -> dict[str, dict[str, Array]]:
        """Return the derivatives of y."""
        size = self.ivp.size
        rows = np.stack([s[:, :size] for s in np.split(Y, self.copies, axis=1)[1:]])
        return self.directions.results(rows, {"y": slice(size)})


def varied(dae: Dae, chosen: Directions) -> VariedDae:
    """Return a formulation with its variational equations in some directions.

    At the start derivatives are those of the consistent start: of rates and multipliers by the linear system that these solve.
    """
    starts = [_start(dae, par, start) for par, start in zip(chosen.par.T, chosen.start.T, strict=True)]
    numbers = np.zeros((len(dae.par) - len(dae.ivp.par), len(starts)))
    return VariedDae(**_enlarged(dae, chosen, numbers, starts, _module(dae, "residuals", len(starts))))


def varied_poisson(dae: PoissonDae, chosen: Directions) -> VariedPoisson:
    """Return a formulation of a Poisson system with its variational equations in some directions.

    Values that Casimir functions keep, those at the start, change with it.
    """
    starts, conserved = [], []
    nothing = np.zeros(dae.n - dae.ivp.size)
    for par, start in zip(chosen.par.T, chosen.start.T, strict=True):
        moved, y = moved_by(dae.ivp, par), dae.ivp.y0 + 1j * STEP * start
        starts.append(tuple(np.concatenate([change, nothing]) for change in (start, imaginary(moved.value("field", y)))))
        conserved.append(imaginary(moved.value("casimirs", y)) if dae.formulation == "casimirs" else nothing)
    return VariedPoisson(**_enlarged(dae, chosen, np.array(conserved).T, starts, _module(dae, "poisson_residuals", len(starts))))


def _enlarged(
    dae: Posed, chosen: Directions, numbers: Array, starts: Sequence[tuple[Array, ...]], module: types.ModuleType
) -> dict[str, Any]:
    """Return the fields of a formulation with its variational equations, of which ``numbers`` are the changes of its own numbers."""
    same = {item.name: getattr(dae, item.name) for item in fields(dae)}
    return same | {
        "par": np.concatenate([dae.par, np.concatenate([chosen.par, numbers]).T.ravel()]),
        "y0": np.concatenate([dae.y0, *(s for s, _ in starts)]),
        "yp0": np.concatenate([dae.yp0, *(rates for _, rates in starts)]),
        "module": module,
        "directions": chosen,
    }


def _module(dae: Posed, file: str, k: int) -> types.ModuleType:
    """Return the generated functions; ``file`` is that of their source."""

    def build() -> str:
        from daebench.methods.formulations import poisson_residuals, residuals

        written: Any = {"residuals": residuals, "poisson_residuals": poisson_residuals}[file]
        title = f"{dae.ivp.problem} as {dae.formulation}, multipliers {dae.multipliers}, and its variations in {k} directions."
        return str(written.source(title, dae.ivp.source.derivation, dae.formulation, dae.multipliers, directions=k))

    key = f"{dae.ivp.source.key} {file} {dae.formulation} {dae.multipliers} varied {k}"
    return generated(f"{dae.ivp.problem}_{dae.formulation}_varied{k}", key, build)


def _start(dae: Dae, par: Array, start: Array) -> tuple[Array, Array]:
    """Return the derivatives of y0 and of yp0 in a direction."""
    moved, K = moved_by(dae.ivp, par), dae.module.K
    p, q = np.split(np.concatenate(dae.ivp.start) + 1j * STEP * start, 2)
    state = np.concatenate([q, moved.value("H_p", p, q) if dae.mechanical else p])
    A, b, rates = np.empty((K, K), complex), np.empty(K, complex), np.empty_like(state)
    numbers = [*moved.par, *dae.par[len(dae.ivp.par) :]]
    dae.module.system(state, A, b, numbers)
    z = np.linalg.solve(A.real, b.real)
    dz = np.linalg.solve(A.real, imaginary(b) - imaginary(A) @ z)
    dae.module.slope(state, z + 1j * STEP * dz, rates, numbers)
    forces, nothing = np.zeros((2, dae.n - len(state)))
    forces[: dae.m] = dz[-dae.m :]
    others = (forces, nothing) if dae.multipliers == "plain" else (nothing, forces)
    return np.concatenate([imaginary(state), others[0]]), np.concatenate([imaginary(rates), others[1]])

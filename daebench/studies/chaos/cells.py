"""The cells of a plane of starts of a constrained problem: moved until they meet the constraints, from one to the next."""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from daebench.diagnostics.nearest import nearest
from daebench.errors import BadInput
from daebench.runs.ivp import Array, ConstrainedIvp
from daebench.runs.members import Members
from daebench.runs.scales import constrained_scales_of
from daebench.starts.box import coordinates

NO_POSITION = "no position found on the manifold"
NO_MOMENTUM = "no momentum on the manifold"
NO_ENERGY = "no momentum of this energy"
"""Why a cell has no start."""

INDEPENDENT = 1e-6
"""Part of a unit change of two coordinates that is left along the manifold at least, for them to span a plane of starts."""

ASIDE = 0.05
"""Relative change of a start from which nearby ones are sought: a symmetric start can be one from which Newton's iteration cannot leave."""

Solve = Callable[[Array, NDArray[np.intp]], tuple[Array, NDArray[np.bool_]]]
"""From guesses in some cells to what meets the conditions there, and whether it does."""


class Cells:
    """The cells of a constrained problem: positions first, from the cell nearest to the problem's start on, and then momenta."""

    def __init__(self, ivp: ConstrainedIvp, some: Members, names: list[str], level: float | None, cells: int) -> None:
        if level is not None and not ivp.facts.QUADRATIC:
            raise BadInput(
                f"starts of one energy take H that is quadratic in p, and that of {ivp.problem} is not; leave out the energy.",
                "chaos-needs-quadratic-h",
            )
        self.some, self.level, self.cells = some, level, cells
        held = [coordinates(ivp)[name] for name in names]
        self.held = [np.array([(k, i) in held for i in range(ivp.d)]) for k in range(2)]
        self.length = constrained_scales_of(some, rated=False)[0]
        self.push = ivp.p0 if np.any(ivp.p0) else ivp.value("mass", *ivp.start) @ np.ones(ivp.d)
        distance = np.zeros(len(some))
        for part, vector in zip(some.start, ivp.start, strict=True):
            size = np.ptp(part, axis=0)
            distance += np.sum((part - vector) ** 2 / np.where(size > 0, size, 1.0) ** 2, axis=1)
        self.order = np.argsort(distance, kind="stable")

    def settled(self, reasons: NDArray[np.str_]) -> tuple[Array, Array]:
        """Return momenta and positions of all cells; say why where there are none."""
        p, q = self.some.start
        q = self._filled(q, self.held[1], self._on_positions, reasons, NO_POSITION)
        there = np.flatnonzero(reasons == "")
        p, moved = p.copy(), self._on_momenta(p, q, there)
        p[there] = moved
        reasons[there[~np.all(np.isfinite(moved), axis=1)]] = NO_MOMENTUM if self.level is None else NO_ENERGY
        return p, q

    def _on_positions(self, x: Array, rows: NDArray[np.intp]) -> tuple[Array, NDArray[np.bool_]]:
        """Return positions on the manifold, and where they are that."""
        some = self.some.some(rows)
        W = _freed(some.along("H_pp", some.start[0], x), self.held[1])

        def conditions(q: Array, part: NDArray[np.intp]) -> tuple[Array, Array]:
            here = some.some(part)
            return here.along("g", q), here.along("G", q)

        positions, _, met = nearest(conditions, x, W, self.length[rows])
        return positions, met

    def _on_momenta(self, p: Array, q: Array, rows: NDArray[np.intp]) -> Array:
        """Return momenta on the manifold in some cells, of the energy if one is asked for; NaN where there are none."""
        some, p, q = self.some.some(rows), p[rows], q[rows]

        def conditions(x: Array, part: NDArray[np.intp]) -> tuple[Array, Array]:
            here = some.some(part)
            return here.along("Gv", x, q[part]), here.along("Gv_p", x, q[part])

        p, _, met = nearest(conditions, p, _freed(some.along("mass", p, q), self.held[0]), np.zeros(len(p)))
        p = np.where(met[:, None], p, np.nan)
        return p if self.level is None else self._of_energy(some, p, q, self.level)

    def _of_energy(self, some: Members, p: Array, q: Array, level: float) -> Array:
        """Return momenta of an energy, in the direction of the problem's start from that of least energy; NaN where there is none.

        With the projector P onto what may be changed, P^T = P, and A = M^-1 ::

            p_least = p - P (P A P)^+ P H_p,        H(p_least + s n) = H(p_least) + s^2 / 2 n^T A n,        n = P push
        """
        C, A = some.along("Gv_p", p, q), some.along("H_pp", p, q)
        held = np.broadcast_to(np.eye(len(self.push))[self.held[0]], (len(p), int(np.sum(self.held[0])), len(self.push)))
        C = np.concatenate([C, held], axis=1)
        there = np.flatnonzero(np.all(np.isfinite(p), axis=1))
        moved = np.full_like(p, np.nan)
        P = np.eye(len(self.push)) - np.linalg.pinv(C[there]) @ C[there]
        metric, slope = P @ A[there] @ P, P @ some.some(there).along("H_p", p[there], q[there])[:, :, None]
        least = p[there] - (np.linalg.pinv(metric, rcond=INDEPENDENT, hermitian=True) @ slope)[:, :, 0]
        n = P @ self.push
        with np.errstate(divide="ignore", invalid="ignore"):  # a kinetic energy below the least one, or a push along what is held
            missing = 2 * (level - some.some(there).along("H", least, q[there])) / np.einsum("ni,nij,nj->n", n, metric, n)
            moved[there] = np.where(self.held[0], p[there], least + np.sqrt(missing)[:, None] * n)
        return moved

    def _filled(self, start: Array, held: NDArray[np.bool_], solve: Solve, reasons: NDArray[np.str_], why: str) -> Array:
        """Return the solution of the conditions in each cell; the first guess is the start, and others are solutions in cells beside."""
        x, open_cells = start.copy(), reasons == ""
        done = np.zeros(len(x), dtype=bool)
        direct, met = self._from_start(x, held, solve, np.flatnonzero(open_cells))
        for cell in self.order[met[self.order]]:
            if done[cell]:
                continue
            x[cell], done[cell] = direct[cell], True
            self._spread(x, done, open_cells, held, solve)
        reasons[open_cells & ~done] = why
        return x

    def _from_start(self, x: Array, held: NDArray[np.bool_], solve: Solve, rows: NDArray[np.intp]) -> tuple[Array, NDArray[np.bool_]]:
        """Return the solutions from the start, or from a little aside of it, in each of some cells, and where there are any."""
        solutions, met = x.copy(), np.zeros(len(x), dtype=bool)
        aside = ASIDE * np.max(np.abs(x), axis=1, keepdims=True) * np.cos(1.0 + np.arange(x.shape[1]))
        for guess in (x, x + np.where(held, 0.0, aside), x - np.where(held, 0.0, aside)):
            left = rows[~met[rows]]
            if len(left):
                solutions[left], met[left] = solve(guess[left], left)
        return solutions, met

    def _spread(self, x: Array, done: NDArray[np.bool_], open_cells: NDArray[np.bool_], held: NDArray[np.bool_], solve: Solve) -> None:
        """Go on from cells that are done to those beside them, until no more are found; each is tried once from each side."""
        fixed = x[:, held].copy()
        columns = np.arange(len(x)) % self.cells
        tried = np.zeros((4, len(x)), dtype=bool)
        going = True
        while going:
            going = False
            for side, (step, edge) in enumerate(((1, 0), (-1, self.cells - 1), (self.cells, -1), (-self.cells, -1))):
                beside = np.arange(len(x)) - step
                inside = (beside >= 0) & (beside < len(x)) & (columns != edge)
                cells = np.flatnonzero(inside & open_cells & ~done & ~tried[side] & done[np.clip(beside, 0, len(x) - 1)])
                if not len(cells):
                    continue
                tried[side, cells] = going = True
                guess = x[beside[cells]]
                guess[:, held] = fixed[cells]
                solutions, met = solve(guess, cells)
                x[cells[met]], done[cells[met]] = solutions[met], True


def _freed(W: Array, held: NDArray[np.bool_]) -> Array:
    """Return the inverse of a metric in which some coordinates cannot be moved."""
    return np.where(held[:, None] | held[None, :], 0.0, W)

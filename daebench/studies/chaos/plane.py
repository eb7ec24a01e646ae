"""A plane of starts: two coordinates on a grid, and the others moved until the start is on the manifold, of one energy if asked."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from daebench.diagnostics.nearest import nearest
from daebench.diagnostics.symplecticity import tangent_basis
from daebench.errors import BadInput, real, unknown, whole
from daebench.runs.ivp import Array, ConstrainedIvp, InitialValueProblem, PoissonIvp
from daebench.runs.members import Members, members
from daebench.runs.scales import constrained_scales_of
from daebench.studies.ensemble.distributions.box import Bounds, bounds_of, coordinates

NO_POSITION = "no position found on the manifold"
NO_MOMENTUM = "no momentum on the manifold"
NO_ENERGY = "no momentum of this energy"
OUTSIDE = "outside of the domain"

INDEPENDENT = 1e-6
"""Part of a unit change of two coordinates that is left along the manifold at least, for them to span a plane of starts."""

ASIDE = 0.05
"""Relative change of a start from which nearby ones are sought: a symmetric start can be one from which Newton's iteration cannot leave."""

MOST_CELLS = 256
"""Most cells along a side, whose growth in two thousand intervals is a gigabyte."""

Solve = Callable[[Array, NDArray[np.intp]], tuple[Array, NDArray[np.bool_]]]
"""From guesses in some cells to what meets the conditions there, and whether it does."""


@dataclass(frozen=True)
class Plane:
    """A grid of starts over two coordinates.

    Parameters
    ----------
    names : (str, str)
        The coordinates across and up.
    across, up : ndarray, shape(c,) and shape(r,)
        Their values at the centres of cells.
    members : Members
        The starts that there are.
    cells : ndarray of int, shape(n,)
        The cell of each, counted row by row.
    reasons : ndarray of str, shape(r * c,)
        Why there is no start in a cell; "" where there is one.
    about : str
        A sentence that says what the starts are.
    """

    names: tuple[str, str]
    across: Array
    up: Array
    members: Members
    cells: NDArray[np.intp]
    reasons: NDArray[np.str_]
    about: str

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns."""
        return len(self.up), len(self.across)

    def spread(self, values: Array, empty: Any = np.nan) -> Any:
        """Return numbers or words of the starts as those of cells, shape(r, c)."""
        filled = np.full(self.reasons.shape, empty, dtype=np.result_type(values.dtype, type(empty)))
        filled[self.cells] = values
        return filled.reshape(self.shape)


def plane_of(
    ivp: InitialValueProblem,
    names: Mapping[str, tuple[float, float] | None] | None,
    *,
    cells: int,
    h: float,
    energy: float | str | None = None,
    cut: tuple[str, float] | None = None,
) -> Plane:
    """Return the starts of a plane.

    The coordinates of the plane are those of the cell exactly. The others begin with their values in the case, or in a cell beside it, and
    are moved to the nearest ones on the manifold, positions first, in the metric of kinetic energy; where an energy is given, momenta are
    moved to that too. What cannot be reached so is an empty cell.

    Parameters
    ----------
    ivp : InitialValueProblem
        The problem; its start is where others are sought from.
    names : mapping of str to (float, float) or None, optional
        Two coordinates, as q1, p2 or y1, with bounds, or None for bounds about the start. The default is the first two that are independent
        on the manifold.
    cells : int
        Cells along a side.
    h : float
        Step size of the members, s.
    energy : float or "case", optional
        Energy of all starts, or that of the problem's start.
    cut : (str, float), optional
        A third coordinate and its value in all starts.

    Raises
    ------
    BadInput
        If names or numbers are not what they must be, or no start is found.
    """
    if not 2 <= whole("cells", cells) <= MOST_CELLS:
        raise BadInput(f"cells = {cells} must be from 2 to {MOST_CELLS} along a side.")
    if ivp.arrays:
        raise BadInput(
            f"a plane of starts takes vectors of few numbers, and those of {ivp.problem} are arrays; take fewer bodies or sites."
        )
    bounds = _bounds(ivp, names)
    first, second = bounds
    across, up = (_centres(*bounds[name], cells) for name in bounds)
    values = {first: np.tile(across, cells), second: np.repeat(up, cells), **({cut[0]: np.full(cells * cells, cut[1])} if cut else {})}
    start = tuple(np.repeat(vector[None], cells * cells, axis=0) for vector in ivp.start)
    for name, numbers in values.items():
        vector, place = coordinates(ivp)[name]
        start[vector][:, place] = numbers
    some = members(ivp, start, h, {})
    level = _level(ivp, energy)
    reasons = np.full(cells * cells, "", dtype="U40")
    if ivp.facts.KIND == "poisson" and ivp.facts.DOMAIN:
        reasons[~some.along("inside", some.start[0]).astype(bool)] = OUTSIDE
    if isinstance(ivp, ConstrainedIvp):
        start = _Cells(ivp, some, list(values), level, cells).settled(reasons)
    there = np.flatnonzero(reasons == "")
    if not len(there):
        why, count = _most_common(reasons)
        raise BadInput(
            f"no start of the plane {first}, {second} of {ivp.problem}: {why} in {count} of {cells * cells} cells; change its bounds."
        )
    about = _about(ivp, bounds, cells, len(there), level, cut)
    return Plane((first, second), across, up, members(ivp, tuple(part[there] for part in start), h, {}), there, reasons, about)


def _most_common(reasons: NDArray[np.str_]) -> tuple[str, int]:
    words, counts = np.unique(reasons, return_counts=True)
    return str(words[np.argmax(counts)]), int(np.max(counts))


def _about(ivp: InitialValueProblem, bounds: Bounds, cells: int, there: int, level: float | None, cut: tuple[str, float] | None) -> str:
    ranges = " and ".join(f"{name} from {lo:g} to {hi:g}" for name, (lo, hi) in bounds.items())
    of_energy = "" if level is None else f", all of energy {level:.6g}"
    where = "" if cut is None else f", at {cut[0]} = {cut[1]:g}"
    return f"{there} starts in {cells} x {cells} cells of {ranges}{where}, about {ivp.problem}, case {ivp.case}{of_energy}."


def _centres(lo: float, hi: float, cells: int) -> Array:
    return lo + (hi - lo) * (np.arange(cells) + 0.5) / cells


def _level(ivp: InitialValueProblem, energy: float | str | None) -> float | None:
    """Return the energy that all starts are to have, or None."""
    if energy is None:
        return None
    if isinstance(ivp, PoissonIvp):
        raise BadInput(f"{ivp.problem} is a Poisson system, whose starts are not moved to an energy; leave out the energy.")
    if energy == "case":
        return float(ivp.value("H", *ivp.start))
    if isinstance(energy, str):
        raise BadInput(f"energy {energy!r} must be a number, or case for that of the case.")
    return real("energy", energy)


def _bounds(ivp: InitialValueProblem, names: Mapping[str, tuple[float, float] | None] | None) -> dict[str, tuple[float, float]]:
    """Return the names of two coordinates with their bounds."""
    known = coordinates(ivp)
    chosen = dict(names) if names is not None else dict.fromkeys(_independent(ivp))
    if len(chosen) != 2:
        raise BadInput(f"a plane has two coordinates, as q1 and p2, not {len(chosen)}.")
    for name in chosen:
        if name not in known:
            raise unknown(f"coordinate of {ivp.problem}", name, known)
    return {name: bounds_of(name, given) if given is not None else _about_start(ivp, name) for name, given in chosen.items()}


def _independent(ivp: InitialValueProblem) -> list[str]:
    """Return the first two coordinates, positions first, that can be changed independently along the manifold at the start."""
    known = coordinates(ivp)
    names = [*(name for name in known if name[0] != "p"), *(name for name in known if name[0] == "p")]
    ends = np.cumsum([0, *map(len, ivp.start)])
    basis = tangent_basis(ivp, *ivp.start) if isinstance(ivp, ConstrainedIvp) else np.eye(int(ends[-1]))
    chosen: list[str] = []
    for name in names:
        rows = [basis[ends[vector] + place] for vector, place in (known[other] for other in (*chosen, name))]
        if np.linalg.svd(np.array(rows), compute_uv=False)[-1] > INDEPENDENT:
            chosen.append(name)
        if len(chosen) == 2:
            return chosen
    raise BadInput(f"{ivp.problem} has no two coordinates that are independent, and so no plane of starts.")


def _about_start(ivp: InitialValueProblem, name: str) -> tuple[float, float]:
    """Return bounds about the start, as far off as it is large."""
    vector, place = coordinates(ivp)[name]
    centre = float(ivp.start[vector][place])
    if isinstance(ivp, PoissonIvp):
        reach = float(np.max(np.abs(ivp.start[vector]))) / 2 or 1.0
        return centre - reach, centre + reach
    length, rate = (float(x[0]) for x in constrained_scales_of(members(ivp, tuple(v[None] for v in ivp.start), 1.0, {}), rated=True))
    reach = length / 2
    if name[0] == "p":
        mass = float(np.max(np.abs(ivp.value("mass", *ivp.start))))
        reach = max(float(np.max(np.abs(ivp.start[0]))), mass * length * rate) / 2
    return centre - (reach or 1.0), centre + (reach or 1.0)


class _Cells:
    """The cells of a constrained problem: positions first, from the cell nearest to the problem's start on, and then momenta."""

    def __init__(self, ivp: ConstrainedIvp, some: Members, names: list[str], level: float | None, cells: int) -> None:
        if level is not None and not ivp.facts.QUADRATIC:
            raise BadInput(f"starts of one energy take H that is quadratic in p, and that of {ivp.problem} is not; leave out the energy.")
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

        found, _, met = nearest(conditions, x, W, self.length[rows])
        return found, met

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
        """Return what solves the conditions in each cell; a guess is the start at first, and then what was found in the cell beside."""
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
        """Return what is found from the start, or from a little aside of it, in each of some cells, and where that is something."""
        found, met = x.copy(), np.zeros(len(x), dtype=bool)
        aside = ASIDE * np.max(np.abs(x), axis=1, keepdims=True) * np.cos(1.0 + np.arange(x.shape[1]))
        for guess in (x, x + np.where(held, 0.0, aside), x - np.where(held, 0.0, aside)):
            left = rows[~met[rows]]
            if len(left):
                found[left], met[left] = solve(guess[left], left)
        return found, met

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
                found, met = solve(guess, cells)
                x[cells[met]], done[cells[met]] = found[met], True


def _freed(W: Array, held: NDArray[np.bool_]) -> Array:
    """Return the inverse of a metric in which some coordinates cannot be moved."""
    return np.where(held[:, None] | held[None, :], 0.0, W)

"""Starts of one energy, distributed by the Liouville measure on the energy surface in the constraint manifold."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from daebench.diagnostics.projected_members import project_members, require_projected
from daebench.errors import BadInput, real
from daebench.runs.ivp import Array, Ivp
from daebench.starts.box import Bounds, box_of, excess, in_words
from daebench.starts.convergence import explored, settled
from daebench.starts.mechanics import Mechanics, Positions, Rows, gram, log_det, mechanics_of
from daebench.starts.members import Starts, copies, differing, of_case
from daebench.starts.walk import LevelSet, searched


@dataclass(frozen=True)
class Reachable(Positions):
    """Positions with g = 0 and U <= E in a box.

    The density with respect to the Euclidean surface measure is ::

        (E - U)^(k/2 - 1) sqrt( det M det(G M^-1 G^T) / det(G G^T) )
    """

    E: float
    """Energy."""
    bounds: tuple[Array, Array]
    """Bounds of positions; shape (d,)."""
    flat: bool = False
    """Whether the density is one everywhere instead."""
    noise: int = 0

    def weighed(self, x: Array, C: Array, noise: Array, rows: Rows) -> tuple[Array, Array]:
        """Return the logarithm of the density, and nothing besides."""
        kinetic, nothing = self.E - self.mechanics.U(x, rows), np.empty((0, x.shape[1]))
        power = self.mechanics.k / 2 - 1
        density = np.where((kinetic >= 0) & (excess(x, self.bounds) <= 0), 0.0, -np.inf)
        if self.flat:
            return density, nothing
        if power:
            density = density + power * np.log(np.maximum(kinetic, 0.0))
        return density + self.mechanics.volume(x, C, rows) - log_det(gram(C, C)) / 2, nothing


@dataclass(frozen=True)
class EnergyCurve:
    """The curve of (q, u), u = s / w, with g = 0 and s^2 / 2 + U = E: for a motion of one degree of freedom.

    What (E - U)^(-1/2) is to the surface measure of {g = 0}, which has no bound where s = 0, is here ::

        sqrt( det M det(G M^-1 G^T) / det(C C^T) ),      C = [[G, 0], [U_q / w^2, u]]

    to the Euclidean measure of the curve, for delta(s^2 / 2 + U - E) integrated over s is sqrt(2) (E - U)^(-1/2).

    Parameters
    ----------
    reachable : Reachable
        Positions and energy.
    w : float
        Rate by which s becomes a length, 1/s times the root of a mass.
    """

    reachable: Reachable
    w: float
    noise: int = 0

    def conditions(self, x: Array, rows: Rows) -> tuple[Array, Array]:
        """Return g and u^2 / 2 + (U - E) / w^2 at points of some members, and their Jacobian."""
        q, u = x[:-1], x[-1]
        g, G = self.reachable.conditions(q, rows)
        some, square = self.reachable.mechanics, self.w**2
        c = np.concatenate([g, [u**2 / 2 + (some.U(q, rows) - self.reachable.E) / square]])
        C = np.zeros((len(c), *x.shape))
        C[:-1, :-1], C[-1, :-1], C[-1, -1] = G, some.U_q(q, rows) / square, u
        return c, C

    def weighed(self, x: Array, C: Array, noise: Array, rows: Rows) -> tuple[Array, Array]:
        """Return the logarithm of the density, and nothing besides."""
        q, reachable = x[:-1], self.reachable
        density = np.where(excess(q, reachable.bounds) <= 0, 0.0, -np.inf)
        return density + reachable.mechanics.volume(q, C[:-1, :-1], rows) - log_det(gram(C, C)) / 2, np.empty((0, x.shape[1]))


@dataclass(frozen=True)
class Energy:
    """The Liouville measure at fixed energy.

    ::

        det(G M^-1 G^T) delta(g(q)) delta(G M^-1 p) delta(H(p, q) - E) dq dp,      H = p^T M^-1 p / 2 + U

    The flow of the problem preserves it. Positions have the density (E - U)^(k/2 - 1), k = d - m, with respect to the surface measure of
    {g = 0} in the metric M(q), and momenta are uniform on the sphere p^T M^-1 p = 2 (E - U) in the plane G M^-1 p = 0, in the metric M^-1:
    T. Lelièvre, M. Rousset, G. Stoltz, Langevin dynamics with constraints and computation of free energy differences, Math. Comp. 81
    (2012), 2071-2125. Positions are drawn by random walks, one for each member, see :mod:`daebench.starts.walk`.
    With k = 1 their density has no bound where the motion turns back; the walk is then on the curve of (q, s) with s^2 / 2 + U = E, see
    :class:`daebench.starts.energy.EnergyCurve`.

    What a walk does not reach is not drawn: of a manifold in several pieces, such as the two assemblies of a linkage, only that in which
    the start of the problem lies, but for pieces so near to each other that a step goes from one to the other; likewise of positions that
    a barrier of potential energy parts. Momenta have either sign, also where the motion never turns back.

    Parameters
    ----------
    E : float, optional
        Energy; the default is that of the problem's start.
    box : mapping of str to (float, float)
        Bounds of positions, by the names q1, q2, ...
    """

    E: float | None = None
    box: Bounds = field(default_factory=dict)

    def draw(self, ivp: Ivp, n: int | None, h: Any, parameters: Mapping[str, Any] | None = None, seed: int = 0) -> Starts:
        """Return n members with starts of this energy, each the same however many there are.

        Raises
        ------
        BadInput
            If the problem is a Poisson system or its H is not quadratic in p, no position has so little potential energy, or the walk does
            not settle.
        """
        some = copies(ivp, n, h, parameters, seed)
        mechanics_of(some, "energy")
        mechanics = Mechanics(require_projected(project_members(some), "the energy surface"))
        E = real("E", self.E) if self.E is not None else float(ivp.value("H", *ivp.start))
        where = f" in {in_words(self.box)}" if self.box else ""
        what = f"the Liouville measure of {of_case(ivp)}, at the energy {E:.6g}{where}"
        surface = _Surface(mechanics, E, box_of(ivp, self.box, "q")[1], seed, what)
        walk = settled(surface.part, surface.first(), [seed, 2], what)
        q = walk.x[: mechanics.d].T
        projected = project_members(replace(some, start=(np.zeros_like(q), q)))
        some = surface.with_momenta(require_projected(projected, "the energy surface").start[1])
        return Starts(some, f"{what}{differing(some)}; {walk.in_words}; seed {seed}.", walk.measured | {"E": E})


@dataclass(frozen=True)
class _Surface:
    """The positions of one energy in a box, of all members."""

    mechanics: Mechanics
    E: float
    bounds: tuple[Array, Array]
    seed: int
    what: str
    scale: dict[str, float] = field(default_factory=dict)

    def part(self, rows: Rows) -> LevelSet:
        """Return the manifolds of some members, and the density on them."""
        reachable = Reachable(self.mechanics.some(rows), self.E, self.bounds)
        return EnergyCurve(reachable, self.scale["w"]) if self.scale else reachable

    def first(self) -> Array:
        """Return where the walks begin."""
        q = self._position()
        if self.mechanics.k > 1:
            return q
        flat = Reachable(self.mechanics, self.E, self.bounds, flat=True)
        cloud, rows = explored(lambda rows: replace(flat, mechanics=flat.mechanics.some(rows)), q, [self.seed, 1], self.what)
        # With this rate the curve is about as wide in u as in the positions, so that steps of one length suit both.
        fastest = float(np.max(self.E - self.mechanics.U(cloud, rows)))
        self.scale["w"] = float(np.sqrt(max(fastest, 0.0) / np.sum(np.var(cloud, axis=1))))
        return np.concatenate([q, [np.sqrt(2 * np.maximum(self.E - self.mechanics.U(q), 0.0)) / self.scale["w"]]])

    def _position(self) -> Array:
        """Return a position of each member with no more potential energy than E."""
        mechanics, manifold = self.mechanics, Positions(self.mechanics)
        # The box comes first: by energy every place outside of it is equally bad, and a search there would have no direction.
        q, _, lost = searched(manifold, mechanics.members.start[1].T, lambda q, rows: excess(q, self.bounds), [self.seed, 3])
        if np.any(lost):
            raise BadInput(
                f"no position of {self.what} was found: {np.sum(lost)} of {q.shape[1]} searches ended outside; give a larger box.",
                "energy-box-empty",
            )

        def above(q: Array, rows: Rows) -> Array:
            return np.where(excess(q, self.bounds) > 0, np.inf, mechanics.U(q, rows) - self.E)

        q, least, lost = searched(manifold, q, above, [self.seed, 4])
        if np.any(lost):
            raise BadInput(
                f"no start of {self.what} was found: the least potential energy that {np.sum(lost)} of {q.shape[1]} searches came to is "
                f"{self.E + np.max(least[lost]):.6g}; give a larger E.",
                "energy-too-low",
            )
        return q

    def with_momenta(self, q: Array) -> Any:
        """Return members at these positions with momenta of the energy."""
        noise = np.random.default_rng([self.seed, 5]).standard_normal(q.shape)
        p = self.mechanics.with_energy(q.T, self.E - self.mechanics.U(q.T), noise.T)
        return replace(self.mechanics.members, start=(np.ascontiguousarray(p.T), q))

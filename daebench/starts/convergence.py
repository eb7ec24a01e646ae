"""How long a random walk goes on: until its distribution has stopped changing, and chains have forgotten where they were."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from daebench.errors import BadInput
from daebench.runs.ivp import Array
from daebench.starts.mechanics import Rows
from daebench.starts.walk import Chains, LevelSet, begun, step
from daebench.systems.lazily import scipy

PILOTS = 1024
"""Chains that decide on the length of steps and on their number, two of each of so many members; others repeat what these have settled."""

ADAPTED = 60
"""Steps in which the length is adapted, before it is fixed."""

WANTED = 0.6
"""Part of the proposals that is to be accepted, of those that would be if steps had no length."""

RATE, CALMER = 2.0, 0.97
"""How much the logarithm of the length changes with what is accepted, and by which factor that falls from step to step."""

LEAST = 1e-8
"""Length of steps, relative to the largest coordinate, below which there is nothing to walk on."""

FIRST, LAST = 64, 2048
"""Steps after which the distribution is first looked at, and after which it is given up; each look is after twice as many."""

FORGOTTEN = 5.0
"""Largest correlation of chains with what they were at half of the steps, less that with what the other chains of their members were, in
standard deviations of the correlation of independent ones."""

SAME = 1e-3
"""Probability of a difference as large as that of the distributions at half and at all of the steps, by chance, below which they differ."""


@dataclass(frozen=True)
class Settled:
    """Chains at the end of a walk, and what was measured on the way."""

    x: Array
    """Points; shape (l, n)."""
    drawn: Array
    """What was drawn with each; shape (e, n)."""
    steps: int
    """Steps of the walk, those among them in which the length was adapted."""
    sigma: float
    """Length of the steps in the end."""
    accepted: float
    """Part of the proposals accepted after that."""
    p_value: float
    """Of the two-sample Kolmogorov-Smirnov test of the distributions at half and at all of the steps: the least over all coordinates, times
    their number.
    """

    @property
    def measured(self) -> dict[str, float]:
        """Measurements, by name."""
        return {"steps": self.steps, "sigma": self.sigma, "accepted": self.accepted, "p_value": self.p_value}

    @property
    def in_words(self) -> str:
        """Measurements, as part of a sentence."""
        return (
            f"drawn by {self.steps} steps of a random walk of length {self.sigma:.3g}, {100 * self.accepted:.0f} % of them accepted; "
            f"the Kolmogorov-Smirnov test of the states at half of the steps and at all has p = {self.p_value:.2g}"
        )


def walked(manifold: LevelSet, chains: Chains, lengths: Sequence[float], key: Sequence[int], first: int = 0) -> Chains:
    """Return chains after steps of these lengths, numbered from ``first``, whose random numbers are seeded by the key and their number."""
    for k, sigma in enumerate(lengths):
        chains = step(manifold, chains, sigma, np.random.default_rng([*key, first + k]))
    return chains


def settled(make: Callable[[Rows], LevelSet], x: Array, key: Sequence[int], what: str) -> Settled:
    """Return one point of each chain, from a walk that goes on until its distribution has settled.

    The first members decide, with two chains each, :data:`PILOTS` in all, and others do as they do: what becomes of a chain does not depend
    on how many there are, unless members differ in their parameters and there are fewer. Fewer members are repeated up to that number.

    Shapes: x (l, n).
    """
    n = x.shape[1]
    numbers = _pilot_members(n)
    with np.errstate(all="ignore"):
        pilots = _Pilots(make(numbers), x[:, numbers], [*key, 0])
        p_value = pilots.settle(what)
        parts = [pilots.chains]
        if n > PILOTS // 2:
            others = np.arange(PILOTS // 2, n)
            manifold = make(others)
            start = begun(manifold, x[:, others], _noise(manifold, len(others), [*key, 1]))
            parts.append(walked(manifold, start, pilots.lengths, [*key, 1]))
    points, drawn = (_of_members([getattr(part, name) for part in parts])[:, :n] for name in ("x", "drawn"))
    return Settled(points, drawn, len(pilots.lengths), pilots.lengths[-1], pilots.accepted, p_value)


def _pilot_members(n: int) -> Rows:
    """Return the members of the pilots, of n: half of them, and the same again."""
    return np.tile(np.arange(PILOTS // 2) % n, 2)


def _of_members(parts: Sequence[Array]) -> Array:
    """Return the numbers of the pilots, of their first half, and of others."""
    return np.concatenate([parts[0][:, : PILOTS // 2], *parts[1:]], axis=1)


def _noise(manifold: LevelSet, n: int, key: Sequence[int]) -> Array:
    return np.random.default_rng([*key, LAST + ADAPTED]).standard_normal((n, manifold.noise)).T


def explored(make: Callable[[Rows], LevelSet], x: Array, key: Sequence[int], what: str) -> tuple[Array, Rows]:
    """Return points that a short walk comes to, a column for each of :data:`PILOTS` chains, and the numbers of these."""
    numbers = _pilot_members(x.shape[1])
    with np.errstate(all="ignore"):
        pilots = _Pilots(make(numbers), x[:, numbers], key)
        pilots.adapt(what)
    return pilots.chains.x, numbers


class _Pilots:
    """The chains that decide."""

    def __init__(self, manifold: LevelSet, x: Array, key: Sequence[int]) -> None:
        self.manifold, self.key = manifold, key
        self.chains = begun(manifold, x, _noise(manifold, x.shape[1], key))
        self.lengths: list[float] = []
        self.sigma = self.accepted = 0.0

    def settle(self, what: str) -> float:
        """Walk on until the distribution has settled, and return the probability of its last change by chance."""
        self.adapt(what)
        looks: list[Array] = []
        for steps in _doubled(FIRST, LAST):
            self._walk(steps)
            looks = [*looks[-2:], np.concatenate([self.chains.x, self.chains.drawn])]
            if len(looks) == 3 and _forgotten(looks[0], looks[1]) and _forgotten(looks[1], looks[2]):
                # The test wants independent samples, so that the first chain of each member then is compared with its second one now.
                p_value = same_distribution(looks[1][:, : PILOTS // 2], looks[2][:, PILOTS // 2 :])
                if p_value >= SAME:
                    return p_value
        raise BadInput(
            f"{what} cannot be drawn: after {len(self.lengths)} steps of a random walk its distribution still changes; "
            "if a coordinate can go to infinity, bound it; else give a smaller box.",
            "draws-did-not-settle",
        )

    def adapt(self, what: str) -> None:
        """Walk with steps whose length is adapted, and keep the last one."""
        size = float(np.max(np.abs(self.chains.x))) or 1.0
        sigma, rate = size, RATE
        for _ in range(ADAPTED):
            possible = self._accepted_at_rest()
            self._step(sigma)
            sigma *= float(np.exp(rate * (np.mean(self.chains.moved) - WANTED * possible)))
            rate *= CALMER
        if sigma < LEAST * size:
            raise BadInput(
                f"{what} cannot be drawn: steps of {sigma:.1e} are still too long for it; it is the energy of an equilibrium, or a box "
                "without extent. Give a larger E or box.",
                "draw-steps-too-long",
            )
        self.sigma = sigma

    def _accepted_at_rest(self) -> float:
        """Return the part of proposals that would be accepted if steps had no length: 1, unless something is drawn with each point."""
        if not self.manifold.noise:
            return 1.0
        x, C, numbers = self.chains.x, self.chains.C, np.arange(self.chains.x.shape[1])
        noise = _noise(self.manifold, len(numbers), [*self.key, len(self.lengths)])
        weight, _ = self.manifold.weighed(x, C, noise, numbers)
        return float(np.mean(np.exp(np.minimum(np.nan_to_num(weight - self.chains.weight, nan=0.0), 0.0))))

    def _step(self, sigma: float) -> None:
        self.chains = walked(self.manifold, self.chains, [sigma], self.key, len(self.lengths))
        self.lengths.append(sigma)

    def _walk(self, steps: int) -> None:
        """Walk on with the length that is fixed, until there are so many steps besides those of adaptation."""
        accepted = []
        for _ in range(steps + ADAPTED - len(self.lengths)):
            self._step(self.sigma)
            accepted.append(float(np.mean(self.chains.moved)))
        self.accepted = float(np.mean(accepted))


def _doubled(first: int, last: int) -> list[int]:
    numbers = [first // 4]
    while numbers[-1] < last:
        numbers.append(2 * numbers[-1])
    return numbers


def _forgotten(before: Array, after: Array) -> bool:
    """Return whether coordinates, and their squares, are no more correlated with what they were than with the member's other chain.

    Coordinates that never change are left out.
    """
    limit = FORGOTTEN / np.sqrt(before.shape[1])
    # Where members differ in their parameters their chains stay correlated for ever; the member's other chain tells by how much.
    other = np.roll(after, before.shape[1] // 2, axis=1)
    for a, b, c in zip(before, after, other, strict=True):
        if not _varies(a, b):
            continue
        for x, y, z in ((a, b, c), ((a - np.mean(a)) ** 2, (b - np.mean(b)) ** 2, (c - np.mean(c)) ** 2)):
            if not abs(float(np.corrcoef(x, y)[0, 1] - np.corrcoef(x, z)[0, 1])) < limit:
                return False
    return True


def _varies(a: Array, b: Array) -> bool:
    both = np.concatenate([a, b])
    return bool(np.ptp(both) > 1e-9 * np.max(np.abs(both)))


def same_distribution(a: Array, b: Array) -> float:
    """Return the probability that samples, in columns, differ as much as these do by chance, by the coordinate that differs most.

    It is the least p-value of the two-sample Kolmogorov-Smirnov tests of all coordinates, times their number, at most 1; coordinates that
    never change are left out.
    """
    compare: Any = scipy.stats.ks_2samp
    values = [float(compare(x, y).pvalue) for x, y in zip(a, b, strict=True) if _varies(x, y)]
    return min([1.0, *(len(values) * value for value in values)])

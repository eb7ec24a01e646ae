"""Families of constraints that meet in a known way at a start, with lengths, masses and mixtures drawn over many sizes."""

import itertools
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import numpy as np
import sympy as sp

from daebench.compiler.definition import source_of
from daebench.runs.make_ivp import make_ivp
from daebench.systems.constrained import Case, ConstrainedHamiltonian, coordinates


@dataclass(frozen=True)
class Family:
    """Combinations A f(q, b) of constraints f on d positions, with ``more`` of them than f has, and the kind that is right."""

    kind: str
    d: int
    f: Callable
    draw: Callable
    """Lengths b and positions, of size one, of a generator of random numbers."""
    more: int = 0
    block: int = 1
    """Number of positions that share a mass."""
    sized: bool = True
    """Whether positions are lengths."""
    H: Callable | None = None
    """Energy of (q, p, masses) where it is not that of point masses."""

    def problems(self, count: int, random: np.random.Generator) -> Iterator:
        """Yield problems with lengths and masses of sizes from 1e-6 to 1e6, masses that differ by up to a thousand, and mixtures."""
        (q, p), count_of_b = coordinates(self.d), len(self.draw(random)[0])
        b, mu = sp.symbols(f"b1:{count_of_b + 1}", real=True), sp.symbols(f"mass1:{self.d // self.block + 1}", positive=True)
        f = self.f(q, b)
        n = len(f)
        A = sp.Matrix(n + self.more, n, lambda i, j: sp.Symbol(f"a{i}_{j}", real=True))
        masses = [x for x in mu for _ in range(self.block)]
        energy = {"M": sp.diag(*masses), "U": sp.S.Zero} if self.H is None else {"H": self.H(q, p, mu)}
        names, case = [*b, *mu, *A], Case(q=(0,) * self.d, p=(0,) * self.d)
        definition = ConstrainedHamiltonian(
            q=q, p=p, g=list(A * sp.Matrix(f)), parameters=dict.fromkeys(names, 1.0), cases={"a": case}, **energy
        )
        source = source_of(definition, "drawn")
        for _ in range(count):
            size, mass = 10.0 ** random.uniform(-6, 6, size=2)
            lengths, place = (np.asarray(x, dtype=float) for x in self.draw(random))
            heavy = mass * 10.0 ** random.uniform(-1.5, 1.5, size=len(mu))
            mixture = np.vstack([np.eye(n) + 0.3 * random.normal(size=(n, n)) / n**0.5, random.normal(size=(self.more, n))])
            values = dict(zip(map(str, names), [*size * lengths, *heavy, *mixture.ravel()], strict=True))
            yield make_ivp(source, "a", values, q0=size * place if self.sized else place, p0=np.ones(self.d) * (self.H is not None))


def points(q, dim):
    return [sp.Matrix(q[dim * k : dim * (k + 1)]) for k in range(len(q) // dim)]


def pairs(n):
    return list(itertools.combinations(range(n), 2))


def distances(dim, of):
    def f(q, b):
        X = points(q, dim)
        return [(X[i] - X[j]).dot(X[i] - X[j]) - length**2 for (i, j), length in zip(of, b, strict=True)]

    return f


def placed(x, random):
    """Points that are turned and moved."""
    return x @ np.linalg.qr(random.normal(size=(x.shape[1],) * 2))[0] + random.normal(size=x.shape[1])


def points_at(kind, shape, n, dim, of=None, more=0, factor=None):
    """Points in a shape that a random generator gives, with their distances, some of them multiplied by factors."""
    of = of or pairs(n)

    def draw(random):
        x = placed(shape(random), random)
        lengths = np.array([np.linalg.norm(x[i] - x[j]) for i, j in of])
        return (lengths if factor is None else factor(lengths, random)), x.ravel()

    return Family(kind, dim * n, distances(dim, of), draw, more, block=dim)


def scattered(n, dim):
    return lambda random: random.normal(size=(n, dim))


def in_line(n, dim, bent=0.0):
    def shape(random):
        x = np.zeros((n, dim))
        x[:, 0] = np.cumsum(random.uniform(0.4, 1.5, size=n))
        x[1, 1] = bent
        return x

    return shape


def four_bar(kind, flat=0.0, across=0.0, more=0, angles=False, fold=1):
    """Four bars, crank and rod in a line but for an angle; the third bar back in it (fold 1), further on (-1), or across."""

    def f(q, b):
        l1, l2, l3, x, y = b
        if angles:
            ends = [(length * sp.cos(a), length * sp.sin(a)) for length, a in zip((l1, l2, -l3), q, strict=True)]
            return [sum(x for x, _ in ends) - x, sum(y for _, y in ends) - y]
        x1, y1, x2, y2 = q
        return [x1**2 + y1**2 - l1**2, (x2 - x1) ** 2 + (y2 - y1) ** 2 - l2**2, (x2 - x) ** 2 + (y2 - y) ** 2 - l3**2]

    def draw(random):
        l1, l2 = random.uniform(0.5, 1.5, size=2)
        first = l1 * np.array([np.cos(flat), np.sin(flat)])
        second = first + np.array([l2, 0])
        third = np.array([second[0] - fold * random.uniform(0.3, 0.8) * l2, -across])
        bar = second - third
        place = [*first, *second] if not angles else [flat, 0.0, np.arctan2(bar[1], bar[0])]
        return [l1, l2, np.hypot(*bar), *third], place

    return Family(kind, 3 if angles else 4, f, draw, more, sized=not angles)


def parallelogram(kind, flat, spare=0):
    def f(q, b):
        x1, y1, x2, y2 = q
        l1, x = b
        g = [x1**2 + y1**2 - l1**2, (x2 - x) ** 2 + y2**2 - l1**2, (x2 - x1) ** 2 + (y2 - y1) ** 2 - x**2]
        return g + [((x1 + x2 - x) / 2) ** 2 + ((y1 + y2) / 2) ** 2 - l1**2] * spare

    def draw(random):
        l1, x = random.uniform(0.5, 1.5, size=2)
        angle = 0.0 if flat else random.uniform(0.3, 1.2)
        end = l1 * np.array([np.cos(angle), np.sin(angle)])
        return [l1, x], [*end, end[0] + x, end[1]]

    return Family(kind, 4, f, draw)


def germ(kind, *powers, more=0):
    """A plane w = 0 and surfaces w + f(x, y) = 0 through a point, z free."""

    def f(q, b):
        w, x, y, _ = (each / b[0] - 1 for each in q)
        return [b[0] * w, *(b[0] * (w + power(x, y)) for power in powers)]

    def draw(random):
        b = random.uniform(0.5, 2)
        return [b], [b] * 4

    return Family(kind, 4, f, draw, more)


def moved(kind, f, place, lengths=2, d=3):
    """Constraints f at a place that lengths b give, the last coordinate free."""

    def draw(random):
        b = random.uniform(0.5, 2, size=lengths)
        return b, [*place(b), random.normal()]

    return Family(kind, d, f, draw)


def quaternions(kind, bodies, gauged):
    """Free bodies by quaternions, each with or without a gauge term in its energy."""

    def H(q, p, mu):
        total = sp.S.Zero
        for k, gauge in zip(range(bodies), gauged, strict=True):
            (a, b, c, d), P = q[4 * k : 4 * k + 4], sp.Matrix(p[4 * k : 4 * k + 4])
            L = sp.Matrix([[-b, a, d, -c], [-c, -d, a, b], [-d, c, -b, a]]) * P / 2
            moments = mu[4 * k : 4 * k + 4]
            total += sum(x**2 / (2 * moment) for x, moment in zip(L, moments, strict=False))
            total += gauge * sp.Matrix([a, b, c, d]).dot(P) ** 2 / (8 * moments[3])
        return total

    def f(q, b):
        return [sum(x**2 for x in q[4 * k : 4 * k + 4]) - 1 for k in range(bodies)]

    def draw(random):
        parts = random.normal(size=(bodies, 4))
        return [], (parts / np.linalg.norm(parts, axis=1)[:, None]).ravel()

    return Family(kind, 4 * bodies, f, draw, sized=False, H=H)


def longest(lengths, random):
    """The longest side longer than the others together."""
    k = int(np.argmax(lengths))
    lengths[k] = (np.sum(lengths) - lengths[k]) * (1 + 10.0 ** random.uniform(-4, 0))
    return lengths


def each_apart(lengths, random):
    """Each length by a factor of its own."""
    return lengths * random.uniform(0.7, 1.3, size=len(lengths))


def methane(angle):
    """A centre and four points with all distances; all angles are multiplied by a factor."""

    def shape(random):
        return np.array([(0, 0, 0), (1, 1, 1), (1, -1, -1), (-1, 1, -1), (-1, -1, 1)]) * random.uniform(0.5, 2)

    def factor(lengths, random):
        return np.where(np.arange(10) < 4, lengths, lengths * angle(random))

    return points_at("", shape, 5, 3, factor=factor)


def narrow(random):
    """A factor of the distances between the outer points, up or down by 1e-4 to 0.3."""
    return 1 + random.choice([-1, 1]) * 10.0 ** random.uniform(-4, -0.5)


SQUARE = [(0, 1), (1, 2), (2, 3), (0, 3)]

MEETINGS = {
    "all distances of 5 points in the plane": points_at("redundant", scattered(5, 2), 5, 2),
    "all distances of 5 points in space": points_at("redundant", scattered(5, 3), 5, 3),
    "a tetrahedron and 1 mixture": points_at("redundant", scattered(4, 3), 4, 3, more=1),
    "a triangle and 3 mixtures": points_at("redundant", scattered(3, 3), 3, 3, more=3),
    "a parallelogram with its middle bar": parallelogram("redundant", flat=False, spare=1),
    "a four-bar and 2 mixtures": four_bar("redundant", across=0.7, more=2),
    "a four-bar by angles and 1 mixture": four_bar("redundant", across=0.7, more=1, angles=True),
    "3 points in a line in the plane": points_at("tangential", in_line(3, 2), 3, 2),
    "3 points in a line in space": points_at("tangential", in_line(3, 3), 3, 3),
    "4 points in a line in space": points_at("tangential", in_line(4, 3), 4, 3),
    "3 points in a line and 1 mixture": points_at("tangential", in_line(3, 3), 3, 3, more=1),
    "two cylinders that touch": moved(
        "tangential",
        lambda q, b: [q[0] ** 2 + q[1] ** 2 - b[0] ** 2, (q[0] - b[0] - b[1]) ** 2 + q[1] ** 2 - b[1] ** 2],
        lambda b: (b[0], 0),
    ),
    "a squared equation": moved(
        "tangential", lambda q, b: [(q[0] ** 2 + q[1] ** 2 - b[0] ** 2) ** 2 / b[0] ** 2], lambda b: (b[0] * 0.6, b[0] * 0.8), 1
    ),
    "a flat parallelogram": parallelogram("change point", flat=True),
    "a flat parallelogram with its middle bar": parallelogram("tangential", flat=True, spare=1),
    "a flat four-bar": four_bar("change point"),
    "a flat four-bar by angles": four_bar("change point", angles=True),
    "a flat four-bar and 1 mixture": four_bar("change point", more=1),
    "a stretched four-bar": four_bar("tangential", fold=-1),
    "a stretched four-bar by angles": four_bar("tangential", fold=-1, angles=True),
    "two surfaces that cross": germ("change point", lambda x, y: x * y + x**3),
    "a cubic": germ("undetermined", lambda x, y: x**3),
    "a cubic and 1 mixture": germ("undetermined", lambda x, y: x**3 + y**3, more=1),
    "a square and a fourth power": germ("undetermined", lambda x, y: y**2 + x**4),
    "a square and a cubic": germ("undetermined", lambda x, y: y**2, lambda x, y: x**3),
    "a complex square": germ("undetermined", lambda x, y: x**2 - y**2, lambda x, y: x * y),
    "one quaternion": quaternions("gauge", 1, (0,)),
    "two quaternions": quaternions("gauge", 2, (0, 0)),
    "two quaternions, the second with its term": quaternions("gauge", 2, (0, 1)),
    "one quaternion with its term": quaternions("independent", 1, (1,)),
    "two quaternions with their terms": quaternions("independent", 2, (1, 1)),
    "a tetrahedron": points_at("independent", scattered(4, 3), 4, 3),
    "a ring of four bonds": points_at("independent", scattered(4, 3), 4, 3, SQUARE),
    "a line of bonds": points_at("independent", in_line(4, 3), 4, 3, SQUARE[:3]),
    "a line that is bent by 1e-3": points_at("independent", in_line(3, 3, 1e-3), 3, 3),
    "a four-bar at a dead centre": four_bar("independent", across=0.7),
    "a four-bar at a dead centre by angles": four_bar("independent", across=0.7, angles=True),
    "a four-bar near a change point": four_bar("independent", flat=1e-3),
}
"""Families at whose starts all constraints hold."""

BROKEN = {
    "a triangle against its inequality": points_at("contradictory", scattered(3, 2), 3, 2, factor=longest),
    "a triangle in space against its inequality": points_at("contradictory", scattered(3, 3), 3, 3, factor=longest),
    "four bars of which one is too long": points_at("contradictory", scattered(4, 2), 4, 2, SQUARE, factor=longest),
    "methane with other angles": replace(methane(narrow), kind="contradictory"),
    "a five-cell in space": points_at("contradictory", scattered(5, 3), 5, 3, factor=lambda lengths, _: np.ones_like(lengths)),
    "six distances of four points in the plane": points_at("contradictory", scattered(4, 2), 4, 2, factor=each_apart),
    "two spheres apart": moved(
        "contradictory",
        lambda q, b: [q[0] ** 2 + q[1] ** 2 + q[2] ** 2 - b[0] ** 2, (q[0] - b[0] - b[1] - b[2]) ** 2 + q[1] ** 2 + q[2] ** 2 - b[1] ** 2],
        lambda b: (b[0], 0),
        3,
    ),
}
"""Families that no positions obey."""

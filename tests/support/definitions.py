"""Problems that only the tests need: the planar pendulum in stretched coordinates, given in two ways, and others of every kind."""

from functools import cache

import sympy as sp

from daebench.systems.constrained import Case, ConstrainedHamiltonian, coordinates
from daebench.systems.kinetic_flows import product, rotation, sphere

BEND = sp.Rational(1, 5)


def place(x1, x2):
    """Cartesian position of the point at the stretched coordinates (x1, x2)."""
    return x1 + BEND * x2**2, x2 + BEND * sp.sin(x1)


def _start():
    """Stretched coordinates of the lowest point (0, -1), to 40 digits, and the momentum of velocity (1, 0) there."""
    x = sp.symbols("x1:3", real=True)
    root = sp.nsolve([place(*x)[0], place(*x)[1] + 1], x, (-0.2, -0.9), prec=40)
    jacobian = sp.Matrix(place(*x)).jacobian(x).subs(dict(zip(x, root, strict=True)))
    return list(root), list(jacobian.T * sp.Matrix([1, 0]))


@cache
def stretched(*, given_as="M"):
    """Planar pendulum through its lowest point with velocity (1, 0), in coordinates in which M is full and depends on q."""
    q, p = coordinates(2)
    gamma = sp.Symbol("gravity", positive=True)
    y = sp.Matrix(place(*q))
    jacobian = y.jacobian(sp.Matrix(q))
    M, U = (jacobian.T * jacobian).applyfunc(sp.expand), gamma * y[1]
    x0, p0 = _start()
    rest = {
        "q": q,
        "p": p,
        "g": [sp.expand(y[0] ** 2 + y[1] ** 2 - 1)],
        "parameters": {gamma: 1.0},
        "cases": {"swing": Case(q=x0, p=p0)},
    }
    if given_as == "M":
        return ConstrainedHamiltonian(M=M, U=U, **rest)
    column = sp.Matrix(p)
    return ConstrainedHamiltonian(H=(column.T * M.inv() * column)[0] / 2 + U, **rest)


@cache
def relativistic():
    """Two particles of unit mass tied together in the plane, moving fast: H is separable but not quadratic in p."""
    q, p = coordinates(4)
    H = sp.sqrt(1 + p[0] ** 2 + p[1] ** 2) + sp.sqrt(4 + p[2] ** 2 + p[3] ** 2) + q[1] / 2 + q[2] ** 2 / 3
    g = (q[0] - q[2]) ** 2 + (q[1] - q[3]) ** 2 - 1
    start = {"q": (0, 0, 1, 0), "p": (sp.Rational(1, 2), -1, 1, 2)}
    return ConstrainedHamiltonian(q=q, p=p, H=H, g=[g], cases={"tied": Case(**start)})


@cache
def double_pendulum():
    """Two unit masses on unit rods in the plane: two constraints, so that pivoting and structural zeros are met."""
    q, p = coordinates(4)
    g = [q[0] ** 2 + q[1] ** 2 - 1, (q[2] - q[0]) ** 2 + (q[3] - q[1]) ** 2 - 1]
    M = sp.diag(1, 1, 2, 2)
    cases = {
        "horizontal": Case(q=(1, 0, 2, 0), p=(0, sp.Rational(1, 2), 0, 1)),
        "bent": Case(q=(0, -1, 1, -1), p=(1, 0, 2, sp.Rational(3, 2))),
    }
    return ConstrainedHamiltonian(q=q, p=p, M=M, U=q[1] + 2 * q[3], g=g, cases=cases)


@cache
def coupled():
    """Two unit rods in the plane, the second with a mass matrix that is constant but not diagonal."""
    q, p = coordinates(4)
    g = [q[0] ** 2 + q[1] ** 2 - 1, (q[2] - q[0]) ** 2 + (q[3] - q[1]) ** 2 - 1]
    third, sixth = sp.Rational(1, 3), sp.Rational(1, 6)
    rod = sp.Matrix([[third, sixth], [sixth, third]])
    M = sp.kronecker_product(rod + sp.diag(third, 0), sp.eye(2))
    cases = {"bent": Case(q=(0, -1, 1, -1), p=(sp.Rational(5, 6), 0, sp.Rational(1, 2), 0))}
    return ConstrainedHamiltonian(q=q, p=p, M=M, U=q[1] + q[3] / 2, g=g, cases=cases)


@cache
def two_spheres():
    """Points on two spheres about one centre, of different mass and radius, under gravity and tied by a spring."""
    q, p = coordinates(6)
    stiffness, gamma = sp.Symbol("stiffness", real=True), sp.Symbol("gravity", real=True)
    x, y = q[:3], q[3:]
    spring = stiffness * sum((a - b) ** 2 for a, b in zip(x, y, strict=True)) / 2
    half, third = sp.Rational(1, 2), sp.Rational(1, 3)
    return ConstrainedHamiltonian(
        q=q,
        p=p,
        M=sp.diag(1, 1, 1, half, half, half),
        U=spring + gamma * (x[2] + y[2] / 2),
        g=[sum(a**2 for a in x) - 1, sum(a**2 for a in y) - 4],
        parameters={stiffness: 2.0, gamma: 1.0},
        cases={"apart": Case(q=(1, 0, 0, 0, 2 * third, -4 * third * sp.sqrt(2)), p=(0, 1, half, third, 0, 0))},
        integrals={"L3": sum(a[0] * b[1] - a[1] * b[0] for a, b in ((x, p[:3]), (y, p[3:])))},
        kinetic_flow=product(sphere(x, p[:3], mass=1, length=1), sphere(y, p[3:], mass=half, length=2)),
    )


@cache
def rotation_matrix():
    """Rigid body with a fixed point and three equal moments of inertia, HLW VII.5 with D = c I, its centre of mass off that point."""
    q, p = coordinates(9)
    c, gamma = sp.Symbol("c", positive=True), sp.Symbol("gravity", real=True)
    Q, P = sp.Matrix(3, 3, q), sp.Matrix(3, 3, p)
    b = sp.Matrix([sp.Rational(3, 5), 0, sp.Rational(4, 5)])
    orthogonal = Q.T * Q - sp.eye(3)
    Q0 = sp.Matrix([[1, 2, 2], [2, 1, -2], [-2, 2, -1]]) / 3
    W0 = sp.Matrix([[0, -1, 2], [1, 0, -sp.Rational(1, 2)], [-2, sp.Rational(1, 2), 0]])
    return ConstrainedHamiltonian(
        q=q,
        p=p,
        M=c * sp.eye(9),
        U=gamma * (Q * b)[2],
        g=[orthogonal[i, j] for i in range(3) for j in range(i, 3)],
        parameters={c: 0.75, gamma: 1.0},
        cases={"tumbling": Case(q=tuple(Q0), p=tuple(c * Q0 * W0))},
        integrals={
            "L3": (P * Q.T - Q * P.T)[1, 0],
            "along_b": sum(b.dot(Q.row(i).T.cross(P.row(i).T)) for i in range(3)),
        },
        kinetic_flow=rotation(q, p, c=c),
    )


def bowed(d):
    """A bead on the curve x y = d: it passes the crossing of the axes at the distance sqrt(2 d), and for d = 0 loses the rank of G."""
    q, p = coordinates(2)
    delta = sp.Symbol("delta", real=True)
    start = {"q": (-1, -delta), "p": (1, -delta)}
    return ConstrainedHamiltonian(
        q=q, p=p, M=sp.eye(2), U=sp.Integer(0), g=[q[0] * q[1] - delta], parameters={delta: d}, cases={"in": Case(**start)}
    )


@cache
def parallelogram(*, spare=True, on_singular="least-squares"):
    """A uniform bar on three parallel unit links, one in the middle, pivots 1 apart: one is redundant where they are parallel.

    Positions are the ends of the bar. With the spare link there are as many constraints as positions, and G has rank 3.
    """
    q, p = coordinates(4)
    mass, gamma = sp.symbols("mass gravity", positive=True)
    ends, pivots = [sp.Matrix(q[:2]), sp.Matrix(q[2:])], [sp.Matrix([k, 0]) for k in range(3)]
    links = [ends[0] - pivots[0], ends[1] - pivots[2], (ends[0] + ends[1]) / 2 - pivots[1]]
    along = ends[1] - ends[0]
    M = mass / 6 * sp.kronecker_product(sp.Matrix([[2, 1], [1, 2]]), sp.eye(2))
    down = [0, -1, 2, -1]
    return ConstrainedHamiltonian(
        q=q,
        p=p,
        M=M,
        U=mass * gamma * (q[1] + q[3]) / 2,
        g=[along.dot(along) - 4, *(link.dot(link) - 1 for link in links[: 2 + spare])],
        parameters={mass: 2.0, gamma: 9.81},
        cases={"thrown": Case(q=down, p=M * sp.Matrix([2, 0, 2, 0]), on_singular=on_singular if spare else "stop")},
    )

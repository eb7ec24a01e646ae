"""Problems that only the tests need: the planar pendulum in stretched coordinates, given in two ways, and others of every kind."""

from functools import cache

import sympy as sp

from daebench.problem import Case, ConstrainedHamiltonian, coordinates

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

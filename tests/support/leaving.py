"""Problems whose motion ends in finite time: H has no value beyond, while the forces have one, or a singularity is gone over."""

from functools import cache

import sympy as sp

from daebench.compiler.definition import source_of
from daebench.runs.make_ivp import make_ivp
from daebench.systems.constrained import Case, ConstrainedHamiltonian, coordinates
from daebench.systems.poisson import PoissonCase, PoissonSystem

ENDS = ("log", "atanh", "log_of_place", "mass", "momentum")
"""Names of the constrained ones: the first is the particle that falls along a circle into the line q1 = 0."""


@cache
def ending(name):
    """Return one of them as an initial value problem that starts at rest, or nearly so."""
    q, p = coordinates(2)
    circle, start = [q[0] ** 2 + q[1] ** 2 - 1], Case(q=(sp.Rational(3, 5), sp.Rational(4, 5)), p=(0, 0))
    mass = {"q": q, "p": p, "g": circle, "M": sp.eye(2)}
    definitions = {
        "log": {**mass, "U": sp.log(q[0])},
        "atanh": {**mass, "U": -sp.atanh(sp.Rational(5, 4) * q[0])},
        "log_of_place": {**mass, "U": sp.log(q[0] - sp.Rational(1, 4)) + q[1] / 3},
        "mass": {**mass, "M": sp.diag(2 + sp.sin(q[0]), 1), "U": 2 * sp.log(q[0])},
        "momentum": {"q": q, "p": p, "g": circle, "H": (p[0] ** 2 + p[1] ** 2) / 2 + p[0] * p[1] / 9 + sp.log(q[0])},
    }
    return make_ivp(source_of(ConstrainedHamiltonian(**definitions[name], cases={"fall": start}), name), "fall")


SINGULAR = ("kink", "cusp", "pole", "collision", "passing", "mass")
"""Names of those with a singularity at which equations end, and steps may go on."""


@cache
def singular(name):
    """Return one of them as a problem: a kink or cusp of g, a pole of U, a collision, a weak one in passing, or a mass that vanishes."""
    (x, y), plane = sp.symbols("x y"), sp.symbols("u v")
    (q, p), (r, s), third = coordinates(2), coordinates(3), sp.Rational(1, 3)
    flat = {"q": r, "p": s, "g": [r[2]], "M": sp.eye(3)}
    circle = {"q": q, "p": p, "g": [q[0] ** 2 + q[1] ** 2 - 1], "M": sp.eye(2)}
    distance, at = sp.sqrt(r[0] ** 2 + r[1] ** 2), (sp.Rational(3, 5), sp.Rational(4, 5))
    curve = {"q": (x, y), "p": plane, "M": sp.eye(2), "U": 0 * x}
    definitions = {
        "kink": (curve | {"g": [y - sp.sqrt(x**2)]}, ((-1, 1), (1, -1))),
        "cusp": (curve | {"g": [y - (x**2) ** third]}, ((-1, 1), (1, -2 * third))),
        "pole": (circle | {"U": -1 / q[0]}, (at, (0, 0))),
        "collision": (flat | {"U": -1 / distance}, ((1, 0, 0), (0, 0, 0))),
        "passing": (flat | {"U": -1 / (10**4 * distance)}, ((-1, 0, 0), (1, 0, 0))),
        "mass": (circle | {"M": sp.diag(q[0], 1), "U": 0 * q[0]}, (at, (-at[1] * at[0], at[0]))),
    }
    parts, (place, momentum) = definitions[name]
    problem = ConstrainedHamiltonian(**parts, cases={"towards": Case(q=place, p=momentum)})
    return make_ivp(source_of(problem, name), "towards")


@cache
def ending_poisson():
    """Return the free fall q' = p, p' = -1/q into the line q = 0, without a word on its domain."""
    y = sp.symbols("y1:3", real=True)
    system = PoissonSystem(
        y=y, B=sp.Matrix([[0, 1], [-1, 0]]), H=y[1] ** 2 / 2 + sp.log(y[0]), cases={"fall": PoissonCase(y=(1, sp.Rational(-1, 3)))}
    )
    return make_ivp(source_of(system, "fall"), "fall")

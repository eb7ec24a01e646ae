"""Symbols that are assumed to be more than real are refused, wherever they stand; no force is simplified by what a run need not keep."""

import pytest
import sympy as sp
from own_files import ORBIT
from refusals import refused

from daebench.compiler.definition import source_of
from daebench.errors import InvalidProblem
from daebench.runs.make_ivp import make_ivp
from daebench.systems.chain import ConstrainedChain
from daebench.systems.constrained import Case, Chart, ConstrainedHamiltonian, KineticFlow
from daebench.systems.lattice import PoissonLattice
from daebench.systems.poisson import DarbouxMap, Part, PoissonCase, PoissonSystem

FALSE = ("positive", "negative", "nonnegative", "nonpositive", "nonzero", "zero", "integer", "even", "rational", "imaginary")
"""Assumptions that a motion need not keep."""

real = {"real": True}


def bead(q=real, p=real, parameter=real, **more):
    """Return a bead on a circle, of symbols with these assumptions."""
    x, y, u, v = sp.Symbol("x", **q), sp.Symbol("y", **real), sp.Symbol("u", **p), sp.Symbol("v", **real)
    k = sp.Symbol("k", **parameter)
    return ConstrainedHamiltonian(
        q=(x, y), p=(u, v), g=[x**2 + y**2 - 1], M=sp.eye(2), U=k * y, parameters={k: 1.0}, cases={"a": Case(q=(-1, 0), p=(0, 0))}, **more
    )


def chart(xi):
    """Return the angle and its rate as local coordinates, of symbols with these assumptions."""
    eta, angle = sp.Symbol("eta", **real), sp.Symbol("xi", **xi)
    x, y, u, v = sp.symbols("x y u v", real=True)
    e, n = [sp.cos(angle), sp.sin(angle)], [-sp.sin(angle), sp.cos(angle)]
    return Chart(eta=[eta], xi=[angle], q=e, p=[eta * each for each in n], inverse_eta=[x * v - y * u], inverse_xi=[sp.atan2(y, x)])


def flow(t):
    """Return a flow over a time with these assumptions, which nobody looks at."""
    x, y, u, v = sp.symbols("x y u v", real=True)
    return KineticFlow(t=sp.Symbol("t", **t), q=[x, y], p=[u, v])


def rotor(y=real, parameter=real, time=real, c=real, domain=()):
    """Return the oscillator y1' = y2, y2' = -y1 and a third coordinate at rest, of symbols with these assumptions."""
    a, b, e = sp.Symbol("a", **y), sp.Symbol("b", **real), sp.Symbol("e", **real)
    t, k, Q, P, C = sp.Symbol("t", **time), sp.Symbol("k", **parameter), *sp.symbols("Q P", real=True), sp.Symbol("C", **c)
    B = sp.Matrix([[0, 1, 0], [-1, 0, 0], [0, 0, 0]])
    return PoissonSystem(
        y=(a, b, e), B=B, H=(a**2 + k * b**2) / 2, parameters={k: 1.0}, domain=[sp.Symbol("a", **y) * sign for sign in domain],
        cases={"a": PoissonCase(y=(-1, 0, 0))},
        parts={"A": Part(H=a**2 / 2, t=t, y=(a, b - t * a, e)), "B": Part(H=k * b**2 / 2, t=t, y=(a + k * t * b, b, e))},
        splittings={"AB": ("A", "B")},
        darboux=DarbouxMap(q=[Q], p=[P], c=[C], Q=[a], P=[b], C=[e], y=[Q, P, C]),
    )  # fmt: skip


def lattice(field):
    """Return a lattice of oscillators, of fields with these assumptions."""
    symbols = {end: [sp.Symbol(f"u{end}", **field), sp.Symbol(f"v{end}", real=True)] for end in ("", "_left", "_right")}
    u, v = symbols[""]
    return PoissonLattice(
        sites=3, here=(u, v), left=symbols["_left"], right=symbols["_right"], b=sp.Matrix([[0, 1], [-1, 0]]), h=(u**2 + v**2) / 2,
        site=sp.Symbol("k", integer=True), cases={"a": PoissonCase(y=(0, 1))},
    )  # fmt: skip


def chain(here):
    """Return a chain of links, of positions with these assumptions."""
    x, y, x0, y0 = sp.Symbol("x", **here), *sp.symbols("y x0 y0", real=True)
    k = sp.Symbol("k", integer=True)
    joint = [(x - x0) ** 2 + (y - y0) ** 2 - 1]
    return ConstrainedChain(
        nodes=3, here=(x, y), before=(x0, y0), node=k, joints=joint, own=[], anchor=(0, 0), mass=sp.eye(2), U=y,
        cases={"a": Case(q=(0, -k - 1), p=(0, 0))},
    )  # fmt: skip


PLACES = {
    "position": lambda given: bead(q=given),
    "momentum": lambda given: bead(p=given),
    "local coordinate": lambda given: bead(chart=chart(given)),
    "time": lambda given: bead(kinetic_flow=flow(given)),
    "coordinate": lambda given: rotor(y=given),
    "time of a part": lambda given: rotor(time=given),
    "canonical coordinate": lambda given: rotor(c=given),
    "field": lattice,
    "position of a node": chain,
}


@pytest.mark.parametrize("place", PLACES)
def test_a_symbol_that_is_assumed_to_be_more_than_real_is_refused(place):
    for given in ({}, {"real": True}, {"finite": True}, {"complex": True}):
        PLACES[place](given)
    for assumption in FALSE:
        if (place, assumption) != ("position", "zero"):  # g is no function of a position that is zero, and is refused for it
            with refused("symbol-assumed-too-much", InvalidProblem, [place.split(" of ")[0]]):
                PLACES[place]({assumption: True})


@pytest.mark.parametrize("definition", [bead, rotor], ids=["constrained", "poisson"])
def test_a_parameter_is_held_against_its_sign_or_refused(definition):
    definition(parameter={"positive": True})
    for given in ("negative", "nonnegative", "integer", "nonzero", "even"):
        with refused("parameter-assumption", InvalidProblem, ["k"]):
            definition(parameter={given: True})


def test_a_coordinate_may_have_the_sign_that_the_domain_keeps():
    found = {}
    exec(ORBIT, found)
    found["problem"]()
    rotor(y={"positive": True}, domain=[1])
    rotor(y={"negative": True}, domain=[-1])
    for given, domain in (({"positive": True}, [-1]), ({"negative": True}, [1]), ({"positive": True, "integer": True}, [1])):
        with refused("symbol-assumed-too-much", InvalidProblem, ["domain"]):
            rotor(y=given, domain=domain)


def test_the_forces_at_a_start_on_the_other_side_are_those_of_the_equations():
    x, y, *p = sp.symbols("x y u v")
    plain = ConstrainedHamiltonian(q=(x, y), p=p, g=[x**2 + y**2 - 1], M=sp.eye(2), U=(x**2) ** sp.Rational(3, 2), cases={})
    ivp = make_ivp(source_of(plain), "", p0=[0, 0], q0=[-1, 0])
    assert ivp.value("H_q", ivp.p0, ivp.q0)[0] == pytest.approx(-3.0)

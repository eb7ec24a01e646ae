"""Rows of equal cells as chains: the same system as the one written out, and as the chains of the catalogue."""

from itertools import pairwise

import numpy as np
import pytest
import sympy as sp
from mechanisms import masses_on_strings
from refusals import refused

from daebench.errors import InvalidProblem
from daebench.joints import Mechanism, Rod, Spring, Start
from daebench.problems import four_bar, pendulum_chain

N = 8


def masses(n=N, **more):
    """Return point masses on massless rods in a row, as ``pendulum_chain`` is."""
    return masses_on_strings(*((k, 0) for k in range(1, n + 1)), **more)


def rods(n=N, last=1):
    """Return uniform rods in a row, hung from a pivot; the last may have another mass."""
    names = ["O", *(f"P{k}" for k in range(1, n + 1))]
    ends = enumerate(pairwise(names), 1)
    return Mechanism(
        ground={"O": ("0.5", "0.25")},
        points={name: (sp.Rational(1, 2) + k, sp.Rational(1, 4)) for k, name in enumerate(names) if k},
        bodies={f"rod {k}": Rod(a, b, mass=last if k == n else 1) for k, (a, b) in ends},
        gravity=(0, "-9.81"),
    )


def bars(n=N):
    """Return uprights and couplers in a row, as ``four_bar`` is."""
    bodies = {"upright 0": Rod("A0", "B0", mass=1)}
    for k in range(1, n + 1):
        bodies |= {f"coupler {k}": Rod(f"B{k - 1}", f"B{k}", mass=1), f"upright {k}": Rod(f"A{k}", f"B{k}", mass=1)}
    return Mechanism(
        ground={f"A{k}": (k, 0) for k in range(n + 1)}, points={f"B{k}": (k, 1) for k in range(n + 1)}, bodies=bodies, gravity=(0, "-9.81")
    )


def ladder(n=N):
    """Return cells of two points, a rod across each, and springs and rods between them: free in the plane."""
    points = {f"{side}{k}": (k * (k + 1) / 2, y) for k in range(n) for side, y in (("L", 0), ("R", 1))}
    bodies = {f"rung {k}": Rod(f"L{k}", f"R{k}", mass=1) for k in range(n)} | {
        f"rod {k}": Rod(f"L{k - 1}", f"L{k}", mass=2) for k in range(1, n)
    }
    return Mechanism(points=points, bodies=bodies, forces=[Spring(f"R{k - 1}", f"R{k}", stiffness=5, length=1) for k in range(1, n)])


def ordered(equations):
    """Return polynomials in an order of their own, whichever way their terms are written."""
    return sorted(str((polynomial.gens, polynomial.terms())) for polynomial in map(sp.Poly, equations))


MECHANISMS = {"masses": masses, "rods": rods, "bars": bars, "ladder": ladder}


@pytest.mark.sampled(by=lambda case: case == "ladder")  # those of masses and of bars are in the catalogue
@pytest.mark.parametrize("mechanism", MECHANISMS.values(), ids=MECHANISMS)
def test_a_row_is_the_chain_that_is_the_same_system_written_out(mechanism):
    whole, chain = mechanism().problem(), mechanism().chain()
    out = chain.written_out()
    assert whole.q == out.q
    assert whole.M == out.M
    assert ordered(whole.g) == ordered(out.g)
    difference = sp.expand(whole.U - out.U)
    assert not difference.free_symbols
    for name, case in whole.cases.items():
        assert [sp.expand(a - b) for a, b in zip(case.q, out.cases[name].q, strict=True)] == [0] * whole.d
    assert chain.picture.points.keys() == whole.picture.points.keys()


def test_rows_are_the_chains_of_the_catalogue():
    for found, hand in ((masses(), pendulum_chain.problem(links=N)), (bars(), four_bar.problem(bars=N))):
        chain, values = found.chain(), dict(hand.parameters)
        out, by_hand = chain.written_out(), hand.written_out()
        assert ordered(out.g) == ordered(sp.nsimplify(x.subs(values), rational=True) for x in by_hand.g)
        assert np.abs(np.array(out.M - by_hand.M.subs(values), dtype=float)).max() < 1e-15
        assert (chain.b, chain.nodes) == (hand.b, hand.nodes)


NO_ROWS = {
    "unequal masses": lambda: rods(last=2),
    "few": lambda: masses(5),
    "moving": lambda: masses(cases={"moving": Start(velocity={"P1": (0, 1)})}),
    "tied further": lambda: masses(forces=[Spring("P1", "P5", stiffness=1)]),
    "damped": lambda: masses(forces=[Spring("P1", "P2", damping=1)]),
    "bent": lambda: masses(cases={"bent": Start(at={f"P{N}": (N - 1, 1)})}),
}


@pytest.mark.parametrize("mechanism", NO_ROWS.values(), ids=NO_ROWS)
def test_what_is_no_row_of_equal_cells_is_no_chain(mechanism):
    with refused("mechanism-not-a-chain", InvalidProblem, ["8"]):
        mechanism().chain()

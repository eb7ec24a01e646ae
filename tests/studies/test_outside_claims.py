"""What code from outside claims is held against what is measured, by complex step or by differences."""

from dataclasses import replace

import pytest
from outside_code import RATTLE
from refusals import refused

import daebench as package
from daebench.diagnostics.derivative import DerivativeWarning
from daebench.methods.names import parse
from daebench.methods.outside.callables import method_of_callable
from daebench.methods.outside.method import Stated
from daebench.runs.request import Request
from daebench.studies.claims.check import check_claims
from daebench.studies.claims.poisson import PoissonBench
from daebench.studies.grid.claimed import claimed

CLAIMING = (
    RATTLE
    + """
step.claims = {"order": 2, "symmetric": True, "symplectic": True, "keeps_g": True, "keeps_Gv": True}

reduced.claims = {"order": 1, "symplectic": True, "keeps_g": True}

def real(p, q, h):
    if np.iscomplexobj(p):
        raise TypeError("real numbers only")
    return step(p, q, h)

real.claims = step.claims

def drops(p, q, h):
    return step(np.real(p), np.real(q), h)

drops.claims = step.claims
"""
)


def findings(name):
    ivp = package.initial_value_problem("spherical_pendulum", "fig1.1")
    return {finding.property: finding for finding in check_claims(ivp, parse(name), h=0.01, steps=100, halvings=5)}


@pytest.fixture
def claiming(mine, plain_functions):
    (mine / "mine.py").write_text(CLAIMING)
    return mine


def test_claims_that_hold_are_found_to(claiming):
    found = findings("./mine.py:step")
    assert [found[name].verdict for name in ("order", "symmetric", "symplectic", "keeps g", "keeps G H_p")] == 5 * ["ok"]
    assert found["keeps H"].verdict == "not claimed"
    assert found["symplectic"].note == ""
    assert found["symplectic"].bound < 1e-12


def test_claims_that_do_not_hold_are_found_not_to(claiming):
    found = findings("./mine.py:reduced")
    assert {name for name, finding in found.items() if finding.verdict == "FALLS SHORT"} == {"symplectic", "keeps g"}
    assert found["order"].verdict == "ok"


@pytest.mark.sampled(left_out=("real",))
@pytest.mark.parametrize("name", ["real", "drops"])
def test_code_that_does_not_compute_in_complex_numbers_is_measured_by_differences_to_a_stated_floor(claiming, name):
    with pytest.warns(DerivativeWarning, match="by differences"):
        found = findings(f"./mine.py:{name}")
    assert found["symplectic"].verdict == "ok"
    assert "by differences, good to" in found["symplectic"].note
    assert 1e-12 < found["symplectic"].bound < 1e-6


def test_what_it_claims_to_conserve_counts_in_a_study(claiming):
    ivp = package.initial_value_problem("spherical_pendulum", "fig1.2")
    assert claimed(ivp, parse("./mine.py:step")) == {"energy", "constraints", "two_form"}
    assert claimed(ivp, parse("./mine.py:one")) == set()
    turn = method_of_callable(lambda y, h: y)
    body = package.initial_value_problem("free_rigid_body")
    assert claimed(body, turn) == set()
    assert claimed(body, replace(turn, claims=Stated(symplectic=True))) == {"energy", "two_form"}


def test_a_library_is_measured_without_claims(library, plain_functions):
    with pytest.warns(DerivativeWarning, match="by differences"):
        found = findings(f"{library}:step")
    assert {finding.verdict for finding in found.values()} == {"not claimed"}
    assert found["symplectic"].measured < found["symplectic"].bound
    assert found["symmetric"].measured < 1e-14
    assert abs(found["order"].measured - 2) < 0.1


def test_claims_that_are_none_are_refused(mine):
    for code, claims in [
        ("unknown-name", "{'oder': 2}"),
        ("claimed-order-not-whole", "{'order': 2.5}"),
        ("claimed-order-not-whole", "{'order': True}"),
        ("claimed-order-not-whole", "{'order': -1}"),
        ("claim-not-true-or-false", "{'symplectic': 1}"),
        ("claims-not-a-mapping", "['order']"),
    ]:
        (mine / "mine.py").write_text(f"{RATTLE}\nstep.claims = {claims}\n")
        with refused(code):
            parse("./mine.py:step")


MAPS = """
import numpy as np

def turn(y, h):
    c, s = np.cos(h * y[2]), np.sin(h * y[2])
    return np.array([c * y[0] + s * y[1], c * y[1] - s * y[0], y[2]])

def grow(y, h):
    return np.exp(h) * y

turn.claims = grow.claims = {"symplectic": True, "symmetric": True}
"""


@pytest.mark.parametrize(("name", "verdict"), [("turn", "ok"), ("grow", "FALLS SHORT")])
def test_a_poisson_map_is_told_from_one_that_is_none(mine, plain_functions, name, verdict):
    """On the rigid body B is that of the rotations: a turn about an axis is a Poisson map, and growth is none."""
    (mine / "mine.py").write_text(MAPS)
    ivp, method = package.initial_value_problem("free_rigid_body"), parse(f"./mine.py:{name}")
    run = method.solve(ivp, Request(value=0.01, steps=50, watch=("energy", "casimirs", "integrals")))
    found = {finding.property: finding.verdict for finding in PoissonBench(ivp, method, run).findings()}
    assert (found["Poisson map"], found["symmetric"]) == (verdict, "ok")

"""The command ``daebench check``: what it prints, how it exits and what it refuses."""

import json
from dataclasses import replace

import pytest
from checks import EXACT, Study

from daebench.methods.fixed_step.constrained import FixedStep
from daebench.studies.claims.bench import FALLS_SHORT, OK

CHECK = ("check", "spherical_pendulum", "--case", "fig1.1", "--h", 0.03, "--steps", 20, "--method")


@pytest.fixture
def daebench(daebench, monkeypatch):
    """Run the command line on uncompiled kernels, with a study made up."""
    monkeypatch.setattr("daebench.methods.names.FixedStep", lambda *a, **k: FixedStep(*a, **k | {"compiled": False}))
    monkeypatch.setattr("daebench.studies.claims.check.study", lambda *_, **__: Study(q=lambda h: h**2, p=lambda h: h**2))
    return daebench


def test_the_command_prints_a_row_a_claim_and_exits_0_where_all_hold(daebench):
    status, out, err = daebench(*CHECK, "rattle")
    assert (status, err) == (0, "")
    for name in ("order", *EXACT, "keeps L3"):
        assert name in out
    assert "2.000 ±" in out
    assert FALLS_SHORT not in out


def test_the_command_gives_one_json_object(daebench):
    status, out, _ = daebench(*CHECK, "rattle", "--json")
    found = json.loads(out)
    rows = {row["property"]: row for row in found["claims"]}
    assert (status, found["falls_short"], found["h"], found["steps"]) == (0, [], 0.03, 20)
    curved = [f"{name} on two_bodies_on_sphere" for name in ("order", "symmetric", "symplectic")]
    assert list(rows) == ["order", *EXACT[:2], "Poisson in the chart", *EXACT[2:], "keeps L3", *curved]
    assert found["unseen"][0] == ("spherical_pendulum cannot show where a scheme evaluates the force, because its force is constant.")
    assert (rows["symplectic"]["claimed"], rows["symplectic"]["verdict"]) == (True, OK)
    assert rows["symplectic"]["measured"] <= rows["symplectic"]["bound"]
    assert (rows["keeps L3"]["claimed"], rows["keeps L3"]["bound"]) == (None, None)


def test_a_false_claim_exits_1_naming_the_property(daebench, monkeypatch):
    claims = replace(FixedStep("se").claims, symplectic=True, order=3)
    monkeypatch.setattr(FixedStep, "claims", property(lambda _: claims))
    status, out, _ = daebench(*CHECK, "se")
    assert status == 1
    assert out.strip().endswith(
        "se falls short of what it claims: order, symplectic, order on two_bodies_on_sphere, symplectic on two_bodies_on_sphere."
    )
    assert "spherical_pendulum cannot show how several multipliers are solved for together, because it has one constraint." in out

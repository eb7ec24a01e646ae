"""The tolerance of a solver of constraints that a drift asks for: what is chosen, what is named apart, what is refused."""

from functools import partial

import pytest
import sympy as sp
from refusals import refused

import daebench
import daebench.studies.tolerance_for as study
from daebench.compiler.definition import source_of
from daebench.diagnostics.drift import Drift
from daebench.methods.fixed_step.constrained import FixedStep
from daebench.runs.make_ivp import make_ivp
from daebench.studies.tolerance_for import ToleranceFor, TriedTolerance
from daebench.systems.constrained import Case, ConstrainedHamiltonian, coordinates


def found(*rows):
    tried = (TriedTolerance(10.0**-k, Drift(verdict), ratio, 0.0, 0.0) for k, (verdict, ratio) in enumerate(rows, start=3))
    return ToleranceFor(None, "rattle_gauss_seidel", 0.01, 1.0, 1e-3, tuple(tried))


def test_the_loosest_tolerance_is_chosen_from_which_on_all_do():
    assert found(("drifts", 0.1), ("bounded", 9e-4), ("kept", 1.0)).tolerance == 1e-4
    assert found(("drifts", 0.1), ("bounded", 2e-3)).tolerance is None


def test_a_tolerance_that_does_where_a_tighter_one_does_not_is_named_and_not_chosen():
    some = found(("drifts", 5e-4), ("drifts", 5e-3), ("bounded", 1e-5))
    assert (some.tolerance, some.fortuitous) == (1e-5, (1e-3,))


def test_what_is_not_known_is_no_small_drift():
    assert found(("undetermined", 1e-9)).tolerance is None
    assert found(("failed", float("inf"))).tolerance is None


def test_what_cannot_be_met_is_refused():
    for code, settings in (
        ("method-without-tolerance", {"method": "rattle"}),
        ("tolerances-below-round-off", {"precision": "float32", "tolerances": [1e-9]}),
        ("not-positive", {"drift": -1.0}),
        ("constraints-needed", {"problem": "lotka_volterra"}),
    ):
        with refused(code):
            daebench.tolerance_for(**{"problem": "rigid_water", "drift": 1e-3, "h": 0.01, "t_end": 1.0} | settings)


@pytest.mark.slow
def test_the_drift_of_a_molecule_falls_with_the_tolerance_and_decides():
    water = daebench.tolerance_for("rigid_water", case="tumbling", drift=1e-3, h=0.01, t_end=40, tolerances=[1e-3, 1e-4, 1e-5, 1e-9])
    ratios = [row.ratio for row in water.tried]
    assert ratios[0] > 10 * ratios[1] > 20 * ratios[2]
    assert (water.tolerance, water.fortuitous) == (1e-5, ())


def conical(unit):
    """A point of unit mass that goes round on a circle at constant height, on a rod of the given length: its kinetic energy is constant."""
    q, p = coordinates(3)
    r, z = 0.6 * unit, -0.8 * unit
    speed = (9.81 / 0.8 * unit) ** 0.5 * 0.6
    case = Case(q=(r, 0.0, z), p=(0.0, speed, 0.0))
    g = [sum(x**2 for x in q) - sp.Float(unit) ** 2]
    return make_ivp(
        source_of(ConstrainedHamiltonian(q=q, p=p, M=sp.eye(3), U=sp.Float(9.81) * q[2], g=g, cases={"a": case}), "conical"), "a"
    )


def free(unit):
    """Two points on a rod that turns freely."""
    q, p = coordinates(4)
    case = Case(q=(0, 0, unit, 0), p=(0, 1, 0, -2))
    g = [(q[0] - q[2]) ** 2 + (q[1] - q[3]) ** 2 - sp.Float(unit) ** 2]
    return make_ivp(source_of(ConstrainedHamiltonian(q=q, p=p, M=sp.diag(1, 1, 2, 2), U=0, g=g, cases={"a": case}), "free"), "a")


@pytest.mark.parametrize(("body", "unit"), [(conical, 1e-9), (free, 1e7)], ids=["conical", "free"])
def test_a_motion_of_constant_kinetic_energy_is_refused(body, unit, monkeypatch):
    monkeypatch.setattr(study, "FixedStep", partial(FixedStep, compiled=False))
    h = 0.02 * (unit if body is free else unit**0.5)
    with refused("kinetic-energy-constant"):
        daebench.tolerance_for(body(unit), drift=1e-3, h=h, t_end=150 * h, tolerances=[1e-3, 1e-11])


@pytest.mark.parametrize("swing", [0.5, 0.05], ids=["wide", "small"])
def test_a_motion_whose_kinetic_energy_fluctuates_is_taken(swing, monkeypatch):
    monkeypatch.setattr(study, "FixedStep", partial(FixedStep, compiled=False))
    ivp = conical(1.0)
    moved = make_ivp(ivp.source, "a", p0=(1 + swing) * ivp.p0)
    assert daebench.tolerance_for(moved, drift=1e9, h=0.01, t_end=2.0, tolerances=[1e-9]).tried[0].ratio >= 0

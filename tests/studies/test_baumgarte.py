"""Maps of stabilised constraints: limits against closed forms and runs, g against its own linear equation, and what is refused."""

import json
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from daebench_site.json_keys import documented
from documented_keys import disagreements
from refusals import refused
from scipy.linalg import expm

import daebench
from daebench.methods.names import method_of
from daebench.runs.request import Request
from daebench.studies.baumgarte.cells import SLOWEST, amplification, contraction, growth, limit, usable


def test_amplification_is_the_known_rational_function():
    z = np.array([-2.0 + 0.5j, -0.1j, -1.3])
    assert amplification("rk4", z) == pytest.approx(np.abs(1 + z + z**2 / 2 + z**3 / 6 + z**4 / 24), rel=1e-13)
    assert amplification("midpoint", z) == pytest.approx(np.abs((1 + z / 2) / (1 - z / 2)), rel=1e-13)
    assert amplification("gauss2", z) == pytest.approx(np.abs((1 + z / 2 + z**2 / 12) / (1 - z / 2 + z**2 / 12)), rel=1e-12)


def test_limits_are_those_of_the_real_axis_and_of_the_iteration():
    """rk4: the real zero of z^3/24 + z^2/6 + z/2 + 1; Gauss: |z| up to 2 and to the root of 12, less where iterations are limited."""
    real = next(-x.real for x in np.roots([1 / 24, 1 / 6, 1 / 2, 1]) if abs(x.imag) < 1e-9)
    assert limit("rk4") == pytest.approx(real, rel=1e-5)
    assert not contraction("rk4", np.array(9.0), np.array(9.0))
    for scheme, radius in (("midpoint", 2.0), ("gauss2", np.sqrt(12))):
        assert contraction(scheme, np.array(0.1 * radius), np.array(radius)) == pytest.approx(1, rel=0.02)
        assert contraction(scheme, np.array(radius), np.array(radius)) > 200 ** (1 / 100) - 1e-4  # the 100th power of a Jordan block
        assert 0.7 * radius < limit(scheme) < SLOWEST * radius
    assert growth("gauss2", np.array(50.0), np.array(50.0)) < 1 < contraction("gauss2", np.array(50.0), np.array(50.0))
    assert np.array_equal(usable("rk4", np.array([1.0, 4.0, 0.1]), np.array([1.0, 4.0, 4.0])), [True, False, False])


@pytest.fixture(scope="module")
def found():
    return daebench.baumgarte(
        "spherical_pendulum",
        h=0.01,
        t_end=5.0,
        methods=["rk4", "gauss2", "rattle"],
        tolerances=[1e-6],
        values=[0.01, 0.1, 1.0],
        rates=[1.0, 10.0],
    )


def test_limits_are_measured_where_they_are_predicted(found):
    assert [one.by for one in found.limits] == ["growth"] * 3 + ["iteration"] * 3
    for one in found.limits:
        assert one.measured == pytest.approx(one.predicted, rel=0.1)


def test_a_cell_is_the_run_that_its_numbers_are_of(found):
    one = found.maps["baumgarte:rk4"][4]
    assert one.options == pytest.approx({"alpha": 10.0, "beta": 10.0})
    again = daebench.run("spherical_pendulum", method="baumgarte:rk4", h=0.01, t_end=5.0, options=dict(one.options))
    assert (one.energy, one.g, one.Gv) == tuple(again.maxima[name] for name in ("energy", "g", "Gv"))
    assert one.work == again.work["G"]
    assert found.effects[0].without.energy == daebench.run("spherical_pendulum", method="rk4", h=0.01, t_end=5.0).maxima["energy"]


def test_the_answer_says_what_the_runs_gave(found):
    rk4 = found.effects[0]
    assert rk4.least.energy <= rk4.usual.energy <= rk4.most.energy
    assert rk4.ratio == rk4.usual.energy / rk4.without.energy
    assert {one.method: one.g < 1e-13 for one in found.beside} == {"rattle": True}
    assert f"{rk4.without.energy:.2g} without it and {rk4.usual.energy:.2g} with" in found.answer


def test_over_a_long_time_the_drift_of_the_classical_method_stays_and_that_with_stabilisation_ends():
    """The verdicts on both energies: |g| grows without end, and so does H; with damping |g| is bounded, and H is not kept for that."""
    long = daebench.baumgarte("spherical_pendulum", h=0.1, t_end=400.0, methods=["rk4"], tolerances=[], values=[1.0])
    effect = long.effects[0]
    assert effect.without.g > 3 * effect.usual.g
    assert effect.drift_without.verdict == "drifts"


def test_soft_constraints_sag_by_the_share_of_their_force(found):
    """At rest below, a = g'' without lam = -2 gravity length; g settles where (1 - r) a = r k g."""
    k, c, r = 400.0, 40.0, 0.8
    hanging = daebench.initial_value_problem("planar_pendulum", q0=[0.0, -1.0], p0=[0.0, 0.0], parameters={"gravity": 2.0})
    options = {"stiffness": k, "damping": c, "impedance": r}
    run = method_of(hanging, "soft:rk4", options).solve(hanging, Request(value=0.01, t_end=5.0))
    settled = float(hanging.value("g", run.q[-1])[0])
    a = float((hanging.value("G", run.q[-1]) @ np.array([0.0, -2.0]))[0])
    assert settled == pytest.approx((1 - r) * a / (r * k), rel=1e-9)
    assert all(one.energy > 0 and one.options["impedance"] == 0.9 for one in found.maps["soft:rk4"])


def test_soft_constraints_of_impedance_one_are_baumgartes():
    soft = daebench.run(
        "double_pendulum", method="soft:rk4", h=0.01, t_end=1.0, options={"stiffness": 25.0, "damping": 6.0, "impedance": 1.0}
    )
    hard = daebench.run("double_pendulum", method="baumgarte:rk4", h=0.01, t_end=1.0, options={"alpha": 3.0, "beta": 5.0})
    assert np.abs(soft.q - hard.q).max() < 1e-12
    assert np.abs(soft.p - hard.p).max() < 1e-12


def test_g_of_soft_constraints_follows_their_equation_of_motion():
    """Without a force that the constraint carries g' = A g exactly, here for a bead on a line, off it at the start."""
    import sympy as sp

    from daebench.systems.constrained import Case, ConstrainedHamiltonian

    x, y, px, py = sp.symbols("x y px py", real=True)
    bead = ConstrainedHamiltonian(q=(x, y), p=(px, py), M=sp.eye(2), U=sp.Integer(0), g=[y], cases={"moving": Case(q=(0, 0), p=(1, 0))})
    at = daebench.initial_value_problem(bead)
    off = replace(at, q0=np.array([0.0, 0.1]), p0=np.array([1.0, -0.2]))
    k, c, r, t = 30.0, 4.0, 0.7, 1.0
    options = {"stiffness": k, "damping": c, "impedance": r}
    run = method_of(off, "soft:rk4", options).solve(off, Request(value=0.001, t_end=t))
    expected = expm(np.array([[0, 1], [-r * k, -r * c]]) * t) @ [0.1, -0.2]
    assert [run.q[-1, 1], run.p[-1, 1]] == pytest.approx(expected, abs=1e-11)


def test_what_cannot_be_mapped_is_refused():
    for code, problem, settings in [
        ("constraints-needed", "lotka_volterra", {}),
        ("no-method-to-stabilise", "planar_pendulum", {"methods": ["rattle"]}),
        ("stabilise-own-steps", "planar_pendulum", {"methods": ["rk4", "ida:index2"]}),
        ("not-positive", "planar_pendulum", {"values": [0.1, -1.0]}),
        ("not-positive", "planar_pendulum", {"h": 0.0}),
    ]:
        with refused(code):
            daebench.baumgarte(problem, **settings)


@pytest.mark.usefixtures("plain_functions", "uncompiled_schemes")
def test_the_command_answers_and_writes_what_it_shows(daebench, tmp_path):
    words = f"planar_pendulum --t-end 1 --h 0.05 --methods rk4,rattle --tol 1e-6 --values 0.1,1 --rates 1 --out {tmp_path} --json"
    status, out, _ = daebench("baumgarte", *words.split())
    said = json.loads(out)
    assert (status, disagreements(said, documented()["baumgarte"].keys)) == (0, [])
    assert [one["method"] for one in said["beside"]] == ["rattle"]
    assert all((tmp_path / name).stat().st_size > 1000 for name in ("baumgarte.svg", "baumgarte.png"))
    assert len(pd.read_csv(tmp_path / "baumgarte.csv")) == 2 * 2**2 + 2 + 1**2 + 1

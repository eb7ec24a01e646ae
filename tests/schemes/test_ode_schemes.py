"""Schemes on the index-reduced equation (1.18) and around it: orders, claims, work, and the same in machine code."""

import ctypes
import shutil
import subprocess
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import sympy as sp
from ivps import ivp
from measures import differences, error_of
from runs import PLACES, PROJECTED, ROUND_OFF, defects, method, run, state_error
from tallied import tally

import daebench
from daebench.compiler.definition import source_of
from daebench.diagnostics.energy import energy_drift
from daebench.diagnostics.energy_verdict import energy_error
from daebench.diagnostics.order import fit_order
from daebench.diagnostics.symplecticity import tangent_basis, tangent_map
from daebench.errors import RunFailed
from daebench.methods.fixed_step.constrained import FixedStep
from daebench.methods.names import parse
from daebench.runs.make_ivp import make_ivp
from daebench.runs.request import Request
from daebench.systems.constrained import Case, ConstrainedHamiltonian, coordinates

ORDERS = {"rk4": 4, "midpoint": 2, "gauss2": 4, "gauss3": 6, "gauss4": 8}

COUNTS = {2: (32, 64, 128), 4: (32, 64, 128), 6: (12, 16, 24, 32), 8: (8, 10, 12, 16)}


@pytest.mark.parametrize(
    "name", [*ORDERS, *PROJECTED, "local:midpoint", "local:gauss2", "canonical:gauss2", "baumgarte:rk4", "midpoint/suzuki4"]
)
def test_the_order_on_the_fast_pendulum_is_as_claimed(name):
    order = method(name).claims.order
    assert order == ORDERS.get(name, order)
    counts = COUNTS[order]
    errors = [state_error(name, "spherical-fast", n) for n in counts]
    assert abs(fit_order([0.5 / n for n in counts], errors).slope - order) < 0.3, errors


@pytest.mark.sampled(by=("midpoint-2-stretched-M", "gauss2-4-relativistic", "midpoint+symproj-2-coupled-rods").__contains__)
@pytest.mark.parametrize("place", ["stretched-M", "relativistic", "coupled-rods"])
@pytest.mark.parametrize(("name", "order"), [("rk4", 4), ("midpoint", 2), ("gauss2", 4), ("midpoint+symproj", 2)])
def test_the_order_is_kept_for_every_kind_of_hamiltonian(name, order, place):
    errors = [state_error(name, place, n) for n in (8, 16, 32)]
    assert abs(fit_order([0.5 / n for n in (8, 16, 32)], errors).slope - order) < 0.2, errors


@pytest.mark.sampled(
    by=lambda case: case in ("midpoint-relativistic", "gauss3-spherical-fast", "gauss2-stretched-M", "gauss2+symproj-coupled-rods")
)
@pytest.mark.parametrize("place", PLACES)
@pytest.mark.parametrize("name", ["midpoint", "gauss2", "gauss3", "midpoint+symproj", "gauss2+symproj"])
def test_symmetric_schemes_return_and_do_not_keep_the_two_form(name, place):
    assert method(name).claims.symmetric
    assert not method(name).claims.symplectic
    two_form, reversal = defects(name, place)
    assert reversal < ROUND_OFF
    assert two_form > 1e-8 or name in ("gauss2", "gauss3", "gauss2+symproj")


@pytest.mark.parametrize("name", ["rk4", "rk4+proj", "rk4+symproj", "midpoint+proj", "baumgarte:midpoint"])
def test_what_is_not_symmetric_does_not_claim_to_be_and_does_not_return(name):
    assert not method(name).claims.symmetric or name == "rk4+symproj"
    assert defects(name, "spherical-fast")[1] > 1e-8


def test_midpoint_on_the_sphere_conserves_q_dot_p_and_angular_momentum_but_not_the_two_form():
    maxima = run("midpoint", "spherical-slow", 0.03, 300, watch=("manifold", "integrals")).maxima
    assert maxima["Gv"] < 1e-15
    assert maxima["L3"] < 1e-15
    assert maxima["g"] > 1e-8
    assert defects("midpoint", "spherical-slow", 0.03)[0] > 1e-7


@pytest.mark.exhaustive
def test_midpoint_has_no_visible_energy_drift_over_a_million_steps_where_se_has_over_a_thousand():
    where = ivp("spherical-slow")
    found = []
    for name, steps in (("midpoint", 1000), ("midpoint", 10**6), ("se", 1000)):
        each = FixedStep(name).solve(where, Request(value=0.03, steps=steps, every=steps // 500)).complete()
        found.append((each.maxima["energy"], energy_drift(each.t, energy_error(where, each))))
    (early, _), (late, drift), (_, drift_of_se) = found
    assert late < 1.001 * early < 1e-6
    assert drift.verdict == "bounded"
    assert abs(drift.slope) < 4 * drift.slope_error
    assert drift_of_se.slope > 100 * drift_of_se.slope_error


@pytest.mark.sampled(left_out=("gauss2", "midpoint+proj", "local:midpoint"))
@pytest.mark.parametrize(
    "name", ["midpoint", "gauss2", "midpoint+symproj", "midpoint+proj", "stiff:midpoint", "local:midpoint", "canonical:se"]
)
def test_the_tangent_map_by_complex_step_is_that_of_differences(name):
    where = ivp("spherical-fast")
    flow = method(name, **({"eps": 0.1} if name.startswith("stiff") else {})).flow(where, 0.02, 2)
    x, X = np.concatenate(where.start), tangent_basis(where, *where.start)
    moved = differences(lambda a: np.real(np.concatenate(flow(*np.split(x + X @ a, 2)))), np.zeros(X.shape[1]))
    found = tangent_map(flow, *where.start, X)
    assert error_of(found, moved) < 1e-7
    assert error_of(found, X) > 1e-2


def test_a_step_too_large_for_the_iteration_inside_is_said_and_no_nan_travels():
    where = ivp("spherical-fast")
    for name in ("midpoint", "gauss3", "midpoint+symproj"):
        found = method(name).solve(where, Request(value=1.0, steps=5))
        assert found.failure is not None
        assert found.steps == 0
        assert np.all(np.isfinite(found.q))
    with pytest.raises(RunFailed):
        method("midpoint+symproj").flow(where, 1.0, 1)(where.p0, where.q0)


@pytest.mark.sampled(left_out=("midpoint+proj", "midpoint+symproj", "rk4+symproj", "se+symproj", "canonical:midpoint"))
@pytest.mark.parametrize(
    "name",
    [
        *(*PROJECTED, "se+symproj", "stiff:gauss2", "local:midpoint", "canonical:se", "canonical:midpoint", "baumgarte:rk4"),
        "midpoint/triple_jump4+proj",
    ],
)
def test_work_is_what_an_independent_tally_counts(name, monkeypatch):
    where, own, request = ivp("spherical-fast"), method(name), Request(value=0.002, steps=4, watch=())
    counted = own.solve(where, request).work
    assert counted == tally(monkeypatch, own, where, request)
    assert counted["H_q"] > 0


@pytest.mark.sampled(by=lambda case: case in ("rk4-light", "gauss2-heavy", "midpoint+symproj-light"))
@pytest.mark.parametrize("light", [sp.Rational(1, 10**8), 10**8], ids=["light", "heavy"])
@pytest.mark.parametrize("name", ["rk4", "midpoint", "gauss2", "midpoint+symproj", "midpoint+proj"])
def test_mass_ratios_of_1e16_change_nothing_of_what_is_not_coupled(name, light):
    def pendulums(*masses):
        q, p = coordinates(2 * len(masses))
        M = sp.diag(*(mass for mass in masses for _ in range(2)))
        g = [x**2 + y**2 - 1 for x, y in zip(q[::2], q[1::2], strict=True)]
        start = Case(q=(1, 0) * len(masses), p=(0, 0) * len(masses))
        U = sum(mass * y for mass, y in zip(masses, q[1::2], strict=True))
        return make_ivp(source_of(ConstrainedHamiltonian(q=q, p=p, M=M, U=U, g=g, cases={"a": start}), "pendulums"), "a")

    both, alone = (run(name, pendulums(*masses), 0.02, 20, watch=()) for masses in ((light, 1 / light), (sp.Integer(1),)))
    assert error_of(both.q[-1], np.tile(alone.q[-1], 2)) < 1e-13
    assert both.pivot > 0.1


@pytest.mark.skipif(shutil.which("cc") is None, reason="no C compiler")
def test_rk4_in_c_is_the_same_method(tmp_path):
    library = tmp_path / "rk4.so"
    source = Path(daebench.__file__).parent / "studies" / "rk4.c"
    subprocess.run(["cc", "-O3", "-Wall", "-Werror", "-shared", "-fPIC", str(source), "-o", str(library), "-lm"], check=True)
    rk4 = ctypes.CDLL(str(library)).rk4
    rk4.restype, rk4.argtypes = ctypes.c_long, [ctypes.c_void_p, *[ctypes.c_double] * 4, ctypes.c_long, ctypes.POINTER(ctypes.c_long)]
    where = make_ivp(ivp("spherical-fast").source, "fig1.2b", {"mass": 2.0, "gravity": 9.81})
    state = np.concatenate([where.p0, where.q0])
    assert rk4(state.ctypes.data, *where.par, 0.01, 100, ctypes.c_long()) == 100
    found = run("rk4", where, 0.01, 100)
    assert error_of(state, np.concatenate([found.p[-1], found.q[-1]])) < 1e-12


PARTS_OF_NAMES = ("midpoint+symproj", "stiff:midpoint", "local:midpoint", "canonical:se", "baumgarte:rk4")
"""A projection, and the forms."""


@pytest.mark.sampled(
    left_out=(
        "local:midpoint",
        "midpoint+symproj",
        "stiff:midpoint",
    )
)
@pytest.mark.slow
@pytest.mark.parametrize("name", [pytest.param("gauss2", marks=pytest.mark.exhaustive), *PARTS_OF_NAMES])
def test_machine_code_does_what_the_files_say(name):
    where, request = ivp("spherical-fast"), Request(value=0.005, steps=40, watch=("energy", "manifold", "integrals"))
    fast, slow = (replace(parse(name), compiled=compiled).solve(where, request).complete() for compiled in (True, False))
    assert error_of(fast.q, slow.q) < 1e-11
    assert fast.maxima.keys() == slow.maxima.keys()
    single = replace(parse(name), compiled=True).solve(where, replace(request, precision="float32"))
    assert single.failure is None
    assert error_of(single.q[-1], slow.q[-1]) < 1e-2

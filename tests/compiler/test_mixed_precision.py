"""Mixed precision: forces in single precision, and everything else in double precision."""

from dataclasses import replace

import numpy as np
import pytest
import uncompiled
from uncompiled import named

import daebench
from daebench.compiler.syntax import in_single
from daebench.errors import BadInput
from daebench.methods.fixed_step.constrained import FixedStep
from daebench.methods.initial_value_problem import initial_value_problem
from daebench.methods.names import method_of
from daebench.runs.request import Request

BUTANE = ("butane", "gauche")
RAILS = {"explicit H": BUTANE, "M and U": ("four_bar_spring", None)}


def run(name, where, precision, *, compiled=False, steps=50):
    method, ivp = FixedStep(name, compiled=compiled), initial_value_problem(*where)
    return method.solve(ivp, Request(value=0.005, steps=steps, precision=precision)).complete()


def kernel(where, precision):
    ivp, method = initial_value_problem(*where), FixedStep("rattle", compiled=False)
    module = uncompiled.kernel(method, ivp, precision, (), count=False, singular="")
    return ivp, module, method.linked(ivp, module, 0.005).par


def test_arguments_and_constants_are_rounded_and_results_are_doubles():
    source = in_single("def U_q(q, par):\n    q_0 = q[0]\n    t_0 = 0.1 * q_0\n    return (t_0, 0.0)\n")
    space = {"numpy": np}
    exec(source, space)
    first, second = space["U_q"]((0.3,), ())
    assert (first, second) == (float(np.float32(0.1) * np.float32(0.3)), 0.0)
    assert type(first) is type(second) is np.float64


@pytest.mark.parametrize("where", RAILS.values(), ids=RAILS)
def test_forces_have_the_rounding_of_single_precision_and_constraints_that_of_double(where, random):
    ivp, mixed, par = kernel(where, "mixed")
    _, double, _ = kernel(where, "float64")
    q = tuple(np.float64(x) for x in ivp.q0 + 0.01 * random.normal(size=ivp.d))
    p = tuple(np.float64(x) for x in random.normal(size=ivp.d))
    force, exact = (np.array(named(module, "H_q")(p, q, par)) for module in (mixed, double))
    off = np.abs(force - exact).max() / np.abs(exact).max()
    assert 1e-9 < off < 1e-4
    assert force.dtype == np.float64
    for name in ("g", "G"):
        assert getattr(mixed, name)(q, par) == getattr(double, name)(q, par)


def ended(scheme, ivp, precision, *, h, steps=200):
    return (
        replace(method_of(ivp, scheme), compiled=False).solve(ivp, Request(value=h, steps=steps, every=0, precision=precision)).complete()
    )


@pytest.mark.parametrize("scheme", ["rattle", "shake", "rattle_ilves", "rattle/suzuki4"])
def test_a_constant_force_is_the_one_of_a_rounded_constant_to_the_bit(scheme):
    rounded = float(np.float32(9.81))
    assert rounded != 9.81
    given, of_rounded = (initial_value_problem("planar_pendulum", "horizontal", {"gravity": g}) for g in (9.81, rounded))
    mixed, double = ended(scheme, given, "mixed", h=0.01), ended(scheme, of_rounded, "float64", h=0.01)
    assert mixed.q.dtype == np.float64
    assert np.array_equal(mixed.q, double.q)
    assert np.array_equal(mixed.p, double.p)
    assert not np.array_equal(mixed.q, ended(scheme, given, "float64", h=0.01).q)


def test_a_force_that_depends_on_positions_is_that_of_rounded_positions():
    """q1 - q0 - h M^-1 p0 + h^2/2 M^-1 (F + G^T lam) = 0 with F as NumPy has it in float32: a parabola about the origin, and a field."""
    ivp, h, single = initial_value_problem("rigid_water", "tumbling"), 0.01, np.float32
    run = FixedStep("rattle", compiled=False).solve(ivp, Request(value=h, steps=1, precision="mixed", raw=True)).complete()
    pull = single(ivp.parameters["charge"]) * single(ivp.parameters["field"])
    F = np.zeros(9)
    F[:3] = single(ivp.parameters["stiffness"]) * ivp.q0[:3].astype(single)
    F[2::3] += [2 * pull, -pull, -pull]
    G, M = ivp.value("G", ivp.q0), ivp.value("mass", ivp.p0, ivp.q0)
    _, lam = run.raw["lam_n"]

    def unmet(F):
        return np.abs(run.q[1] - ivp.q0 - h * np.linalg.solve(M, ivp.p0 - h / 2 * (F + G.T @ lam[0]))).max()

    assert unmet(F) < 1e-15 < 1e-13 < unmet(F + 1e-6 * np.abs(F).max())


def test_constraints_hold_to_the_rounding_of_double_precision():
    mixed, double, single = (run("rattle", BUTANE, precision) for precision in ("mixed", "float64", "float32"))
    assert 1e-9 < np.abs(mixed.q - double.q).max() < 1e-5
    assert max(mixed.maxima["g"], mixed.maxima["Gv"]) < 1e-13 < 1e-8 < single.maxima["g"]
    assert mixed.q.dtype == mixed.p.dtype == np.float64


def test_machine_code_gives_the_same():
    fast, slow = (run("rattle", ("rigid_water", "tumbling"), "mixed", compiled=compiled) for compiled in (True, False))
    assert np.abs(fast.q - slow.q).max() < 1e-14
    double = run("rattle", ("rigid_water", "tumbling"), "float64")
    assert np.abs(fast.q - double.q).max() > 1e-12


@pytest.mark.parametrize(
    "name", ["rattle", "shake", "rattle_settle", "rattle_ilves", "symplectic_euler_adjoint", "rk4", "rattle/suzuki4", "rk4+proj"]
)
def test_explicit_forces_are_no_part_of_an_iteration(name):
    assert "H_q" not in method_of(initial_value_problem("rigid_water"), name).iterated(initial_value_problem("rigid_water"))


REFUSED = {
    "iteration": ("midpoint", BUTANE, "the scheme evaluates forces in an iteration, which does not converge beyond single precision"),
    "form": ("local:rk4", ("planar_pendulum", None), "forces are not computed apart in the form local"),
    "inertia": ("rattle", ("andrews_squeezer", None), "it needs H = 1/2 p^T M^-1 p + U(q) with constant M"),
    "time": ("rattle", ("car_axis", None), "it needs a system without forces that depend on time or velocity"),
}


@pytest.mark.parametrize(("name", "where", "why"), REFUSED.values(), ids=REFUSED)
def test_forces_that_cannot_be_rounded_alone_are_refused(name, where, why):
    ivp = initial_value_problem(*where)
    with pytest.raises(BadInput, match="cannot compute in mixed precision") as refusal:
        method_of(ivp, name).check(ivp, Request(value=0.01, steps=1, precision="mixed"))
    assert why in str(refusal.value)
    assert str(refusal.value).endswith("; use float64 or float32.")


def test_long_chains_and_poisson_systems_are_refused():
    many = initial_value_problem("pendulum_chain", None, {"links": 20})
    with pytest.raises(BadInput, match="its forces are computed in loops"):
        FixedStep("rattle").check(many, Request(value=0.01, steps=1, precision="mixed"))
    with pytest.raises(BadInput, match="no forces to compute in single precision"):
        daebench.run("lotka_volterra", method="strang", h=0.1, t_end=1, precision="mixed")


def test_an_unknown_precision_is_named():
    with pytest.raises(BadInput, match="unknown precision 'float23'; did you mean float32"):
        daebench.run("planar_pendulum", method="rattle", h=0.1, t_end=1, precision="float23")

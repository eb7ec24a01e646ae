"""Mixed precision: forces in single precision, and everything else in double precision."""

import numpy as np
from measures import error_of
from refusals import refused

import daebench
from daebench.compiler.syntax import in_single
from daebench.methods.fixed_step.constrained import FixedStep
from daebench.methods.initial_value_problem import initial_value_problem
from daebench.methods.names import method_of
from daebench.runs.request import Request

WATER = ("rigid_water", "tumbling")


def run(name, where, precision, *, compiled=False, steps=50):
    method, ivp = FixedStep(name, compiled=compiled), initial_value_problem(*where)
    return method.solve(ivp, Request(value=0.005, steps=steps, precision=precision)).complete()


def test_arguments_and_constants_are_rounded_and_results_are_doubles():
    source = in_single("def U_q(q, par):\n    q_0 = q[0]\n    t_0 = 0.1 * q_0\n    return (t_0, 0.0)\n")
    space = {"numpy": np}
    exec(source, space)
    first, second = space["U_q"]((0.3,), ())
    assert (first, second) == (float(np.float32(0.1) * np.float32(0.3)), 0.0)
    assert type(first) is type(second) is np.float64


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
        return error_of(run.q[1] - ivp.q0, h * np.linalg.solve(M, ivp.p0 - h / 2 * (F + G.T @ lam[0])))

    assert unmet(F) < 1e-15 < 1e-13 < unmet(F + 1e-6 * np.abs(F).max())


def test_constraints_hold_to_the_rounding_of_double_precision():
    mixed, double, single = (run("rattle", ("butane", "gauche"), precision) for precision in ("mixed", "float64", "float32"))
    assert 1e-9 < error_of(mixed.q, double.q) < 1e-5
    assert max(mixed.maxima["g"], mixed.maxima["Gv"]) < 1e-13 < 1e-8 < single.maxima["g"]
    assert mixed.q.dtype == mixed.p.dtype == np.float64


def test_machine_code_gives_the_same():
    fast, slow = (run("rattle", WATER, "mixed", compiled=compiled) for compiled in (True, False))
    assert error_of(fast.q, slow.q) < 1e-14
    double = run("rattle", WATER, "float64")
    assert error_of(fast.q, double.q) > 1e-12


REFUSED = {
    "iteration": ("midpoint", WATER, "in an iteration"),
    "form": ("local:rk4", ("planar_pendulum", None), "the form local"),
    "inertia": ("rattle", ("andrews_squeezer", None), "constant M"),
    "time": ("rattle", ("car_axis", None), "time or velocity"),
    "loops": ("rattle", ("pendulum_chain", None, {"links": 20}), "loops"),
}


def test_forces_that_cannot_be_rounded_alone_are_refused():
    for name, where, why in REFUSED.values():
        ivp = initial_value_problem(*where)
        with refused("mixed-precision-refused", says=(why,)):
            method_of(ivp, name).check(ivp, Request(value=0.01, steps=1, precision="mixed"))
    with refused("poisson-in-single-precision"):
        daebench.run("lotka_volterra", method="strang", h=0.1, t_end=1, precision="mixed")

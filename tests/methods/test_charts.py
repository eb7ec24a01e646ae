"""Methods in the coordinates of a chart, local and canonical, on every problem of the catalogue that declares one."""

from functools import cache

import numpy as np
import pytest
import sympy as sp
from runs import ROUND_OFF, method

from daebench.compiler.definition import source_of
from daebench.diagnostics.symplecticity import symplecticity_defect, tangent_basis, tangent_basis_at_one_time
from daebench.errors import BadInput
from daebench.methods.catalogue import problems
from daebench.methods.initial_value_problem import initial_value_problem
from daebench.runs.local_flow import enter, leave
from daebench.runs.make_ivp import make_ivp
from daebench.runs.request import Request
from daebench.runs.scales import constrained_scales
from daebench.systems.constrained import Case, Chart, ConstrainedHamiltonian, coordinates

QUICK = ("torus", "planar_pendulum", "double_pendulum", "driven_slider_crank", "arevalo", "slider_crank_sundials")
"""Curved, coupled, driven in time with a mass matrix that is not diagonal, and with forces: derived in a second or two."""

LONG = ("andrews_squeezer", "butane", "fekete", "rigid_water", "watt_six_bar", "pendulum_chain", "double_spherical_pendulum")
"""Problems whose charts take ten seconds and more to derive."""

CHARTED = [name for name in problems() if getattr(initial_value_problem(name).facts, "CHART", False)]
SWEPT = [
    pytest.param(name, marks=[] if name in QUICK else [pytest.mark.slow, *[pytest.mark.exhaustive] * (name in LONG)]) for name in CHARTED
]


@cache
def time_of(name):
    """Return a twentieth of the time in which the motion changes by itself."""
    return 0.05 / constrained_scales(initial_value_problem(name), 0.01, rated=True)[1]


def end(name, how, steps):
    ivp = initial_value_problem(name)
    found = method(how).solve(ivp, Request(value=time_of(name) / steps, steps=steps, every=steps)).complete()
    return np.concatenate([found.p[-1] / (1 + np.abs(found.p).max()), found.q[-1]])


@pytest.mark.parametrize("name", SWEPT)
def test_in_a_chart_the_motion_is_that_of_1_18(name):
    """The energy that time and forces have added, p_t, is among the numbers compared."""
    reference = end(name, "gauss4", 20)
    for how in ("canonical:gauss3", "local:gauss3"):
        assert np.abs(end(name, how, 10) - reference).max() < 1e-9, how


@pytest.mark.parametrize("name", SWEPT)
def test_canonical_methods_keep_the_two_form_as_claimed(name):
    """Where forces have no potential, the motion itself does not keep it, and no more is claimed than that of the scheme."""
    ivp = initial_value_problem(name)
    basis = tangent_basis_at_one_time if ivp.facts.EXTENDED else tangent_basis
    X = basis(ivp, ivp.p0, ivp.q0)
    for how in ("canonical:gauss2", "canonical:midpoint", "canonical:se", "canonical:rk4"):
        claims = method(how).claims
        assert claims.symplectic == (how != "canonical:rk4")
        h = time_of(name) * {"car_axis": 0.05, "torus": 4.0, "double_pendulum": 4.0}.get(name, 0.25)  # an axle is stiff
        found = symplecticity_defect(method(how).flow(ivp, h, 4), ivp.p0, ivp.q0, X)
        assert found < ROUND_OFF or not claims.symplectic or ivp.facts.FORCED, (how, found)
        assert found > 1e-9 or claims.symplectic or name not in ("torus", "double_pendulum")


@pytest.mark.parametrize("name", QUICK)
def test_canonical_momenta_are_those_that_do_the_work_of_p_on_moves_of_the_angles(name):
    """P.dQ = p.dq for every move on the manifold, by differences of the chart."""
    ivp, s = initial_value_problem(name), 1e-6
    P, Q = (np.array(part, dtype=float) for part in enter(ivp, "canonical")(ivp.p0, ivp.q0))
    p, q = leave(ivp, "canonical")(P, Q)
    np.testing.assert_allclose(np.array(q), ivp.q0, rtol=0, atol=1e-14 * (1 + np.abs(ivp.q0).max()))
    np.testing.assert_allclose(np.array(p), ivp.p0, rtol=0, atol=1e-13 * (1 + np.abs(ivp.p0).max()))
    for k in range(len(Q)):
        ends = [np.array(leave(ivp, "canonical")(P, Q + sign * s * np.eye(len(Q))[k])[1], dtype=float) for sign in (1, -1)]
        assert abs(ivp.p0 @ (ends[0] - ends[1]) / (2 * s) - P[k]) < 1e-8 * (1 + np.abs(P).max())


def bead(**change):
    """Return a bead on a parabola, its chart by the abscissa and speed."""
    (x, y), p = coordinates(2)
    s, u = sp.symbols("s u", real=True)
    chart = {"eta": (u,), "xi": (s,), "p": (u, 2 * s * u), "q": (s, s**2), "inverse_eta": (p[0],), "inverse_xi": (x,)}
    parts = {"M": sp.eye(2), "U": y, "g": [y - x**2], "chart": chart} | change
    start = Case(q=(1, 1), p=(1, 2))
    chart = Chart(**parts.pop("chart"))
    return make_ivp(source_of(ConstrainedHamiltonian(q=(x, y), p=p, cases={"a": start}, chart=chart, **parts), "bead"), "a")


def rotated():
    """Return a chart whose positions depend on eta, which is s here: the names of both are exchanged."""
    (x, _), p = coordinates(2)
    s, u = sp.symbols("s u", real=True)
    return {"eta": (s,), "xi": (u,), "p": (u, 2 * s * u), "q": (s, s**2), "inverse_eta": (x,), "inverse_xi": (p[0],)}


@pytest.mark.parametrize(
    "change",
    [
        {"chart": rotated()},
        {"M": None, "U": None, "H": sp.sqrt(1 + coordinates(2)[1][0] ** 2 + coordinates(2)[1][1] ** 2) + coordinates(2)[0][1]},
        {"M": None, "U": None, "H": sum(p**2 for p in coordinates(2)[1]) / 2 + coordinates(2)[1][0] * coordinates(2)[0][1]},
    ],
    ids=["positions of eta", "relativistic", "in a magnetic field"],
)
def test_what_has_no_canonical_coordinates_is_refused_in_a_sentence(change):
    with pytest.raises(BadInput, match=r"needs H = 1/2 p\^T M\^-1 p \+ U\(q\) and a chart whose positions depend on xi alone, which bead"):
        method("canonical:gauss2").solve(bead(**change), Request(value=0.01, steps=3))
    assert method("canonical:gauss2").solve(bead(), Request(value=0.01, steps=3)).failure is None


def test_a_start_where_the_angles_are_singular_is_refused_with_the_place():
    where = make_ivp(initial_value_problem("spherical_pendulum").source, "fig1.1", q0=[0, 0, -1], p0=[0.1, 0, 0])
    with pytest.raises(BadInput, match=r"chart of spherical_pendulum is singular at q = \[0.0, 0.0, -1.0\].* or leave out canonical:"):
        method("canonical:midpoint").solve(where, Request(value=0.01, steps=3))

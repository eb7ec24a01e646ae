"""No unit is special: a motion has the same digits in other units of length, mass and time, and Newton's iteration knows no length 1."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
import sympy as sp
from ivps import ONE_OF_EACH_KIND
from rescaled import CHANGES, difference, factors, options, rescaled

from daebench.compiler.definition import source_of
from daebench.diagnostics.consistency import projected
from daebench.diagnostics.symplecticity import tangent_basis, tangent_map
from daebench.methods.fixed_step.constrained import FixedStep
from daebench.methods.fixed_step.poisson import PoissonStep
from daebench.methods.initial_value_problem import initial_value_problem
from daebench.methods.registry import poisson_registry, registry
from daebench.runs.make_ivp import make_ivp
from daebench.runs.request import Request
from daebench.runs.scales import constrained_scales, poisson_scales
from daebench.schemes.kernels import newton as iteration
from daebench.systems.constrained import Case, ConstrainedHamiltonian, coordinates

PLACES = {
    "slow": ("spherical_pendulum", "fig1.1"),
    "fast": ("spherical_pendulum", "fig1.2b"),
    "three links": ("pendulum_chain", "hanging", {"links": 3}),
}
FORMS = [(name, form) for name in ("midpoint", "gauss2", "rk4") for form in ("local", "canonical", "baumgarte", "stiff")]
METHODS = [(name, "") for name in registry() if name != "seproj"] + FORMS + [("se", "canonical")]
ROUNDED = ("radau2_ggl", "radau3_ggl", "ggl_vi", "ggl_vi_mod")
"""Their two multipliers have different units, so that another order of pivots is chosen: the same to round-off, and not to the bit."""


@cache
def place(name):
    return initial_value_problem(*PLACES[name])


def run(ivp, scheme, form, h, change="", steps=10, **more):
    method = FixedStep(scheme, form=form, options=options(form, change) if change else {}, compiled=False)
    return method.solve(ivp, Request(value=h, steps=steps, watch=(), count=False, **more)).complete()


@pytest.mark.sampled(
    by=lambda case: case.endswith("-fast") and case.startswith((*ONE_OF_EACH_KIND, "local:rk4", "stiff:gauss2", "canonical:se"))
)
@pytest.mark.parametrize("where", PLACES)
@pytest.mark.parametrize(("scheme", "form"), METHODS, ids=[f"{form}:{name}" if form else name for name, form in METHODS])
def test_a_motion_has_the_same_digits_in_other_units(scheme, form, where):
    ivp, h = place(where), 1e-4 if form == "stiff" else 0.01
    if why := FixedStep(scheme, form=form).refusal(ivp):
        pytest.skip(why)
    here = run(ivp, scheme, form, h)
    for change in CHANGES:
        there = run(rescaled(ivp, change), scheme, form, h * factors(change)[2], change)
        assert difference(here, there, change) <= (1e-14 if scheme in ROUNDED else 0.0), change


def seen_from_its_edge(radius):
    """A circle through the origin, where a mass starts at rest: all terms of g are larger than q by as much as one likes."""
    q, p = coordinates(2)
    R = sp.Symbol("R", positive=True)
    circle = ConstrainedHamiltonian(
        q=q,
        p=p,
        M=sp.eye(2),
        U=q[1],
        g=[(q[0] + R) ** 2 + q[1] ** 2 - R**2],
        parameters={R: 1.0},
        cases={"edge": Case(q=(0, 0), p=(0, 1))},
    )
    return make_ivp(source_of(circle, "circle from its edge"), "edge", {"R": radius})


@pytest.mark.parametrize("power", [-20, 0, 10])
def test_a_motion_through_the_origin_of_its_coordinates_is_solved(power):
    radius = 2.0**power
    ivp = seen_from_its_edge(radius)
    for scheme in ("rattle", "lobatto3", "implicit_euler", "midpoint"):
        for h in (2.0**-10, 1.0):
            request = Request(value=h * min(1.0, radius) / 8, steps=30, watch=("manifold",))
            assert FixedStep(scheme, compiled=False).solve(ivp, request).failure is None, scheme


def test_a_length_is_that_of_the_problem():
    for power in (-30, 0, 30):
        length, rate = constrained_scales(seen_from_its_edge(2.0**power), 2.0 ** (power - 4), rated=True)
        assert 2.0 ** (power - 8) < length < 2.0 ** (power + 1)
        assert rate > 0
    assert poisson_scales(replace(initial_value_problem("lotka_volterra"), y0=np.array([3e-9, -4e-9])), 0.1)[0] == 4e-9


@pytest.mark.parametrize("scheme", ["rattle", "lobatto3", "implicit_euler", "midpoint"])
def test_single_precision_and_tangent_maps_know_no_unit_either(scheme):
    ivp, h, method = place("fast"), 0.01, FixedStep(scheme, compiled=False)
    X = tangent_basis(ivp, ivp.p0, ivp.q0)
    single, A = run(ivp, scheme, "", h, precision="float32"), tangent_map(method.flow(ivp, h, 3), ivp.p0, ivp.q0, X)
    for change in CHANGES:
        L, M, T = factors(change)
        other, D = rescaled(ivp, change), np.repeat([M * L / T, L], ivp.d)[:, None]
        carried = tangent_map(method.flow(other, h * T, 3), other.p0, other.q0, D * X)
        assert np.array_equal(carried, D * A), change
        if change in ("long", "short", "heavy", "light"):
            there = run(other, scheme, "", h * T, precision="float32")
            assert difference(single, there, change) == 0, change


@pytest.mark.parametrize("scheme", ["seproj", "midpoint+proj", "rk4+symproj"])
def test_a_projection_has_a_unit_of_time_and_none_of_length_or_mass(scheme):
    name, _, projection = scheme.partition("+")
    method = FixedStep(name, projection=projection, compiled=False)
    ivp, request = place("fast"), Request(value=0.01, steps=15, watch=())
    here = method.solve(ivp, request).complete()
    for change in ("long", "short", "heavy", "light"):
        assert difference(here, method.solve(rescaled(ivp, change), request).complete(), change) == 0
    slow = method.solve(rescaled(ivp, "slow"), replace(request, value=0.01 * factors("slow")[2])).complete()
    assert difference(here, slow, "slow") > 0


@pytest.mark.parametrize("scheme", poisson_registry())
@pytest.mark.parametrize("power", [-30, 30])
def test_a_poisson_system_that_scales_has_the_same_digits(scheme, power):
    ivp, method = initial_value_problem("free_rigid_body"), PoissonStep(scheme, anyway=True, compiled=False)
    if why := method.refusal(ivp):
        pytest.skip(why)
    size = 2.0**power
    heavy = replace(ivp, y0=ivp.y0 * size, parameters={name: value * size for name, value in ivp.parameters.items()})
    here, there = (method.solve(each, Request(value=0.1, steps=30, watch=())).complete() for each in (ivp, heavy))
    assert np.array_equal(there.y, here.y * size)


@pytest.mark.parametrize("change", CHANGES)
def test_initial_values_are_projected_alike_in_all_units(change):
    ivp = place("fast")
    off = replace(ivp, q0=ivp.q0 * 1.25, p0=ivp.p0 + 0.5)
    here, there = (projected(each)[0] for each in (off, rescaled(off, change)))
    assert np.allclose(there.q0 / factors(change)[0], here.q0, rtol=1e-15, atol=0)
    L, M, T = factors(change)
    assert np.allclose(there.p0 / (M * L / T), here.p0, rtol=1e-14, atol=0)


# ---- the bound within which an iteration that stagnates has converged ----------------------------------------------------


@pytest.mark.parametrize("roundings", [2.0, 1e2, 9e3, 1.1e4, 1e5, 1e7, 1e9, 1e12])
@pytest.mark.parametrize("scale", [1e-9, 1.0, 1e6])
def test_an_iteration_that_stagnates_has_converged_only_within_1e4_roundings(roundings, scale, monkeypatch):
    for name, value in {"EPS": 2.0**-52, "INF": np.inf, "tally": lambda improve, sweeps: ()}.items():
        monkeypatch.setattr(iteration, name, value)
    floor = roundings * 2.0**-52 * scale

    def halved(x, data):
        return x / 2, max(x / 2, floor), scale, x, 1.0

    _, (status, *_) = iteration.newton(halved, scale, ())
    assert status == (iteration.OK if roundings <= 1e4 else iteration.NOT_CONVERGED)

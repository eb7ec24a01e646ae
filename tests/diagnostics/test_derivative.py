"""Derivatives of maps: a complex step is believed where differences agree with it, and nowhere else."""

import warnings

import numpy as np
import pytest
from ivps import ivp
from measures import error_of
from refusals import refused

from daebench.diagnostics.derivative import DerivativeWarning
from daebench.diagnostics.poisson import poisson_defect
from daebench.diagnostics.symplecticity import symplecticity_defect, tangent_map
from daebench.errors import RunFailed
from daebench.methods.fixed_step.constrained import FixedStep

H = 0.1
P, Q = np.array([0.3, -0.4]), np.array([0.9, 0.2])
SCALES = [(1.0, 1.0), (1e-9, 1e-20), (1e6, 1e-3)]
"""Units of q and p."""


def force(q):
    """Of two anharmonic oscillators that are coupled."""
    return -q - q**3 - (0.3 + 0.2 * np.cos(q[0] * q[1])) * q[::-1]


def leapfrog(f):
    def step(p, q):
        p_half = p + H / 2 * f(q)
        q1 = q + H * p_half
        return p_half + H / 2 * f(q1), q1

    return step


def explicit(f):
    """Euler's method, which is not symplectic."""
    return lambda p, q: (p + H * f(q), q + H * p)


def midpoint(tolerance):
    """The implicit midpoint rule by fixed-point iteration that ends on its real part."""

    def step(p, q):
        p1, q1 = p, q
        for _ in range(200):
            p2, q2 = p + H * force((q + q1) / 2), q + H * (p + p1) / 2
            change = max(np.max(np.abs(np.real(p2 - p1))), np.max(np.abs(np.real(q2 - q1))))
            p1, q1 = p2, q2
            if change <= tolerance:
                break
        return p1, q1

    return step


def newton(tolerance, part=lambda x: x):
    """Symplectic Euler for p' = f(q) (1 + p^2/10), implicit in p, by Newton's iteration that ends on real parts, or is one of them."""

    def step(p, q):
        p1 = part(p)
        for _ in range(20):
            r = part(p1 - p - H * force(q) * (1 + p1**2 / 10))
            dp = r / part(1 - H * force(q) * p1 / 5)
            p1 = p1 - dp
            if np.max(np.abs(np.real(dp))) <= tolerance:
                break
        p1 = p + H * force(q) * (1 + p1**2 / 10)
        return p1, q + H * p1

    return step


def barely_dropped(q):
    """One small coupling loses its imaginary part: 1e-6 of the derivative."""
    return force(q) + 1e-5 * np.real(q[0]) * np.array([0.0, 1.0])


def into_real_array(q):
    out = np.empty(2)
    out[:] = force(q)
    return out


DROPPING = {
    "np.real": lambda q: np.real(force(q)),
    "float()": lambda q: np.array([float(x) for x in force(q)]),
    "into a real array": into_real_array,
    "astype": lambda q: force(q).astype(float),
    "abs()": lambda q: -np.abs(-force(q)) * np.sign(-np.real(force(q))),
    "partly": lambda q: np.where([True, False], np.real(force(q)), force(q)),
    "barely": barely_dropped,
}
J = np.block([[np.zeros((2, 2)), np.eye(2)], [-np.eye(2), np.zeros((2, 2))]])


def in_units(step, unit_q, unit_p):
    """The same map of positions and momenta in other units."""

    def scaled(p, q):
        p1, q1 = step(p / unit_p, q / unit_q)
        return p1 * unit_p, q1 * unit_q

    return scaled


def exactly(step):
    """Its derivative, by a complex step of the map that computes in complex numbers throughout."""
    x = np.concatenate([P, Q])
    columns = [np.concatenate(step(*np.split(x + 1e-30j * e, 2))) for e in np.eye(4)]
    return np.imag(columns).T / 1e-30


@pytest.mark.parametrize("step", [leapfrog(force), explicit(force), midpoint(0.0)], ids=["leapfrog", "explicit", "midpoint"])
def test_a_complex_step_is_believed_where_it_is_right(step):
    for unit_q, unit_p in SCALES:
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            found = tangent_map(in_units(step, unit_q, unit_p), P * unit_p, Q * unit_q, np.diag([unit_p] * 2 + [unit_q] * 2))
        D = np.repeat([unit_p, unit_q], 2)[:, None]
        assert np.allclose(found / D, exactly(step), rtol=1e-13, atol=1e-14), (unit_q, unit_p)


@pytest.mark.parametrize("kind", DROPPING)
@pytest.mark.parametrize(("method", "symplectic"), [(leapfrog, True), (explicit, False)], ids=["leapfrog", "explicit"])
def test_a_map_that_drops_imaginary_parts_is_differentiated_by_differences(kind, method, symplectic):
    honest = force if kind != "barely" else lambda q: force(q) + 1e-5 * q[0] * np.array([0.0, 1.0])
    for unit_q, unit_p in SCALES:
        step = in_units(method(DROPPING[kind]), unit_q, unit_p)
        with pytest.warns(DerivativeWarning, match=r"by differences, with an error of up to \d"):
            found = tangent_map(step, P * unit_p, Q * unit_q, np.diag([unit_p] * 2 + [unit_q] * 2))
        D = np.repeat([unit_p, unit_q], 2)[:, None]
        assert error_of(found / D, exactly(method(honest))) < 1e-8, (unit_q, unit_p)
    with pytest.warns(DerivativeWarning):
        defect = symplecticity_defect(method(DROPPING[kind]), P, Q, np.eye(4))
    small = 2e-6 if kind == "barely" else 1e-8
    assert defect < small if symplectic else defect > 1e-3


@pytest.mark.parametrize("method", [midpoint, newton])
def test_an_iteration_that_ends_on_its_real_part_is_differentiated_as_it_is_computed(method):
    for tolerance in (1e-1, 1e-2, 1e-4, 1e-7, 1e-10):
        step = method(tolerance)
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            assert np.array_equal(tangent_map(step, P, Q, np.eye(4)), exactly(step)), tolerance


def test_an_iteration_of_real_numbers_inside_a_complex_map_is_seen():
    step = newton(0.0, np.real)
    assert error_of(exactly(step), exactly(newton(0.0))) > 1e-4
    with pytest.warns(DerivativeWarning, match="drops imaginary parts"):
        found = tangent_map(step, P, Q, np.eye(4))
    assert error_of(found, exactly(newton(0.0))) < 1e-9


def test_what_dropping_did_to_the_defect():
    """It was 1 for a symplectic map, and nothing for one that is not: with its force real, Euler's method is a shear."""
    for method, symplectic in ((leapfrog, True), (explicit, False)):
        step = method(DROPPING["np.real"])
        naive = exactly(step)
        with pytest.warns(DerivativeWarning):
            defect = symplecticity_defect(step, P, Q, np.eye(4))
        assert defect < 1e-9 if symplectic else defect > 1e-3
        assert symplectic or np.linalg.norm(naive.T @ J @ naive - J, 2) < 1e-14


def test_a_poisson_map_that_drops_imaginary_parts_is_one():
    def turned(y):
        c, s = np.cos(0.3 * np.real(y[2])), np.sin(0.3 * np.real(y[2]))
        return np.array([c * y[0] + s * y[1], c * y[1] - s * y[0], y[2]])

    def B(y):
        return np.array([[0, -y[2], y[1]], [y[2], 0, -y[0]], [-y[1], y[0], 0]])

    y = np.array([0.5, -0.2, 0.7])
    with pytest.warns(DerivativeWarning, match="drops imaginary parts"):
        assert poisson_defect(turned, y, B) < 1e-9


def test_a_map_that_neither_way_can_differentiate_is_refused():
    rough = np.random.default_rng(5)

    def noisy(p, q):
        return np.real(p) + 1e-3 * rough.standard_normal(2), np.real(q)

    with refused("map-not-differentiable"):
        symplecticity_defect(noisy, P, Q, np.eye(4))


def test_a_failure_of_the_map_is_its_own():
    def stops(p, q):
        raise RunFailed("it stopped.")

    with pytest.raises(RunFailed, match="it stopped"):
        tangent_map(stops, P, Q, np.eye(4))

    def at_its_limit(p, q):
        if np.max(np.abs(np.real(q) - Q)) > 1e-4:
            raise RunFailed("there is no solution.")
        return leapfrog(force)(p, q)

    assert np.array_equal(tangent_map(at_its_limit, P, Q, np.eye(4)), exactly(leapfrog(force)))

    def broken(p, q):
        raise KeyError("left out")

    with pytest.raises(KeyError):
        tangent_map(broken, P, Q, np.eye(4))


@pytest.mark.parametrize("name", ["rattle", "midpoint", "rk4"])
def test_maps_of_our_own_are_believed(name):
    where, believed = ivp("spherical-fast"), 0
    for h in (1e-4, 0.01, 0.1):
        flow = FixedStep(name, compiled=False).flow(where, h, 4)
        try:
            flow(where.p0, where.q0)
        except RunFailed:
            continue  # there is no solution at this step size
        with warnings.catch_warnings():
            warnings.simplefilter("error", DerivativeWarning)
            tangent_map(flow, where.p0, where.q0, np.eye(6))
        believed += 1
    assert believed >= 2

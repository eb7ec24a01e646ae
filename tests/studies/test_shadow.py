"""Shadow Hamiltonians: Verlet's on an oscillator in closed form, orders by halving h, what collapses and what does not, what is refused."""

import numpy as np
import pytest
from refusals import refused

import daebench
from daebench.diagnostics.shadow import shadow_hamiltonian
from daebench.errors import RunFailed
from daebench.studies.shadow import actions_of, shadow

W, H, STEPS = 1.3, 0.1, 300


@pytest.fixture(scope="module")
def oscillator():
    """Verlet on H = (p^2 + W^2 q^2) / 2: states, actions, and its modified Hamiltonian in closed form."""
    p, q = [0.4], [1.0]
    for _ in range(STEPS):
        half = p[-1] - H / 2 * W**2 * q[-1]
        q.append(q[-1] + H * half)
        p.append(half - H / 2 * W**2 * q[-1])
    p, q = np.array(p)[:, None], np.array(q)[:, None]
    actions = np.diff(q[:, 0]) ** 2 / (2 * H) - H / 4 * W**2 * (q[1:, 0] ** 2 + q[:-1, 0] ** 2)
    squeezed = 1 - (W * H / 2) ** 2
    exact = 2 / H * np.arcsin(W * H / 2) / (W * np.sqrt(squeezed)) * (p[0, 0] ** 2 + W**2 * squeezed * q[0, 0] ** 2) / 2
    return p, q, actions, exact


@pytest.mark.parametrize("order", [2, 4, 6, 8, 10])
def test_verlet_on_an_oscillator_has_its_closed_form(oscillator, order):
    p, q, actions, exact = oscillator
    energy = (p[:, 0] ** 2 + W**2 * q[:, 0] ** 2) / 2
    found = shadow_hamiltonian(p, q, actions, H, order)
    assert len(found) == STEPS + 1 - order
    assert np.abs(found - exact).max() < 3 * (W * H) ** order
    if order >= 8:
        assert np.abs(found - exact).max() < 1e-4 * np.ptp(energy)


@pytest.mark.parametrize(
    ("problem", "case", "h", "t_end"),
    [
        ("planar_pendulum", "horizontal", 0.1, 20.0),
        pytest.param("spherical_pendulum", "fig1.2", 0.02, 4.0, marks=pytest.mark.exhaustive),
        pytest.param("double_pendulum", "swing", 0.05, 10.0, marks=pytest.mark.exhaustive),
    ],
    ids=["planar", "spherical", "double"],
)
def test_range_falls_with_h_to_the_order(problem, case, h, t_end):
    coarse, fine = (shadow(problem, case=case, method="rattle", h=step, t_end=t_end, orders=[4, 6]).ranges for step in (h, h / 2))
    for order in (4, 6):
        assert np.log2(coarse[order] / fine[order]) == pytest.approx(order, abs=0.5)
        assert coarse[order] < 0.1 * coarse[order - 2 if order > 4 else 0]


@pytest.mark.slow
def test_energy_that_rattle_keeps_is_one_of_rounding_and_that_of_se_seproj_midpoint_is_not():
    asked = {"case": "fig1.1", "h": 0.05, "t_end": 50.0, "orders": [8]}
    for method in ("rattle", "symplectic_euler", "shake", "symplectic_euler_adjoint"):
        ranges = shadow("spherical_pendulum", method=method, **asked).ranges
        assert ranges[8] < 1e-12 < 1e-6 < ranges[0], method
    for method in ("se", "seproj", "midpoint"):
        run = shadow("spherical_pendulum", method=method, compare=True, **asked)
        assert run.ranges[8] > 1e-6
        assert not run.derived


@pytest.mark.slow
def test_mass_that_depends_on_the_position_is_no_obstacle():
    ranges = shadow("slider_crank", method="rattle", h=1e-3, t_end=0.5, orders=[2, 4, 8]).ranges
    assert ranges[8] < 1e-4 * ranges[0]


def test_scheme_without_a_derivation_is_refused():
    for method in ("se", "lobatto3", "rattle/suzuki4", "strang", "rk4"):
        with refused("method-without-shadow"):
            actions_of(method, compare=False)


def test_requests_that_cannot_be_met_are_refused():
    for code, problem, more in (
        ("shadow-order-not-even", "planar_pendulum", {"orders": [3]}),
        ("too-few-steps-for-shadow", "planar_pendulum", {"orders": [20]}),
        ("shadow-system-unsuitable", "lotka_volterra", {}),
        ("shadow-system-unsuitable", "car_axis", {}),
    ):
        with refused(code):
            daebench.shadow(problem, method="rattle", h=0.1, t_end=1.0, **more)
    with refused("shadow-run-failed", RunFailed):
        daebench.shadow("spherical_pendulum", case="fig1.2", method="se", h=0.01, t_end=5.0, compare=True)

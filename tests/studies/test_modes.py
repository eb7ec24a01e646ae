"""Small oscillations against closed forms, linearised equations of IDA's own residuals, and the known limits of steps."""

import numpy as np
import pytest
import sympy as sp
from refusals import refused
from scipy.linalg import eig, eigh

import daebench
from daebench.methods.formulations.constrained import pose
from daebench.studies.modes.equilibrium import equilibrium
from daebench.systems.constrained import Case, ConstrainedHamiltonian


def chain_frequencies(masses, lengths, gravity):
    """Return the natural frequencies of a plane chain of rods without mass that hangs, in angles: M_ij = m l_i l_j, K_ii = m l_i g."""
    below, lengths = np.cumsum(masses[::-1])[::-1], np.array(lengths)
    M = np.minimum.outer(below, below) * np.outer(lengths, lengths)
    return np.sqrt(eigh(np.diag(below * lengths * gravity), M, eigvals_only=True))


def test_frequencies_of_a_double_pendulum_and_of_a_chain_are_those_in_angles():
    spherical = daebench.modes("spherical_pendulum", parameters={"mass": 2.5, "length": 0.7, "gravity": 3.0}, methods=())
    assert spherical.frequencies == pytest.approx([(3.0 / 0.7) ** 0.5] * 2, rel=1e-12)
    double = daebench.modes("double_pendulum", parameters={"mass1": 2.0, "mass2": 0.3, "length1": 0.5, "length2": 1.7}, methods=())
    gravity = double.ivp.parameters["gravity"]
    assert double.frequencies == pytest.approx(chain_frequencies([2.0, 0.3], [0.5, 1.7], gravity), rel=1e-11)
    chain = daebench.modes("pendulum_chain", parameters={"links": 5}, methods=())
    at = chain.ivp.parameters
    expected = chain_frequencies([at["mass"]] * 5, [at["length"]] * 5, at["gravity"])
    assert chain.frequencies == pytest.approx(expected, rel=1e-11)


def test_formulations_have_the_zeros_of_their_drift_and_baumgarte_has_its_roots(double):
    found = double
    m, frequencies = found.ivp.m, found.frequencies
    counted = {name: row["zeros"] for name, row in found.summary()["formulations"].items()}
    assert counted == {"index3": 0, "index2": m, "index1": 2 * m, "ggl": 0, "ode": 2 * m, "baumgarte": 0, "penalty": 0}
    for name in ("index3", "index2", "index1", "ggl", "ode", "baumgarte"):
        for w in frequencies:
            assert np.min(np.abs(found.spectra[name] - 1j * w)) < 1e-9 * w
    roots = np.roots([1, 6, 25])
    others = [x for x in found.spectra["baumgarte"] if np.min(np.abs(x - 1j * np.concatenate([frequencies, -frequencies]))) > 1e-6]
    assert len(others) == 2 * m
    assert max(np.min(np.abs(x - roots)) for x in others) < 1e-6
    slow = np.sort(np.abs(found.spectra["penalty"].imag))[: 2 * len(frequencies) : 2]
    assert slow == pytest.approx(frequencies, rel=1e-3)  # off by a share 1/stiff of the rods' own softness


@pytest.fixture(scope="module")
def double():
    return daebench.modes("double_pendulum", alpha=3.0, beta=5.0, stiff=1e8, methods=())


@pytest.mark.sampled(left_out=("index2", "index1"))
@pytest.mark.parametrize("name", ["index3", "index2", "index1", "ggl", "baumgarte"])
def test_eigenvalues_are_those_of_the_equations_that_ida_is_given(double, name, plain_functions):
    """The pencil of dF/dy and dF/dy' has them and, of what is algebraic, infinite ones, which round-off makes large."""
    ivp = daebench.initial_value_problem("double_pendulum", q0=double.rest.q, p0=np.zeros(double.ivp.d))
    dae = pose(ivp, name, {"alpha": 3.0, "beta": 5.0} if name == "baumgarte" else {})
    y = np.asarray(dae.y0, dtype=float)
    A, both = np.zeros((2, len(y), len(y)))
    for cj, J in ((0.0, A), (1.0, both)):
        dae.jacobian(0.0, y, np.zeros_like(y), np.empty_like(y), cj, J, dae.par)
    values = eig(-A, both - A, right=False)
    near = values[np.isfinite(values) & (np.abs(values) < 1e3)]
    for x in double.spectra[name]:
        assert np.min(np.abs(near - x)) < 1e-5 * max(1.0, abs(x))


def test_limits_of_steps_are_those_of_the_oscillator():
    """RATTLE and symplectic Euler: h w < 2; the classical Runge-Kutta method: |R(i x)| <= 1 up to sqrt 8; implicit Euler has none.

    Two-stage Gauss collocation grows nowhere, but its fixed-point iteration ends below h w = sqrt 12.
    """
    known = {"rattle": 2.0, "symplectic_euler": 2.0, "rk4": 8**0.5, "implicit_euler": np.inf}
    found = daebench.modes("planar_pendulum", parameters={"gravity": 9.0}, methods=(*known, "local:gauss2"))
    limits = {name: limit * found.frequencies[-1] for name, limit in found.steps.items()}
    assert 2 < limits.pop("local:gauss2") < np.sqrt(12)
    assert limits == pytest.approx(known, rel=1e-4)


def without_rest():
    """Return a bead on a slope that has no end."""
    x, y, px, py = sp.symbols("x y px py", real=True)
    cases = {"sliding": Case(q=(0, 0), p=(0, 0))}
    return ConstrainedHamiltonian(q=(x, y), p=(px, py), M=sp.eye(2), U=x, g=[y - x / 2], cases=cases)


def test_a_problem_without_a_position_of_rest_and_others_are_refused():
    cases = {"no-equilibrium": without_rest(), "modes-of-few-positions": "lotka_volterra", "modes-need-potential": "arevalo"}
    for code, problem in cases.items():
        with refused(code):
            daebench.modes(problem)


def test_free_directions_are_zeros_and_the_start_need_not_be_at_rest():
    found = daebench.modes("torus", methods=())
    assert found.rest.residual < 1e-9
    again = equilibrium(found.ivp)
    assert np.array_equal(again.q, found.rest.q)


@pytest.mark.sampled(left_out=("mass--40", "gravity-40", "length-12", "mass-40"))
@pytest.mark.parametrize(
    ("name", "power"), [("mass", -40), ("mass", 40), ("gravity", -40), ("gravity", 40), ("length", -30), ("length", 12)]
)
def test_a_pendulum_of_any_size_hangs_and_swings_at_its_frequency(name, power):
    found = daebench.modes("planar_pendulum", parameters={name: 2.0**power}, methods=["rattle"])
    values = found.ivp.parameters
    assert found.rest.q == pytest.approx([0, -values["length"]], abs=1e-9 * values["length"])
    assert np.sqrt(found.squares) == pytest.approx([np.sqrt(values["gravity"] / values["length"])], rel=1e-9)
    assert found.rest.lam == pytest.approx([values["mass"] * values["gravity"] / 2 / values["length"]], rel=1e-6)

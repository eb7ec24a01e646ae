"""Derivatives of runs of fixed-step schemes: against closed forms, complex step, and what a tangent map must keep."""

import mpmath as mp
import numpy as np
import pytest
import sympy as sp
from differentiated import by_complex_step, derivatives, states
from swinging import errors_of_swing, released, slopes, swing

import daebench
from daebench import Case, ConstrainedHamiltonian
from daebench.errors import BadInput

ALL = ["length", "gravity", "p0", "q0"]
SWING = {"problem": "planar_pendulum", "case": "horizontal", "method": "rattle"}
ROUND_OFF = 1e-12


def falling(**settings):
    return daebench.run(**SWING, sensitivities=ALL, **settings)


def test_derivatives_of_a_pendulum_are_those_of_its_closed_form():
    settings = SWING | {"method": "rattle/kahan_li8"} | released(1.0)
    run = daebench.run(**settings, h=0.05, t_end=5, every=25, sensitivities=ALL)
    assert run.failure is None
    assert errors_of_swing(run, 1.0).max() < 1e-8


def test_a_start_that_a_parameter_leaves_behind_is_moved_along_the_normal():
    """The horizontal start is (1, 0) for any length, and is put back at (length, 0): that of the closed form with both lengths changed."""
    run = falling(h=0.002, t_end=2, every=500)
    for n, t in enumerate(run.t[1:], start=1):
        by_length = slopes(lambda length, t=t: swing(mp.pi / 2, length, 1, mp.mpf(float(t))), 1)
        assert np.abs(run.sensitivities["length"]["q"][n] - by_length).max() < 1e-5
    assert run.sensitivities["length"]["q"][0].tolist() == [1, 0]


def test_the_derivative_converges_with_the_order_of_the_scheme():
    exact = slopes(lambda gravity: swing(mp.pi / 2, 1, gravity, mp.mpf(2)), 1)
    errors = [np.abs(falling(h=h, t_end=2, every=0).sensitivities["gravity"]["q"][-1] - exact).max() for h in (0.08, 0.04, 0.02, 0.01)]
    orders = np.diff(np.log(errors)) / np.log(0.5)
    assert np.abs(orders - 2).max() < 0.1


def test_about_a_pendulum_at_rest_the_tangent_of_rattle_is_that_of_verlet():
    """Values are then found at once, and derivatives are not: dq1(t_n)/dq0_1 = cos(n phi) with cos phi = 1 - h^2/2."""
    run = falling(q0=[0.0, -1.0], p0=[0.0, 0.0], h=0.3, steps=200)
    phi = np.arccos(1 - 0.3**2 / 2)
    assert np.abs(run.q[:, 0]).max() == 0
    assert np.abs(run.sensitivities["q0"]["q"][:, 0, 0] - np.cos(phi * np.arange(201))).max() < ROUND_OFF


@pytest.mark.slow
@pytest.mark.exhaustive
def test_about_a_pendulum_at_rest_the_tangent_of_lobatto_has_settled_too():
    """Its iteration leaves out derivatives; the oracle is the same scheme for x'' = -x, solved as one linear system."""
    A = np.array([[0, 0, 0], [5 / 24, 1 / 3, -1 / 24], [1 / 6, 2 / 3, 1 / 6]])
    A_hat = np.array([[1 / 6, -1 / 6, 0], [1 / 6, 1 / 3, 0], [1 / 6, 5 / 6, 0]])
    h, b, one = 0.3, np.array([1 / 6, 2 / 3, 1 / 6]), np.ones(3)
    X = np.linalg.solve(np.eye(3) + h * h * A @ A_hat, np.stack([one, h * A @ one], axis=1))
    P = np.stack([0 * one, one], axis=1) - h * A_hat @ X
    step = np.eye(2) + h * np.stack([b @ P, -b @ X])
    run = daebench.run(**SWING | {"method": "lobatto3"}, q0=[0.0, -1.0], p0=[0.0, 0.0], h=h, steps=100, sensitivities=["q0", "p0"])
    x0 = np.array([1.0, 0.0])
    exact = np.array([np.linalg.matrix_power(step, n) @ x0 for n in range(101)])
    assert np.abs(run.sensitivities["q0"]["q"][:, 0, 0] - exact[:, 0]).max() < ROUND_OFF
    assert np.abs(run.sensitivities["q0"]["p"][:, 0, 0] - exact[:, 1]).max() < ROUND_OFF


def two_form_change(method):
    """Return by how much the two-form of tangent vectors changes along a run, relative to the vectors."""
    run = daebench.run(**SWING | {"method": method}, h=0.1, steps=100, every=100, sensitivities=["p0", "q0"])
    X = derivatives(run)
    J = np.block([[np.zeros((2, 2)), -np.eye(2)], [np.eye(2), np.zeros((2, 2))]])
    before, after = (x.T @ J @ x for x in X)
    return np.abs(after - before).max()


def test_the_tangent_of_a_symplectic_scheme_keeps_the_two_form_and_that_of_another_does_not():
    assert two_form_change("rattle") < ROUND_OFF
    assert two_form_change("se") > 1e-3


@pytest.mark.slow
def test_a_start_that_leaves_the_manifold_is_put_back_on_it_and_the_run_stays_there():
    """The start of fig1.2 does not move with the length: it is moved along the normal, and g = q.q - length^2 stays zero."""
    run = daebench.run("spherical_pendulum", case="fig1.2", method="rattle", h=0.01, t_end=2, sensitivities=["length", "mass"])
    dq, dp = (run.sensitivities["length"][part] for part in "qp")
    assert np.abs(dq[0] - run.q[0]).max() < ROUND_OFF
    assert np.abs(2 * np.einsum("ni,ni->n", run.q, dq) - 2).max() < ROUND_OFF * 1e3
    assert np.abs(np.einsum("ni,ni->n", dq, run.p) + np.einsum("ni,ni->n", run.q, dp)).max() < ROUND_OFF * 1e3


@pytest.mark.sampled(left_out=("p0",))
@pytest.mark.parametrize(
    "name", ["p0", *(pytest.param(name, marks=[pytest.mark.slow, pytest.mark.exhaustive]) for name in ("crank", "q0"))]
)
def test_derivatives_at_the_start_are_those_of_starts_that_are_projected(name):
    """The oracle is the iteration of ``project``, for starts and parameters on either side."""
    where = {"problem": "slider_crank", "case": "turning"}
    ivp = daebench.initial_value_problem(**where)

    def start(**changed):
        moved = daebench.initial_value_problem(**where, **changed, project=True)
        return np.concatenate([moved.p0, moved.q0])

    def quotient(changed):
        one, two = ((start(**changed(s)) - start(**changed(-s))) / (2 * s) for s in (1e-4, 2e-4))
        return (4 * one - two) / 3

    if name == "crank":
        slopes = [quotient(lambda s: {"parameters": {"crank": ivp.parameters["crank"] + s}})]
    else:
        values = getattr(ivp, name)
        slopes = [quotient(lambda s, unit=unit: {name: values + s * unit}) for unit in np.eye(len(values))]
    run = daebench.run(**where, method="rattle", h=0.01, steps=1, sensitivities=[name])
    assert np.abs(derivatives(run)[0] - np.array(slopes).T).max() < 1e-9


@pytest.mark.slow
def test_parameters_in_the_expressions_of_a_start_are_differentiated():
    a, gamma = sp.symbols("steepness gravity", positive=True)
    q, p = sp.symbols("q1:3", real=True), sp.symbols("p1:3", real=True)
    bead = ConstrainedHamiltonian(
        q=q,
        p=p,
        M=sp.eye(2),
        U=gamma * q[1],
        g=[q[1] - a * q[0] ** 2],
        parameters={a: 1.5, gamma: 9.81},
        cases={"left": Case(q=(-1, a), p=(0, 0), about="")},
    )
    run = daebench.run(bead, method="rattle", h=0.01, steps=20, sensitivities=["steepness"])
    assert np.abs(run.sensitivities["steepness"]["q"][0] - [0, 1]).max() < ROUND_OFF
    end = by_complex_step(bead, ["steepness"], method="rattle", h=0.01, steps=20)
    assert np.abs(derivatives(run)[-1] - end).max() < ROUND_OFF


def held_against_complex_step(problem, names, *, case=None, **settings):
    """Hold derivatives, values, maxima and work of a run against complex step, and against a run without derivatives."""
    plain = daebench.run(problem, case=case, every=settings["steps"], **settings)
    run = daebench.run(problem, case=case, every=settings["steps"], sensitivities=names, **settings)
    assert run.failure is None
    assert np.array_equal(states(run), states(plain))
    assert (run.maxima, run.work, run.pivot) == (plain.maxima, plain.work, plain.pivot)
    expected = by_complex_step(problem, names, case=case, **settings)
    scale = np.maximum(np.abs(expected).max(axis=0), 1e-300)
    assert (np.abs(derivatives(run)[-1] - expected) / scale).max() < 1e-10


@pytest.mark.slow
def test_rattle_agrees_with_complex_step_to_the_bits_of_its_values():
    held_against_complex_step("spherical_pendulum", ["mass", "length", "gravity", "q0"], case="fig1.2", method="rattle", h=0.01, steps=1000)


SCHEMES = [
    "symplectic_euler",
    "symplectic_euler_adjoint",
    "shake",
    "se",
    "seproj",
    "implicit_euler",
    "lobatto3",
    "lobatto6",
    "gauss2",
    "midpoint",
    "rk4",
    "generalized_alpha",
    "energy_momentum",
    "lie",
    "lie_adjoint",
    "strang",
    "rattle_gauss_seidel",
    "radau2_index2",
    "radau2_ggl",
    "rattle/suzuki4",
    "midpoint+symproj",
    "rk4+proj",
    "local:midpoint",
    "canonical:se",
    "baumgarte:rk4",
]


def swept(rows, *kept):
    """Return rows as slow tests, of which all but some are for the day of a release: each compiles a kernel of dual numbers."""
    names = [row if isinstance(row, str) else row[0] for row in rows]
    marks = [[pytest.mark.slow] if name in kept else [pytest.mark.slow, pytest.mark.exhaustive] for name in names]
    cells = [(row,) if isinstance(row, str) else row for row in rows]
    return [pytest.param(*row, id=name, marks=mark) for row, name, mark in zip(cells, names, marks, strict=True)]


@pytest.mark.sampled(left_out=("rk4+proj",))
@pytest.mark.parametrize("method", swept(SCHEMES, "rk4+proj"))
def test_every_scheme_agrees_with_complex_step(method):
    names = ["mass", "gravity", "q0"]
    held_against_complex_step("spherical_pendulum", names, case="fig1.2", method=method, h=0.01, steps=30)


@pytest.mark.slow
@pytest.mark.exhaustive
def test_compensated_sums_are_differentiated():
    settings = {"case": "fig1.2", "method": "rattle", "h": 0.01, "steps": 100, "compensated": True}
    held_against_complex_step("spherical_pendulum", ["mass", "gravity"], **settings)


PROBLEMS = [
    ("slider_crank", "turning", "rattle", ["crank", "rod", "slider_mass", "gravity"], 0.005),
    ("four_bar", "iftomm", "rattle", ["mass", "length", "gravity"], 0.01),
    ("butane", "trans", "rattle", ["C0", "bond", "angle", "methyl"], 0.01),
    ("torus", "trough", "rattle", ["radius", "tube", "q0"], 0.01),
    ("rigid_body_rotation", "heavy_top", "rattle", ["I1", "gravity"], 0.001),
    ("double_pendulum", "swing", "lobatto4", ["mass1", "length2", "p0"], 0.01),
    ("two_bodies_on_sphere", "gni", "rattle", ["mass1", "strength"], 0.01),
]


@pytest.mark.sampled(left_out=("slider_crank",))
@pytest.mark.parametrize(("problem", "case", "method", "names", "h"), swept(PROBLEMS, "slider_crank"))
def test_every_kind_of_problem_agrees_with_complex_step(problem, case, method, names, h):
    held_against_complex_step(problem, names, case=case, method=method, h=h, steps=20)


@pytest.mark.parametrize("scheme", swept(["rattle", "symplectic_euler", "lobatto2", "energy_momentum", "gauss2"]))
@pytest.mark.parametrize("place", ["stretched-M", "stretched-H"])
def test_a_hamiltonian_that_is_not_separable_agrees_with_complex_step(place, scheme, get_ivp):
    where = get_ivp(place)
    held_against_complex_step(where, [*where.parameters, "q0"], method=scheme, h=0.01, steps=20)


@pytest.mark.slow
@pytest.mark.exhaustive
def test_redundant_constraints_solved_by_least_squares_agree_with_complex_step():
    held_against_complex_step("four_bar", ["mass", "gravity"], method="rattle", h=0.01, steps=20, on_singular="least-squares")


POISSON = [
    ("free_rigid_body", "strang", {}),
    ("free_rigid_body", "midpoint", {"anyway": True}),
    ("lotka_volterra", "symplectic_euler", {}),
    ("lotka_volterra", "verlet/suzuki4", {}),
    ("lotka_volterra", "darboux:verlet", {}),
    ("heavy_top_lie_poisson", "rk4", {"anyway": True}),
]


@pytest.mark.sampled(
    left_out=(
        "free_rigid_body-strang",
        "lotka_volterra-symplectic_euler",
    )
)
@pytest.mark.parametrize(
    ("problem", "method", "more"),
    [
        pytest.param(*row, id=f"{row[0]}-{row[1]}", marks=[pytest.mark.slow, *[pytest.mark.exhaustive] * (i != 2)] if i else ())
        for i, row in enumerate(POISSON)
    ],
)
def test_poisson_systems_agree_with_complex_step(problem, method, more):
    parameters = list(daebench.initial_value_problem(problem).parameters)[:2]
    held_against_complex_step(problem, [*parameters, "y0"], method=method, h=0.005, steps=30, **more)


# ---- runs that do not come to their end ----------------------------------------------------------------------------------


@pytest.mark.filterwarnings("ignore::daebench.errors.LostMotion")
def test_a_run_that_stops_keeps_the_derivatives_so_far():
    settings = {"problem": "spherical_pendulum", "case": "fig1.2", "method": "se", "h": 0.01, "steps": 1000}
    plain, run = daebench.run(**settings), daebench.run(**settings, sensitivities=["gravity"])
    assert run.failure == plain.failure
    assert run.failure is not None
    assert np.array_equal(run.q, plain.q)
    assert run.sensitivities["gravity"]["q"].shape == run.q.shape
    shorter = daebench.run(**settings | {"steps": run.steps}, sensitivities=["gravity"])
    assert np.array_equal(shorter.sensitivities["gravity"]["q"], run.sensitivities["gravity"]["q"])


def test_derivatives_that_overflow_end_a_run_whose_values_are_finite():
    """A pendulum that stands on its head stays there; what is next to it leaves it as exp(t)."""
    run = falling(q0=[0.0, 1.0], p0=[0.0, 0.0], h=0.1, steps=8000, every=1000)
    assert "derivatives of the states are no longer finite" in run.failure
    assert 700 < run.t[-1] < 720
    assert np.isfinite(derivatives(run)).all()


def test_output_of_the_end_alone_has_the_derivatives_of_start_and_end():
    whole, end = falling(h=0.1, steps=15), falling(h=0.1, steps=15, every=0)
    assert np.array_equal(derivatives(end), derivatives(whole)[[0, -1]])
    some = falling(h=0.1, steps=15, every=10)
    assert np.array_equal(derivatives(some), derivatives(whole)[[0, 10, 15]])


# ---- what is refused -----------------------------------------------------------------------------------------------------

REFUSED = [
    ({"sensitivities": ["gravty"]}, "unknown parameter or initial value of planar_pendulum to differentiate by 'gravty'"),
    ({"sensitivities": ["y0"]}, "did you mean q0 or p0"),
    ({"sensitivities": ["gravity", "gravity"]}, "gravity is given twice"),
    ({"problem": "pendulum_chain", "case": None, "sensitivities": ["links"]}, "links of pendulum_chain is a whole number"),
    ({"method": "cvode:bdf", "h": None, "steps": None, "tol": 1e-8, "t_end": 1}, "cvode:bdf has no sensitivities; schemes of"),
    ({"method": "ida:ode", "h": None, "steps": None, "tol": 1e-8, "t_end": 1}, "it has no equations for lam; use ida:index2"),
    ({"method": lambda p, q, h: (p, q)}, "has no sensitivities"),
    ({"problem": "pendulum_chain", "case": None, "parameters": {"links": 20}}, "are arrays; choose fewer of its bodies or sites"),
    ({"precision": "float32"}, "float32 has too few digits"),
]


@pytest.mark.parametrize(("changed", "sentence"), REFUSED, ids=[sentence[:30] for _, sentence in REFUSED])
def test_what_cannot_be_differentiated_is_refused_in_a_sentence(changed, sentence):
    with pytest.raises(BadInput, match=sentence):
        daebench.run(**{**SWING, "h": 0.1, "steps": 1, "sensitivities": ["gravity"]} | changed)

"""Step limits at rest against eigenvalues of equations that are linearised here, and the known stability of schemes on an oscillator."""

import numpy as np
import pytest
import sympy as sp
from refusals import refused
from scipy.linalg import eigh, null_space

import daebench
from daebench.studies.modes.step_limit import METHODS
from daebench.systems.constrained import Case, ConstrainedHamiltonian

FACTORS = {"rattle": 2.0, "symplectic_euler": 2.0, "rk4": 8**0.5, "lobatto3": 8**0.5}
"""h omega at which a step on x'' = -omega^2 x ceases to be stable: |trace| = 2 of the symplectic ones, |R(i y)| = 1 of rk4."""


def natural_frequencies(definition, q, values):
    """Return omega of the modes that oscillate, and the number of free ones: by derivatives of U + lam^T g that SymPy takes here."""
    symbols, g = list(definition.q), sp.Matrix(definition.g)
    numbers = {symbol: values[symbol.name] for symbol in definition.parameters} if definition.parameters else {}
    at = numbers | dict(zip(symbols, map(float, q), strict=True))
    number = lambda matrix: np.array(sp.Matrix(matrix).subs(at).evalf(17), dtype=float)  # noqa: E731
    force, G = number(sp.Matrix([definition.U]).jacobian(symbols)).ravel(), number(g.jacobian(symbols))
    lam = np.linalg.lstsq(G.T, -force, rcond=None)[0]
    assert np.max(np.abs(force + G.T @ lam)) < 1e-7 * max(1.0, np.max(np.abs(force)))
    K = number(sp.hessian(definition.U + (sp.Matrix(list(map(float, lam))).T * g)[0], symbols))
    free = null_space(G)
    squares = eigh(free.T @ K @ free, free.T @ number(definition.M) @ free, eigvals_only=True)
    oscillates = squares > 1e-9 * squares[-1]
    return np.sqrt(squares[oscillates]), int(np.sum(~oscillates))


def require_limits(found, fastest, rel=1e-4):
    assert found.steps == pytest.approx({name: FACTORS[name] / fastest for name in found.steps}, rel=rel)


def masses_on_a_line(*, wall: float = 1.0, middle: float = 1.0, last: float = 1.0) -> ConstrainedHamiltonian:
    """Return four masses on a line, the last two tied to each other, on springs to a wall and between them."""
    k = sp.symbols("wall middle last", real=True)
    q, p = sp.symbols("x1:5", real=True), sp.symbols("p1:5", real=True)
    x1, x2, x3, x4 = q
    return ConstrainedHamiltonian(
        q=q,
        p=p,
        M=sp.diag(1, 2, 1, 3),
        U=(k[0] * x1**2 + k[1] * (x2 - x1) ** 2 + k[2] * (x3 - x2) ** 2) / 2,
        g=[x4 - x3 - 1],
        parameters=dict(zip(k, (wall, middle, last), strict=True)),
        cases={"pulled": Case(q=(0.1, 0.2, 0.3, 1.3), p=(0,) * 4)},
    )


def line_squares(wall, middle, last):
    """Return omega^2 in the three coordinates that the tie leaves, in extended precision."""
    K = sp.Matrix([[wall + middle, -middle, 0], [-middle, middle + last, -last], [0, -last, last]])
    roots = sp.Poly((sp.diag(1, sp.Rational(1, 2), sp.Rational(1, 4)) * K).charpoly().as_expr()).nroots(n=40, maxsteps=500)
    return np.sort([float(sp.re(root)) for root in roots])


STIFF = {"equal": (1, 1, 1), "1 to 1e6": (10**6, 1, 1), "1 to 1e8": (1, 1, 10**8), "free and stiff": (0, 10**6, 1)}


@pytest.mark.sampled(left_out=("equal", "1 to 1e6"))
@pytest.mark.parametrize("stiffnesses", STIFF.values(), ids=STIFF)
def test_limits_of_masses_on_a_line_are_those_of_their_known_eigenvalues(stiffnesses):
    names = ("wall", "middle", "last")
    found = daebench.modes(masses_on_a_line(), parameters=dict(zip(names, map(float, stiffnesses), strict=True)), methods=("rattle", "rk4"))
    squares = line_squares(*stiffnesses)
    free = stiffnesses[0] == 0
    assert np.sum(found.squares == 0) == free
    assert found.squares[int(free) :] == pytest.approx(squares[int(free) :], rel=1e-7)
    require_limits(found, squares[-1] ** 0.5)


CATALOGUE = ("spherical_pendulum", "double_pendulum", "four_bar_spring", "slider_crank", "rigid_water", "torus", "watt_six_bar")


@pytest.mark.slow
@pytest.mark.sampled(by=lambda case: case == "rigid_water")
@pytest.mark.parametrize("problem", CATALOGUE)
def test_limits_of_the_catalogue_are_those_of_its_linearised_equations(problem):
    import importlib

    found = daebench.modes(problem, methods=("rattle", "rk4"))
    definition = importlib.import_module(f"daebench.problems.{problem}").problem()
    frequencies, free = natural_frequencies(definition, found.rest.q, found.ivp.parameters)
    assert np.sum(found.squares <= 0) == free
    if problem == "rigid_water":
        assert frequencies[-1] == pytest.approx(4.46987, rel=1e-6)  # it is published
    assert found.frequencies[free:] == pytest.approx(frequencies, rel=1e-6)
    require_limits(found, frequencies[-1])


@pytest.mark.slow
def test_limits_of_two_hanging_four_bars_are_their_closed_form():
    """Three uniform bars turn and two are carried along: omega^2 = g (3/2 + 2) / (l (3/3 + 2))."""
    found = daebench.modes("four_bar", case="swing", methods=("rattle", "rk4"))
    at = found.ivp.parameters
    fastest = (7 / 6 * at["gravity"] / at["length"]) ** 0.5
    assert found.frequencies == pytest.approx([fastest], rel=1e-9)
    require_limits(found, fastest)


# ---- what is asked for before the work -----------------------------------------------------------------------------------


def test_a_solver_and_a_chart_that_is_not_there_are_refused_before_the_work(monkeypatch):
    monkeypatch.setattr("daebench.studies.modes.small_oscillations.equilibrium", lambda ivp: pytest.fail("the work has begun"))
    for name in ("ida:index2", "scipy:DOP853"):
        with refused("step-limit-unusable"):
            daebench.modes("planar_pendulum", methods=("rattle", name))
    with refused("step-limit-unusable"):
        daebench.modes(masses_on_a_line(), methods=("local:gauss2",))


@pytest.mark.slow
def test_a_problem_without_a_chart_has_the_limits_of_the_other_methods():
    found = daebench.modes(masses_on_a_line())
    assert list(found.steps) == [name for name in METHODS if not name.startswith("local:")]
    assert found.left_out == {}
    known = {name: limit for name, limit in found.steps.items() if name in FACTORS}
    assert known == pytest.approx({name: FACTORS[name] / line_squares(1, 1, 1)[-1] ** 0.5 for name in known}, rel=1e-4)


def test_a_chart_that_is_singular_at_rest_is_left_out_with_the_reason():
    found = daebench.modes("spherical_pendulum", methods=("rattle", "local:gauss2"))
    assert found.steps == pytest.approx({"rattle": 2.0}, rel=1e-4)
    assert "is singular at q" in found.left_out["local:gauss2"]


@pytest.mark.slow
def test_where_nothing_oscillates_there_is_no_limit():
    found = daebench.modes("four_bar", methods=("rattle",))
    assert found.squares == pytest.approx([-11.445], rel=1e-9)
    assert found.steps == {"rattle": float("inf")}

"""Python that is made to be read: it needs NumPy alone, computes what daebench computes, and is a page to teach from."""

import importlib.util
import itertools
import subprocess
import sys

import numpy as np
import pytest
from measures import error_of

import daebench
from daebench.methods.initial_value_problem import initial_value_problem
from daebench.pages.generation import algebra
from daebench.reference.solution import reference_solution
from daebench.schemes.kernels import newton as kernel

PAIRS = [
    ("spherical_pendulum", "rattle", 0.01),
    ("spherical_pendulum", "shake", 0.01),
    ("spherical_pendulum", "rattle/suzuki4", 0.01),
    ("spherical_pendulum", "gauss3+proj", 0.01),
    ("spherical_pendulum", "strang", 0.01),
    ("double_pendulum", "lobatto3", 0.005),
    ("double_pendulum", "baumgarte:rk4", 0.005),
    ("slider_crank", "lobatto3", 0.001),
    ("slider_crank", "generalized_alpha", 0.001),
    ("arevalo", "rattle", 0.001),
    ("car_axis", "rattle", 1e-4),
    ("double_wishbone", "rattle", 0.001),
]
"""Pairs: H that separates, with an inverse of M, with time, without any form; memories, compositions, projections, stages, joints."""
IDS = [f"{problem}-{method}" for problem, method, _ in PAIRS]
GATE = (
    "spherical_pendulum-rattle/suzuki4",
    "spherical_pendulum-gauss3+proj",
    "slider_crank-generalized_alpha",
    "car_axis-rattle",
)
"""One of each structure: compositions, projections, stages, accelerations that are kept, an inverse of M, time."""
ALONE = "import sys; sys.modules['daebench'] = None; sys.path.insert(0, '.'); "


def module(folder, problem, method, h, **settings):
    """Return a generated file, imported."""
    daebench.generate(problem, method, folder, h=h, language="python", name="own", **settings)
    specification = importlib.util.spec_from_file_location("own", folder / "own.py")
    made = importlib.util.module_from_spec(specification)
    specification.loader.exec_module(made)
    return made


@pytest.mark.usefixtures("uncompiled_schemes")
@pytest.mark.sampled(by=lambda case: case in GATE)
@pytest.mark.parametrize(("problem", "method", "h"), PAIRS, ids=IDS)
def test_it_runs_without_daebench_and_agrees_with_a_run_to_round_off(problem, method, h, tmp_path):
    own = module(tmp_path / "code", problem, method, h)
    assert "made to be read" in own.__doc__
    both = ALONE + "import runpy; runpy.run_path('own.py', run_name='__main__'); print('check'); exec(open('check.py').read())"
    out = subprocess.run([sys.executable, "-c", both], cwd=tmp_path / "code", capture_output=True, text=True, check=True).stdout
    printed, _, checked = out.partition("check\n")
    assert (len(printed.splitlines()), checked.count("good")) == (12, 5)
    s = own.Integrator()
    assert s.run(h, 50) == 0
    run = daebench.run(problem, method=method, h=h, steps=50, every=50)
    for found, expected in ((s.q, run.q[-1]), (s.p, run.p[-1]), (s.lam, initial_value_problem(problem).along("lam", run.p, run.q)[-1])):
        assert np.allclose(found, expected, rtol=1e-10, atol=1e-10 * np.abs(expected).max())


@pytest.mark.usefixtures("uncompiled_schemes")
def test_it_computes_in_single_precision_where_that_is_asked_for(tmp_path):
    own = module(tmp_path / "code", "spherical_pendulum", "rattle", 0.005, precision="float32")
    s = own.Integrator()
    assert s.run(0.005, 50) == 0
    assert s.q.dtype == s.p.dtype == s.lam.dtype == np.float32
    run = daebench.run("spherical_pendulum", method="rattle", h=0.005, steps=50, every=50, precision="float32")
    assert np.abs(s.q - run.q[-1]).max() < 1e-4
    subprocess.run([sys.executable, "check.py"], cwd=tmp_path / "code", capture_output=True, check=True)


@pytest.mark.usefixtures("plain_functions")
@pytest.mark.sampled(by=lambda case: "rattle" in case)
@pytest.mark.parametrize(
    ("problem", "method", "end", "first", "order"),
    [("spherical_pendulum", "rattle", 1.0, 10, 2), ("double_pendulum", "lobatto3", 0.2, 4, 4)],
)
def test_order_constraints_and_energy_are_as_claimed(problem, method, end, first, order, tmp_path):
    own = module(tmp_path / "code", problem, method, end / first / 8)
    exact, errors = reference_solution(initial_value_problem(problem), [end]).states["q"][0], []
    for steps in (first, 2 * first, 4 * first):
        s = own.Integrator()
        H = [s.energy]
        for _ in range(steps):
            assert s.step(end / steps) == 0
            H.append(s.energy)
            assert np.abs(np.concatenate([s.g, s.gv])).max() < 1e-13
        errors.append((error_of(s.q, exact), error_of(H, H[0])))
    orders = np.log2(np.divide(errors[:-1], errors[1:]))
    assert np.all(np.abs(orders - order) < 0.4), orders


def test_a_start_off_the_manifold_is_made_consistent(tmp_path):
    own = module(tmp_path / "code", "slider_crank", "rattle", 0.001)
    s = own.Integrator()
    own.par.crank = 1.1
    assert s.init(s.q + np.array([0.01, 0.02, 0]), [1.0, 2.0, 3.0]) == 0
    assert np.abs(np.concatenate([s.g, s.gv])).max() < 1e-14
    assert s.run(0.001, 10) == 0
    assert np.abs(s.g).max() < 1e-14
    s.q = np.zeros(3)
    assert s.step(0.001) == own.SINGULAR
    assert "singular" in s.message


def test_elimination_exchanges_rows_and_tells_how_near_to_singular_a_matrix_is():
    A = np.array([[0.0, 1.0, 2.0], [1.0, 1e3, 0.0], [2.0, 1.0, 1.0]])
    x, rows, pivot = algebra.solve(A, np.arange(3.0), A.T)
    assert np.allclose(A @ x, np.arange(3.0), atol=1e-12)
    assert np.allclose(rows, np.eye(3), atol=1e-12)
    assert pivot > 0.1
    A[0] = A[1] + A[2]
    with np.errstate(all="ignore"):
        _, pivot = algebra.solve(A, np.arange(3.0))
    assert algebra.judge(0.0, pivot, 1.0) == algebra.SINGULAR
    assert algebra.judge(np.nan, 1.0, 1.0) == algebra.judge(0.0, 1.0, np.inf) == algebra.NOT_FINITE


def test_its_newton_ends_where_that_of_the_schemes_does(monkeypatch):
    for name, value in {"EPS": algebra.EPS, "INF": np.inf, "tally": lambda *_: (0,)}.items():  # filled in for each problem
        monkeypatch.setattr(kernel, name, value, raising=False)

    def ending(newton, sizes):
        def update(x, _):
            return x + 1, (sizes[x] if x < len(sizes) else sizes[-1]), 1.0, 1.0, 1.0

        x, report = newton(update, 0, None)
        return x, report[0]

    for first, roundings in itertools.product([1.5, 1.0, 0.99, 1.01], [1e6, 1.01e4, 9.9e3, 4.04, 3.96]):
        size = roundings * algebra.EPS
        for sizes in ((first * size, size), (first * size, size, size), (10 * first * size, first * size, size)):
            assert ending(algebra.newton, sizes) == ending(kernel.newton, sizes), (first, roundings)

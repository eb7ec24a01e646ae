"""Python that is made to be read: it needs NumPy alone, computes what daebench computes, and is a page to teach from."""

import ast
import importlib.util
import itertools
import re
import subprocess
import sys

import numpy as np
import pytest

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
    ("problem", "method", "h", "order"), [("spherical_pendulum", "rattle", 0.1, 2), ("double_pendulum", "lobatto3", 0.05, 4)]
)
def test_order_constraints_and_energy_are_as_claimed(problem, method, h, order, tmp_path):
    own = module(tmp_path / "code", problem, method, h / 8)
    end = 1.0 if problem == "spherical_pendulum" else 0.2
    exact = reference_solution(initial_value_problem(problem), [end]).states["q"][0]
    errors, energies = [], []
    for steps in (round(end / h), 2 * round(end / h), 4 * round(end / h)):
        s, H = own.Integrator(), []
        for _ in range(steps):
            assert s.step(end / steps) == 0
            H.append(s.energy)
            assert np.abs(np.concatenate([s.g, s.gv])).max() < 1e-13
        errors.append(np.abs(s.q - exact).max())
        energies.append(np.abs(np.array(H) - own.Integrator().energy).max())
    for measured in (errors, energies):
        orders = np.log2(np.array(measured[:-1]) / measured[1:])
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


@pytest.mark.parametrize(("problem", "method", "h"), [PAIRS[0], PAIRS[5]], ids=[IDS[0], IDS[5]])
def test_it_is_a_page_to_teach_from(problem, method, h, tmp_path):
    daebench.generate(problem, method, tmp_path / "code", h=h, language="python", name="own")
    text = (tmp_path / "code" / "own.py").read_text()
    functions = [node for node in ast.walk(ast.parse(text)) if isinstance(node, ast.FunctionDef) and not node.name.startswith("_")]
    assert all(ast.get_docstring(node) or node.name == "update" for node in functions)
    assert {"H", "H_p", "g", "G", "step", "increment", "newton", "solve"} <= {node.name for node in functions}
    assert max(node.end_lineno - node.lineno for node in functions) < 40
    assert max(len(line) for line in text.splitlines() if not re.match(r'    \d: "', line)) <= 150
    assert "HLW (1.9)" in text
    assert "q1     = q0 + h M^-1 p_half" in text or "Q_i = q0 + h sum_j a_ij H_p(P_j, Q_j)" in text
    assert f"par.{next(iter(initial_value_problem(problem).parameters))}" in text
    for word in ("Vector", "tally", "plus_work", "no_work", "on_branch", "walked", "daebench.schemes"):
        assert word not in text


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


def test_newton_ends_at_round_off_and_says_so_if_it_does_not():
    def update(x, a):
        change = (x * x - a) / (2 * x)
        return x - change, abs(change), abs(x), abs(x * x - a), 1.0

    x, report = algebra.newton(update, 1.0, 2.0)
    assert report[0] == algebra.OK
    assert abs(x - np.sqrt(2.0)) <= algebra.EPS
    assert algebra.newton(lambda x, _: (-x, 1.0, 1.0, 1.0, 1.0), 1.0, 0.0)[1][0] == algebra.NOT_CONVERGED


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

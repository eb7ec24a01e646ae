"""Lanes: their arithmetic against that of doubles, and functions rewritten without branches against the functions themselves."""

import inspect

import numpy as np
import pytest
from recorded import compiled

from daebench.compiler.linear.kernels import array_solver
from daebench.errors import InvalidProblem

W, EPS = 4, 2.0**-52
SPECIAL = np.array([0.0, -0.0, 1.0, -2.5, np.inf, -np.inf, np.nan, 5e-324, 1e308, 3.0, 0.1, -7.0])


def mixture(x, y, z):
    """Something of everything that kernels do with numbers."""
    first = x + y * z - x / y
    second = max(x, y, z) - min(x, y, 2.0) + abs(-z) ** 0.5
    third = sqrt(abs(x)) + sin(y) * exp(-abs(z)) + 2 * x + arctan2(x, y) + tanh(z)  # noqa: F821 - names of a generated module
    return first, second, third, max(y, x), min(z, 1.0), x**3.0


def placed(text, name, forms, results):
    """Return a compiled function that reads W runs from an array, calls another and writes what it returns into a second array."""
    call = f"""
def call(numbers, output, counts):
    live = take_all(0, counts, 0, 0, {W}) == 0
    put_all(output, 0, 0, live, {name}(*take_all({forms}, numbers, 0, 0, {W})))
"""
    together = compiled(f"LANES = {W}\nINF = numpy.inf\n\n{text}\n{call}", "call")

    def run(numbers):
        output = np.empty((results, W))
        together(np.ascontiguousarray(numbers), output, np.zeros((1, W), dtype=np.int64))
        return output

    return run


def test_each_lane_computes_what_a_double_does_to_the_bit():
    text = inspect.getsource(mixture)
    alone, together = compiled(text, "mixture"), placed(text, "mixture", (0.0, 0.0, 0.0), 6)
    rng = np.random.default_rng(0)
    for turn in range(60):
        numbers = rng.standard_normal((3, W)) if turn % 2 else rng.choice(SPECIAL, (3, W))
        expected = np.array([alone(*map(float, column)) for column in numbers.T]).T
        assert np.array_equal(together(numbers), expected, equal_nan=True)
        assert np.array_equal(np.signbit(together(numbers)[3:5]), np.signbit(expected[3:5]))


def exchanged(x, y, z):
    if abs(x) < abs(y):
        x, y = y, x
        z = z + 1.0
    elif z > 0.0:
        x = 2.0 * x
    else:
        y = y - 1.0
    return x, y, z if x == x and not z < 0.0 else -z


def judged(x, y, z):
    if not x < 1.0:
        return 3.0, x
    if y > z or y < -1.0:
        z = z - y
        return 2.0, z
    return 0.0 if z < 5.0 else 1.0, z


def iterated(x, y, z):
    last, change = 1e300, 1e300
    for k in range(1, 20):
        x = 0.5 * (x + y / x)
        change = abs(x * x - y)
        if not change < 1e10:
            return 3.0, x, change + k
        if change <= 1e-12 * y or (change >= last and change < 1e-9):
            return 0.0, x, change + k
        last = change
    return 1.0, x, last


def nested(x, y, z):
    if x > 0.0:
        if y > 0.0:
            if z != z:
                return 5.0, y
            return x, z
        z = 1.0 - z
    else:
        y = y + 2.0
    for k in range(3):
        if y < z:
            x = x + k
            for _ in range(2):
                y = y + 1.0
    return x, y


def stopped(x, y, z):
    done = 0
    for k in range(1, 9):
        x = x + y
        done = k
        if k == 6:
            return 6.0, x, done
        if not x > -9.0:
            return 2.0, x, done
        if not x < 4.0:
            if z > 0.0:
                return 1.0, x, done
            z = z + 1.0
    return 0.0, x, done


FUNCTIONS = {
    function.__name__: (function, size) for function, size in ((exchanged, 3), (judged, 2), (iterated, 3), (nested, 2), (stopped, 3))
}


@pytest.mark.parametrize("name", FUNCTIONS)
def test_runs_that_take_different_branches_come_to_what_each_would_alone(name):
    function, size = FUNCTIONS[name]
    together, rng = placed(inspect.getsource(function), name, (0.0, 0.0, 0.0), size), np.random.default_rng(1)
    told = []
    for _ in range(100):
        numbers = rng.choice([-3.0, -1.0, -0.25, 0.0, 0.5, 1.0, 2.0, 7.0, np.nan], (3, W))
        with np.errstate(all="ignore"):
            expected = np.array([function(*column) for column in numbers.T]).T
        assert np.array_equal(together(numbers), expected, equal_nan=True)
        told += expected[0].tolist()
    assert len(set(told)) > 2


REFUSED = {
    "range": ("for _ in range(int(x)):\n        x = x + 1.0", "a loop over a range that differs from run to run"),
    "loops": ("for j in range(3):\n        for k in range(3):\n            if x > k:\n                return j", "within a loop"),
    "two": ("if x > 0.0:\n        return x\n    for k in range(3):\n        if x < k:\n            return k", "before an iteration"),
    "side": ("if x > 0.0:\n        y = x\n    x = y", "y is bound where one branch is taken and not where another is"),
    "all": ("for k in range(3):\n        if x < k:\n            return x\n        else:\n            return k", "all runs return"),
}


def test_what_cannot_be_done_for_several_runs_at_once_is_refused():
    for body, said in REFUSED.values():
        with pytest.raises(InvalidProblem, match=said):
            placed(f"def root(x):\n    {body}\n    return x", "root", (0.0,), 1)(np.zeros((1, W)))


def test_elimination_in_loops_takes_the_same_pivots_in_each_lane():
    n, rows = 5, 1
    source = array_solver("elimination", "solve", n, "float64", rows)
    vector = (0.0,) * n
    call = compiled(f"INF = numpy.inf\n\n{source}", "solve")
    run = placed(source, "solve", ((vector,) * n, vector, (vector,)), 2 * n + 1)
    rng, singular = np.random.default_rng(2), 0
    for turn in range(40):
        numbers = rng.standard_normal((n * n + 2 * n, W)) * 10.0 ** rng.integers(-6, 6, (n * n + 2 * n, 1))
        numbers = np.sign(numbers) * (np.abs(numbers) > 0.7) if turn % 3 == 0 else numbers
        results = run(numbers)
        for lane in range(W):
            entries = list(map(float, numbers[:, lane]))
            A = tuple(tuple(entries[i * n : i * n + n]) for i in range(n))
            b, X = tuple(entries[n * n : n * n + n]), (tuple(entries[n * n + n :]),)
            x, y, pivot = call(A, b, X)
            assert np.array_equal(results[:, lane], [*x, *y[0], pivot], equal_nan=True)
            singular += not pivot > 0
    assert 10 < singular < 60

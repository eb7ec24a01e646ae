"""SUNDIALS' example of a projected pendulum, cvPendulum_dns, by the way that CVODE is called here: every printed digit.

Its right side has |q| = 1 put in, x'' = -x T with T = |v|^2 - g y, which HLW (1.18) has not; it and its projection are written here once
more as C functions. What is printed is that of SUNDIALS 7.5.0, examples/cvode/serial/cvPendulum_dns.out: from (1, 0), at rest, gravity
such that the motion has period 2, errors at t = 30, where it is back at its start. The tolerances there are 1e-5 divided by 10, again and
again, which is not rounded to 1e-7: the last bit of |g| tells.
"""

import ctypes
import itertools
import math
import operator
from types import SimpleNamespace

import numpy as np
import pytest
from numba import carray, njit

from daebench.compiler import callbacks
from daebench.compiler.foreign import numbers_of_vector
from daebench.compiler.machine_code import callback
from daebench.methods.solvers.native import libraries, loop
from daebench.methods.solvers.native.memory import BDF, PLAIN, Settings, Solver

GRAVITY = 13.750371636040745654980191559621114395801712
T_END = 30.0

PRINTED = """
1e-5 YES  2.53e-06  2.25e-03  1.80e-04  8.01e-02  |  0.00e+00  |   1421     1663+96         96 ( 24)     |    0   11
1e-5 NO   5.61e-01  8.98e-01  4.26e+00  2.10e+00  |  6.19e-04  |   1549     1757+112       114 ( 28)     |    0   40
1e-6 YES  1.07e-07  4.64e-04  9.25e-06  1.99e-02  |  0.00e+00  |   2089     2336+140       120 ( 35)     |    0    5
1e-6 NO   1.68e-03  5.74e-02  5.77e-02  1.00e+00  |  7.05e-05  |   2221     2502+156       167 ( 39)     |    0   39
1e-7 YES  3.04e-09  7.79e-05  2.73e-07  3.51e-03  |  2.22e-16  |   3013     3293+204       170 ( 51)     |    0    5
1e-7 NO   2.58e-04  3.45e-02  1.61e-02  1.11e+00  |  6.77e-04  |   3236     3526+228       202 ( 57)     |    0   38
1e-8 YES  9.43e-11  1.37e-05  8.22e-09  5.99e-04  |  0.00e+00  |   4295     4728+292       236 ( 73)     |    0    6
1e-8 NO   9.55e-06  8.52e-03  3.38e-04  1.95e-01  |  5.35e-05  |   4600     4962+312       260 ( 78)     |    0   16
1e-9 YES  1.60e-12  1.79e-06  1.39e-10  7.79e-05  |  1.11e-16  |   6542     7056+436       346 (109)     |    0    5
1e-9 NO   1.39e-06  1.70e-03  1.12e-04  3.90e-02  |  5.67e-06  |   6661     7123+448       348 (112)     |    0    2
"""
TOLERANCES = list(itertools.accumulate([1e-5, *[10.0] * 4], operator.truediv))
ROWS = [line.split(maxsplit=2) for line in PRINTED.strip().splitlines()]


@njit
def vector(user, v):
    return carray(numbers_of_vector(user, v), 4)


@callback(callbacks.RIGHT_SIDE, error_model="numpy")
def right_side(t, y, out, user):
    y, out = vector(user, y), vector(user, out)
    tension = y[2] * y[2] + y[3] * y[3] - GRAVITY * y[1]
    out[0], out[1], out[2], out[3] = y[2], y[3], -y[0] * tension, -y[1] * tension - GRAVITY
    return 0


@callback(callbacks.PROJECTION, error_model="numpy")
def projection(t, y, correction, epsilon, error, user):
    y, correction, error = vector(user, y), vector(user, correction), vector(user, error)
    length = math.sqrt(y[0] * y[0] + y[1] * y[1])
    a, b = y[0] / length, y[1] / length
    correction[0], correction[1] = a - y[0], b - y[1]
    correction[2] = y[2] * b * b - y[3] * a * b - y[2]
    correction[3] = -y[2] * a * b + y[3] * a * a - y[3]
    for k in (0, 2):
        first, second = error[k], error[k + 1]
        error[k], error[k + 1] = b * b * first - a * b * second, -a * b * first + a * a * second
    return 0


@callback(callbacks.LOOK, error_model="numpy")
def look(t, y, user):
    return 0


COUNTS = ("NumSteps", "NumRhsEvals", "NumLinRhsEvals", "NumLinSolvSetups", "NumJacEvals", "NumNonlinSolvConvFails", "NumErrTestFails")


def counted(solver, names):
    """Return counters of CVODE, which the package does not all ask for."""
    library, numbers = ctypes.CDLL(libraries.paths()["cvode"]), []
    for name in names:
        number = ctypes.c_long()
        assert library[f"CVodeGet{name}"](solver.mem, ctypes.byref(number)) == 0
        numbers.append(number.value)
    return numbers


def run(tol, settings):
    """Return the state at the end, and CVODE's counters."""
    user, n = np.zeros(callbacks.HEAD), 4
    user[callbacks.UNKNOWNS] = n
    module = SimpleNamespace(rhs_callback=right_side, rhs_jacobian_callback=SimpleNamespace(address=None))  # differences, as in the example
    posed = SimpleNamespace(n=n, module=module, y0=np.array([1.0, 0.0, 0.0, 0.0]), yp0=np.zeros(n))
    t, times, rows = np.array([0.0, 0.0, 0.0, 0.0]), np.array([T_END]), np.empty((1, n))
    counts, kept = np.array([0, 0, 0, 1, 1]), np.empty((129, n))
    with Solver(posed, BDF, tol, np.full(n, tol), user, settings) as solver:
        solver("SetStopTime", T_END)
        calls = np.array([solver.step, solver.interpolation, look.address], np.uint64)
        state = solver.vectors, solver.y, t, times, rows, counts, kept, user
        reason = loop.compiled().advance(False, calls, solver.mem.value, *state, 10**6)
        assert reason == loop.ENDED
        return rows[0], counted(solver, COUNTS), counts[loop.STEPS]


@pytest.mark.parametrize(("tol", "projected", "printed"), ROWS, ids=[" ".join(row[:2]) for row in ROWS])
def test_every_printed_digit_of_the_example_of_sundials(tol, projected, printed):
    exact = min(TOLERANCES, key=lambda value: abs(value - float(tol)))
    y, counters, steps = run(exact, Settings(projection=projection) if projected == "YES" else PLAIN)
    errors = np.abs(y - [1.0, 0.0, 0.0, 0.0])
    text = "  ".join(f"{error:8.2e}" for error in errors) + f"  |  {abs(y[0] ** 2 + y[1] ** 2 - 1):8.2e}  |"
    text += " {:6d}   {:6d}+{:<4d}     {:4d} ({:3d})     |  {:3d}  {:3d}".format(*counters)
    assert text == printed
    assert steps == counters[0]

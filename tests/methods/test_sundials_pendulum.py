"""SUNDIALS' example of a projected pendulum, cvPendulum_dns, by the way that CVODE is called here: every printed digit.

Its right side has |q| = 1 put in, x'' = -x T with T = |v|^2 - g y, which HLW (1.18) has not; it and its projection are written here once
more as C functions. What is printed is that of SUNDIALS 7.5.0, examples/cvode/serial/cvPendulum_dns.out: from (1, 0), at rest, gravity
such that the motion has period 2, errors at t = 30, where it is back at its start. The tolerances there are 1e-5 divided by 10, again and
again, which is not rounded to 1e-7: the last bit of |g| tells.
"""

import ctypes
import itertools
import operator
from types import SimpleNamespace

import numpy as np
import pytest
from numpy import sqrt
from published import CVPENDULUM

from daebench.compiler import callbacks
from daebench.compiler.cache import generated, written
from daebench.compiler.callbacks import carray, numbers_of_vector
from daebench.compiler.syntax import text_of
from daebench.methods.solvers.native import libraries, loop
from daebench.methods.solvers.native.memory import BDF, PLAIN, Settings, Solver

GRAVITY = 13.750371636040745654980191559621114395801712
T_END = 30.0

TOLERANCES = list(itertools.accumulate([1e-5, *[10.0] * 4], operator.truediv))


def vector(user, v):
    return carray(numbers_of_vector(user, v), 4)


def rhs_callback(t, y, out, user):
    y, out = vector(user, y), vector(user, out)
    tension = y[2] * y[2] + y[3] * y[3] - GRAVITY * y[1]
    out[0], out[1], out[2], out[3] = y[2], y[3], -y[0] * tension, -y[1] * tension - GRAVITY
    return 0


def projection_callback(t, y, correction, epsilon, error, user):
    y, correction, error = vector(user, y), vector(user, correction), vector(user, error)
    length = sqrt(y[0] * y[0] + y[1] * y[1])
    a, b = y[0] / length, y[1] / length
    correction[0], correction[1] = a - y[0], b - y[1]
    correction[2] = y[2] * b * b - y[3] * a * b - y[2]
    correction[3] = -y[2] * a * b + y[3] * a * a - y[3]
    for k in (0, 2):
        first, second = error[k], error[k + 1]
        error[k], error[k + 1] = b * b * first - a * b * second, -a * b * first + a * a * second
    return 0


def look_callback(t, y, user):
    return 0


def compiled():
    """Return the module of these functions as machine code."""
    texts = [f"GRAVITY = {GRAVITY!r}", *map(text_of, (vector, rhs_callback, projection_callback, look_callback))]
    return generated("example_of_sundials", str(texts), lambda: written("The example of SUNDIALS.", (), texts))


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
    module = SimpleNamespace(
        rhs_callback=compiled().rhs_callback, rhs_jacobian_callback=SimpleNamespace(address=None)
    )  # differences, as in the example
    posed = SimpleNamespace(n=n, module=module, y0=np.array([1.0, 0.0, 0.0, 0.0]), yp0=np.zeros(n))
    t, times, rows = np.array([0.0, 0.0, 0.0, 0.0]), np.array([T_END]), np.empty((1, n))
    counts, kept = np.array([0, 0, 0, 1, 1, 0]), np.empty((129, n))
    with Solver(posed, BDF, tol, np.full(n, tol), user, settings) as solver:
        solver("SetStopTime", T_END)
        given = [array.ctypes.data for array in (solver.y[0], solver.y[1], t, user)]
        calls = np.array([solver.step, solver.interpolation, compiled().look_callback.address, *given], np.uint64)
        state = solver.vectors, solver.y, t, times, rows, counts, kept, user, None
        reason = loop.compiled().advance(False, calls, solver.mem.value, *state, 10**6)
        assert reason == loop.ENDED
        return rows[0], counted(solver, COUNTS), counts[loop.STEPS]


@pytest.mark.parametrize(("tol", "projected", "printed"), CVPENDULUM, ids=[" ".join(row[:2]) for row in CVPENDULUM])
def test_every_printed_digit_of_the_example_of_sundials(tol, projected, printed):
    exact = min(TOLERANCES, key=lambda value: abs(value - float(tol)))
    y, counters, steps = run(exact, Settings(projection=compiled().projection_callback) if projected == "YES" else PLAIN)
    errors = np.abs(y - [1.0, 0.0, 0.0, 0.0])
    text = "  ".join(f"{error:8.2e}" for error in errors) + f"  |  {abs(y[0] ** 2 + y[1] ** 2 - 1):8.2e}  |"
    text += " {:6d}   {:6d}+{:<4d}     {:4d} ({:3d})     |  {:3d}  {:3d}".format(*counters)
    assert text == printed
    assert steps == counters[0]

"""Callbacks of SUNDIALS: C functions made of generated ones, and the memory that they share with the loop over steps.

SUNDIALS passes the address of one array of doubles to every function that it calls. The first entries are addresses, read as words.
Counts, limits and the data of the monitor of steps follow. The numbers of the problem begin at ``HEAD``. Each function returns 0, or -1 if
the run cannot go on; ``WHY`` then holds the reason.
"""

from typing import Any

SINGULAR = 1e-14
"""Relative pivots up to this size are round-off: the matrix may be singular."""


def finite(health: float, values: Any) -> float:
    """Return ``health``, or NaN if any of the values, shape(k,), is not finite."""
    wrong = False
    for value in values:
        wrong |= value - value != 0.0  # true if infinite or NaN; no operation waits for the one before, as in a sum
    return float("nan") if wrong else health


def finite_matrix(health: float, matrix: Any) -> float:
    """Return ``health``, or NaN if any entry of a matrix, shape(n, k), is not finite."""
    wrong = False
    for row in matrix:
        for value in row:
            wrong |= value - value != 0.0
    return float("nan") if wrong else health


def _of_modules(*args: Any) -> Any:
    """Stand for a function of generated modules, which files that are written into them call."""
    raise NotImplementedError


carray = real_pointer = word_pointer = numbers_of_vector = _of_modules
"""An array of the numbers at an address; an address as that of doubles, or of words; the numbers of a vector of SUNDIALS, from the function
whose address is first in the memory of callbacks.
"""

ida_solve = cvode_solve = interpolate = ask = look = _of_modules
"""Functions of C, whose address is the first argument::

    int IDASolve(void *mem, double t_end, double *t, N_Vector y, N_Vector yp, int task)
    int CVode(void *mem, double t_end, N_Vector y, double *t, int task)
    int IDAGetDky(void *mem, double t, int order, N_Vector y)          and that of CVODE
    int IDAGetLastStep(void *mem, double *h)                           and others that return one property of a solver
    int look(double t, double *y, void *user)
"""

VECTOR, MATRIX, ORDER, BEFORE = range(4)
"""Words: addresses of two functions, for the numbers of a vector and of a matrix; of the order of unknowns; and of the state before."""

UNKNOWNS, PARAMETERS, WIDTH, ABOVE = range(4, 8)
"""Numbers of unknowns and of parameters; of a banded matrix, the distance between columns and the place of the diagonal."""

RESIDUALS, JACOBIANS, PROJECTIONS, MOST, SLOW, SPAN, MARK, WHY, HEALTH, WHEN = range(8, 18)
"""Counts of calls; limits of work as in :class:`daebench.runs.request.WorkLimit`; and why, with what and when the run cannot go on."""

TOLERANCE, POSITIONS, STEADY, LAST, SIGMA, LARGEST, EXPLAINED, MODE, CONSERVED, JUMPS, RESULT = *range(18, 27), 29, 32
"""Data and options of the monitor, see :mod:`daebench.methods.solvers.step_check`; the last three begin rows of 3, 3 and 4 numbers."""

STEP, OUTPUT, VALUES, CHANGES = range(4)
"""Modes of the monitor: check a step, check an output, return values, return the changes that the tolerance explains."""

LENGTH = 36
"""Place of the length of the initial value problem, see :mod:`daebench.runs.scales`."""

ARENA = 37
"""Word: the address of the memory of new arrays, see :class:`daebench.compiler.entry.Memory`."""

HEAD = 38
"""Place where the numbers of the problem begin."""

ILL, SPENT, CRAWLING = 1.0, 2.0, 3.0
"""Reasons: a value that is not finite or a singular matrix; too many calls; too little progress in time for the number of calls."""

SIGNATURES = {
    "residual_callback": "idpppp",
    "jacobian_callback": "iddpppppppp",
    "rhs_callback": "idppp",
    "rhs_jacobian_callback": "idppppppp",
    "look_callback": "idpp",
    "projection_callback": "idppdpp",
}
"""Types of C of the callbacks, by the name of the generated function: see :data:`daebench.compiler.trace.names.KINDS`."""

IMPLICIT = """
def residual_callback(t, y, yp, res, user):
    health = residual(t, {vector}(user, y), {n}), {vector}(user, yp), {n}), {vector}(user, res), {n}), {par})
    return noted(user, RESIDUALS, t, health)
"""

DENSE = """
def jacobian_callback(t, cj, y, yp, res, JJ, user, a, b, c):
    entries = farray(numbers_of_matrix(user, JJ), ({n}, {n}))
    health = jacobian(t, {vector}(user, y), {n}), {vector}(user, yp), {n}), {vector}(user, res), {n}), cj, entries, {par})
    return noted(user, JACOBIANS, t, health)
"""

BANDED = """
def jacobian_callback(t, cj, y, yp, res, JJ, user, a, b, c):
    own = carray(real_pointer(user), HEAD)
    entries = carray(numbers_of_matrix(user, JJ), ({n}, int(own[WIDTH])))
    health = jacobian(t, {vector}(user, y), {n}), {vector}(user, yp), {n}), cj, int(own[ABOVE]), entries, {par})
    return noted(user, JACOBIANS, t, health)
"""

EXPLICIT = """
def rhs_callback(t, y, out, user):
    return noted(user, RESIDUALS, t, rhs(t, {vector}(user, y), {n}), {vector}(user, out), {n}), {par}))
"""

EXPLICIT_DENSE = """
def rhs_jacobian_callback(t, y, out, JJ, user, a, b, c):
    entries = farray(numbers_of_matrix(user, JJ), ({n}, {n}))
    return noted(user, JACOBIANS, t, rhs_jacobian(t, {vector}(user, y), {n}), entries, {par}))
"""


def called_back(n: int, parameters: int, *texts: str) -> str:
    """Return the source of the C functions of a formulation with n unknowns and this many parameters, from some of the texts above."""
    par = f"carray(real_pointer(user), HEAD + {parameters})[HEAD:]"
    parts = {"n": n, "par": par, "vector": "carray(numbers_of_vector"}
    return "\n\n".join(text.format(**parts) for text in texts)


def noted(user: Any, which: int, t: float, health: float) -> int:
    """Count one evaluation at time t; return 0, or -1 if its health is bad or a limit of work is reached."""
    head = carray(real_pointer(user), HEAD)
    head[which] += 1.0
    if not health > SINGULAR:  # NaN is bad too
        head[WHY], head[HEALTH], head[WHEN] = ILL, health, t
        return -1
    if which != JACOBIANS:
        if head[which] > head[MOST]:
            head[WHY], head[WHEN] = SPENT, t
            return -1
        if head[SLOW] > 0.0 and head[which] % head[SLOW] == 0.0:
            if t - head[MARK] < head[SPAN]:
                head[WHY], head[WHEN] = CRAWLING, t
                return -1
            head[MARK] = t
    return 0

"""The source of the index-reduced ODE with multipliers by least squares, written beside the right side that the linker gives.

It is two modules: the right side in real numbers, and its Jacobian, by complex steps, in complex ones. The scheme language has the right
side for any type of numbers, so that no formula of the derivative of a least-squares solution is needed.
"""

from daebench.compiler import callbacks
from daebench.compiler.cache import Wrapper
from daebench.compiler.callbacks import DENSE, EXPLICIT, EXPLICIT_DENSE, called_back
from daebench.compiler.callbacks import IMPLICIT as IMPLICIT_CALLED_BACK
from daebench.compiler.syntax import function, pack, text_of
from daebench.methods.formulations.residuals import JACOBIAN, RESIDUAL

STEP = 1e-30
"""Imaginary part in which the Jacobian is carried: far below what the real part could notice."""

RATES = f"""
def rhs(t, y, out, par):
    return finite(right_side(y, out, par), out)

{RESIDUAL}
"""

SLOPES = f"""
def rhs_jacobian(t, y, JJ, par):
    n, health, lost = y.shape[0], numpy.inf, 0.0
    moved, column = numpy.empty(n, dtype=numpy.complex128), numpy.empty(n, dtype=numpy.complex128)
    for i in range(n):
        moved[i] = y[i]
    for j in range(n):
        moved[j] = complex(y[j], {STEP})
        pivot = right_side(moved, column, par)
        health, lost = min(health, pivot), lost + 0.0 * pivot
        moved[j] = y[j]
        for i in range(n):
            JJ[i, j] = column[i].imag / {STEP}
    return finite_matrix(health + lost, JJ)

{JACOBIAN}
"""
"""``lost`` is NaN where a pivot is: a minimum need not be."""

PARTS = {
    "float64": (RATES, ("rhs", "residual"), (EXPLICIT, IMPLICIT_CALLED_BACK)),
    "complex128": (SLOPES, ("rhs_jacobian", "jacobian"), (EXPLICIT_DENSE, DENSE)),
}
"""By the type of numbers: functions, the names of those that are called from Python, and what C calls."""


def written(precision: str, d: int, parameters: int, *, compiled: bool) -> Wrapper:
    """Return the functions beside the right side f in one type of numbers, for d positions and so many parameters."""
    functions, roots, called = PARTS[precision]
    texts = [_right_side(d, parameters), functions]
    if compiled:
        texts.append(called_back(2 * d, parameters, *called))
    return Wrapper("\n\n".join([text_of(callbacks.finite), text_of(callbacks.finite_matrix), *texts]), roots)


def _right_side(d: int, parameters: int) -> str:
    """Return the source of the function of (y, out, par) that fills out with (q', p') and returns the smallest pivot."""
    q, p = (pack(f"y[{i}]" for i in range(start, start + d)) for start in (0, d))
    par = pack(f"par[{k}]" for k in range(parameters))
    lines = [f"dp, dq, pivot = f({p}, {q}, {par})"]
    lines += [f"out[{i}], out[{d + i}] = dq[{i}], dp[{i}]" for i in range(d)]
    return function("right_side(y, out, par)", *lines, "return pivot")

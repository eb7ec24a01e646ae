"""Measures of a formulation's functions, which planted faults must upset."""

import numpy as np


def error_of(found, expected):
    """Return the largest difference of two arrays."""
    return np.abs(np.subtract(found, expected)).max()


def residual(dae, y, yp):
    res = np.empty(dae.n)
    dae.residual(0.0, y, yp, res, dae.par)
    return res


def right_side(dae, y):
    out = np.empty(dae.n)
    dae.rhs(0.0, y, out, dae.par)
    return out


def start_defect(dae):
    """Return the largest residual at the initial values, relative to the largest rate."""
    return np.abs(residual(dae, dae.y0, dae.yp0)).max() / max(1.0, np.abs(dae.yp0).max())


def multiplier_defect(dae):
    """Return how far the initial multiplier is from the one of HLW (1.12), as the kernels of the schemes have it."""
    lam = dae.ivp.value("lam", dae.ivp.p0, dae.ivp.q0)
    given = (dae.y0 if dae.multipliers == "plain" else dae.yp0)[dae.blocks["lam"]]
    return np.abs(given - lam).max() / max(1.0, np.abs(lam).max())


def somewhere(dae):
    """Return unknowns and rates off the manifold, where no term vanishes."""
    rng = np.random.default_rng(20)
    y, yp = dae.y0 + 0.1 * rng.uniform(-1, 1, dae.n), dae.yp0 + rng.uniform(-1, 1, dae.n)
    return y, yp


def differences(f, x, h=3e-3):
    """Return the derivative of f, of any shape, at x by central differences of order 6; its last index is that of x."""
    weights = {1: 3 / 4, 2: -3 / 20, 3: 1 / 60}
    columns = []
    for e in np.eye(len(x)):
        columns.append(sum(w * (f(x + k * h * e) - f(x - k * h * e)) for k, w in weights.items()) / h)
    return np.stack(columns, axis=-1)


def derivative_defect(f, x, claimed):
    """Return the largest error of the Jacobian that is claimed of f at x, relative to its largest entry.

    It is the smaller one of two steps of the differences: one that is too long for a function that bends much has truncation errors,
    one that is too short for a function of large terms has rounding errors.
    """
    found = [differences(f, x, h) for h in (3e-3, 7.5e-4)]
    return min(np.abs(claimed - each).max() / np.abs(each).max() for each in found)


def jacobian_defect(dae, cj=1.7):
    """Return the largest error of dF/dy + cj dF/dy', relative to its largest entry."""
    y, yp = somewhere(dae)
    JJ = np.full((dae.n, dae.n), np.nan)
    dae.jacobian(0.0, y, yp, np.empty(dae.n), cj, JJ, dae.par)

    return derivative_defect(lambda x: residual(dae, x, yp + cj * (x - y)), y, JJ)

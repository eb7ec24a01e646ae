"""The runs of a map: what stabilised and soft constraints make of energy, constraints and cost over a grid of their numbers.

Where a Runge-Kutta method is stable on g'' + 2 alpha g' + beta^2 g = 0 is said by the roots of s^2 + 2 alpha s + beta^2. A method with
coefficients A and b multiplies the part of g that goes as exp(s t) by R(z), z = h s, in each step, HLW VI.4::

    R(z) = det(I - z A + z e b^T) / det(I - z A)

so that g does not grow where |R| <= 1 at both roots. Methods whose stages are found by fixed-point iteration solve their equations only
where |z| times the spectral radius of A is less than 1, and in a limited number of iterations only where it is less than a number below 1.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from daebench.methods.names import method_of
from daebench.runs.ivp import Array, ConstrainedIvp
from daebench.runs.request import Request
from daebench.runs.trajectory import Trajectory
from daebench.schemes.kernels.language import ROUNDINGS
from daebench.schemes.kernels.newton import ITERATIONS
from daebench.schemes.kernels.tableaux import gauss
from daebench.systems.lazily import pandas as pd

RK4 = np.array([[0, 0, 0, 0], [0.5, 0, 0, 0], [0, 0.5, 0, 0], [0, 0, 1, 0]]), np.array([1, 2, 2, 1]) / 6
"""A and b of the classical method, HLW II.1.1."""

FIRST = 1e-5
"""Part of the speed by which the first guess of a stage is off, about: chosen to fit limits measured on four problems. A hundred times as
much or as little moves a limit by 5 %."""

SLOWEST = float((ROUNDINGS * np.finfo(float).eps / FIRST) ** (1 / ITERATIONS))
"""Factor of the iteration with which it is at round-off after as many iterations as it may take: 0.8."""

MOST = 64.0
"""Largest alpha h that is looked at."""

DIGITS = 1e-6
"""Relative width of the interval that a limit is found in."""


def coefficients(scheme: str) -> tuple[Array, Array]:
    """Return A, shape(s, s), and b, shape(s,), of a scheme that may be run on a form of the system."""
    if scheme == "rk4":
        return RK4
    tableau = gauss(1 if scheme == "midpoint" else int(scheme.removeprefix("gauss")))
    return np.array(tableau.A, dtype=float), np.array(tableau.b, dtype=float)


def explicit(scheme: str) -> bool:
    """Return whether stages follow one from the other, so that nothing is iterated."""
    A, _ = coefficients(scheme)
    return not np.triu(A).any()


def roots(alpha: Array, beta: Array) -> NDArray[np.complex128]:
    """Return both roots of s^2 + 2 alpha s + beta^2, shape(2, ...)."""
    half = np.sqrt(np.asarray(alpha**2 - beta**2, dtype=complex))
    return np.stack([-alpha + half, -alpha - half])


def amplification(scheme: str, z: NDArray[np.complex128]) -> Array:
    """Return |R(z)|, of the shape of z."""
    A, b = coefficients(scheme)
    identity, one = np.eye(len(b)), np.ones(len(b))
    below = identity - z[..., None, None] * A
    above = below + z[..., None, None] * np.outer(one, b)
    return np.asarray(np.abs(np.linalg.det(above) / np.linalg.det(below)))


def growth(scheme: str, alpha_h: Array, beta_h: Array) -> Array:
    """Return the factor that g grows by in a step at most, of the shape of alpha h and beta h: the larger |R|."""
    return np.asarray(amplification(scheme, roots(np.asarray(alpha_h, dtype=float), np.asarray(beta_h, dtype=float))).max(axis=0))


def contraction(scheme: str, alpha_h: Array, beta_h: Array) -> Array:
    """Return the factor of the iteration for the stages, of the same shape; 0 where nothing is iterated.

    It is the mean over as many iterations as there may be, as the matrix h C of (beta g, g') and A say: a double root takes more of them.
    Above :data:`SLOWEST` the iteration does not come to its end, and above 1 it diverges.
    """
    A, _ = coefficients(scheme)
    alpha_h, beta_h = np.asarray(alpha_h, dtype=float), np.asarray(beta_h, dtype=float)
    if explicit(scheme):
        return np.zeros(np.broadcast_shapes(alpha_h.shape, beta_h.shape))
    zero = 0.0 * beta_h
    hC = np.moveaxis(np.array([[zero, beta_h], [-beta_h, -2 * alpha_h]]), (0, 1), (-2, -1))
    matrix = np.einsum("...ij,kl->...ikjl", hC, A).reshape(*hC.shape[:-2], 2 * len(A), 2 * len(A))
    power = np.linalg.matrix_power(matrix, ITERATIONS)
    return np.asarray(np.linalg.norm(power, ord=2, axis=(-2, -1)) ** (1 / ITERATIONS))


def usable(scheme: str, alpha_h: Array, beta_h: Array) -> NDArray[np.bool_]:
    """Return where g does not grow and the stages can be found."""
    return np.asarray((growth(scheme, alpha_h, beta_h) <= 1 + DIGITS) & (contraction(scheme, alpha_h, beta_h) < SLOWEST))


def limit(scheme: str, ratio: float = 1.0, passes: Callable[[float], bool] | None = None, *, digits: float = DIGITS) -> float:
    """Return the largest alpha h on the ray beta = ratio alpha up to which all is well; infinite where that is so up to :data:`MOST`."""
    fine = passes or (lambda x: bool(usable(scheme, np.array(x), np.array(ratio * x))))
    low, high = 0.0, 0.1
    while fine(high):
        low, high = high, 1.25 * high
        if high > MOST:
            return float("inf")
    while high - low > digits * high:
        middle = (low + high) / 2
        low, high = (middle, high) if fine(middle) else (low, middle)
    return low


STEPS, LAST = 120, 30
"""Steps of the runs that a limit of stability is measured by, and those at the end of which the largest |g| counts."""

SHIFT = 1e-7
"""How far the start of these runs is shifted off the manifold, in parts of 1 + max |q|."""

IMPEDANCE = 0.9
"""Share of the acceleration that a soft constraint takes, as physics engines have it where nothing else is said."""

WATCH = ("energy", "manifold")
"""What each run is looked at for."""

Numbers = Mapping[str, float]


@dataclass(frozen=True)
class Cell:
    """One run.

    Parameters
    ----------
    method : str
        Name of the method.
    value : float
        Its step size or tolerance.
    options : mapping of str to float
        Its free numbers.
    energy, g, Gv : float
        Largest errors of energy, of g and of G H_p; infinite where the run did not come to its end.
    work : int
        Evaluations of the right side or residual.
    seconds : float
        CPU time, s.
    failure : str
        Why the run ended early, or "".
    """

    method: str
    value: float
    options: Numbers
    energy: float
    g: float
    Gv: float
    work: int
    seconds: float
    failure: str


def run_of(ivp: ConstrainedIvp, name: str, value: float, t_end: float, options: Numbers, **more: Any) -> Trajectory:
    """Return the run of a method with these numbers, without its states but the last, where nothing else is asked for."""
    method = method_of(ivp, name, dict(options))
    asked: dict[str, Any] = {"every": 0} if method.knob == "h" else {"points": 2}
    request = Request(value=value, t_end=t_end, watch=WATCH, **asked | more)
    method.check(ivp, request)
    run: Trajectory = method.solve(ivp, request)
    return run


def cell(ivp: ConstrainedIvp, name: str, value: float, t_end: float, options: Numbers) -> Cell:
    """Return the numbers of one run."""
    with np.errstate(all="ignore"):
        run = run_of(ivp, name, value, t_end, options)
    lost = run.failure is not None
    numbers = {key: np.inf if lost else float(run.maxima[key]) for key in ("energy", "g", "Gv")}
    work = run.work.get("residual", run.work.get("G", 0))
    return Cell(name, value, options, **numbers, work=work, seconds=run.seconds, failure=run.failure or "")


def fixed_options(form: str, h: float, alpha_h: float, beta_h: float) -> Numbers:
    """Return the free numbers of a form that has these roots: s^2 + 2 alpha s + beta^2."""
    alpha, beta = alpha_h / h, beta_h / h
    if form == "baumgarte":
        return {"alpha": alpha, "beta": beta}
    return {"stiffness": beta**2 / IMPEDANCE, "damping": 2 * alpha / IMPEDANCE, "impedance": IMPEDANCE}


def over(ivp: ConstrainedIvp, name: str, value: float, t_end: float, options: Iterable[Numbers], tell: Callable[[], None]) -> list[Cell]:
    """Return the runs of a method over its free numbers."""
    cells = []
    for numbers in options:
        cells.append(cell(ivp, name, value, t_end, numbers))
        tell()
    return cells


def fastest(ivp: ConstrainedIvp) -> float:
    """Return the fastest frequency of the penalised system at the start, in parts of 1/eps."""
    G, H_pp = ivp.value("G", ivp.q0), ivp.value("H_pp", ivp.p0, ivp.q0)
    return float(np.sqrt(np.max(np.linalg.eigvalsh(G @ H_pp @ G.T))))


def measured_limit(ivp: ConstrainedIvp, scheme: str, h: float, ratio: float, digits: float = 0.01) -> float:
    """Return the largest alpha h on the ray beta = ratio alpha up to which a start off the manifold returns to the motion on it.

    :data:`STEPS` steps are made from the start and from one that is shifted along G^T; the difference of their g must not have grown.
    """
    G = ivp.value("G", ivp.q0)
    normal = ivp.value("H_pp", ivp.p0, ivp.q0) @ G.T @ np.linspace(1.0, 1.5, ivp.m)
    normal = normal / float(np.max(np.abs(normal)))
    off = replace(ivp, q0=ivp.q0 + SHIFT * (1.0 + float(np.max(np.abs(ivp.q0)))) * normal)

    def fine(x: float) -> bool:
        options = fixed_options("baumgarte", h, x, ratio * x)
        with np.errstate(all="ignore"):
            runs = [run_of(start, f"baumgarte:{scheme}", h, STEPS * h, options, every=1) for start in (ivp, off)]
        if any(run.failure for run in runs):
            return False
        apart = np.abs(ivp.along("g", runs[1].q) - ivp.along("g", runs[0].q)).max(axis=1)
        return bool(apart[-LAST:].max() <= apart[0])

    return limit(scheme, ratio, fine, digits=digits)


def frame(cells: Sequence[Cell], h: float) -> "pd.DataFrame":
    """Return one row a run."""
    rows = [{key: value for key, value in vars(one).items() if key != "options"} | dict(one.options) for one in cells]
    return pd.DataFrame(rows).assign(h=h)


def grid(cells: Sequence[Cell], name: str) -> NDArray[np.float64]:
    """Return a number of all cells of a square map, shape(alpha, beta)."""
    side = round(len(cells) ** 0.5)
    numbers: Array = np.array([getattr(one, name) for one in cells], dtype=float)
    return numbers.reshape(side, side)

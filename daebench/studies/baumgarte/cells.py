"""The runs of a map: what stabilised and soft constraints make of energy, constraints and cost over a grid of their numbers."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import product
from typing import Any

import numpy as np
from numpy.typing import NDArray

from daebench.methods.names import method_of
from daebench.runs.ivp import Array, ConstrainedIvp
from daebench.runs.request import Request
from daebench.runs.trajectory import Trajectory
from daebench.systems.lazily import pandas as pd

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


def over_step(
    ivp: ConstrainedIvp, form: str, scheme: str, h: float, t_end: float, values: Sequence[float], tell: Callable[[], None]
) -> list[Cell]:
    """Return the runs of a scheme on a form over all alpha h (slowest) and beta h."""
    cells = []
    for a, b in product(values, values):
        cells.append(cell(ivp, f"{form}:{scheme}", h, t_end, fixed_options(form, h, a, b)))
        tell()
    return cells


def over_tolerance(ivp: ConstrainedIvp, tol: float, t_end: float, rates: Sequence[float], tell: Callable[[], None]) -> list[Cell]:
    """Return the runs of ``ida:baumgarte`` over all alpha (slowest) and beta, 1/s."""
    cells = []
    for alpha, beta in product(rates, rates):
        cells.append(cell(ivp, "ida:baumgarte", tol, t_end, {"alpha": alpha, "beta": beta}))
        tell()
    return cells


def penalised(ivp: ConstrainedIvp, scheme: str, h: float, t_end: float, values: Sequence[float], tell: Callable[[], None]) -> list[Cell]:
    """Return the runs of a scheme on the penalised system over h times its fastest frequency at the start."""
    G, H_pp = ivp.value("G", ivp.q0), ivp.value("H_pp", ivp.p0, ivp.q0)
    fastest = float(np.sqrt(np.max(np.linalg.eigvalsh(G @ H_pp @ G.T))))
    cells = []
    for x in values:
        cells.append(cell(ivp, f"stiff:{scheme}", h, t_end, {"eps": h * fastest / x}))
        tell()
    return cells


def measured_limit(ivp: ConstrainedIvp, scheme: str, h: float, ratio: float, digits: float = 0.01) -> float:
    """Return the largest alpha h on the ray beta = ratio alpha up to which a start off the manifold returns to the motion on it.

    :data:`STEPS` steps are made from the start and from one that is shifted along G^T; the difference of their g must not have grown.
    """
    from daebench.studies.baumgarte.limits import limit

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

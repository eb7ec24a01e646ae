"""EXUDYN's sentences on its solvers, measured on the pendulum and on the top."""

from functools import partial

import numpy as np

from daebench.diagnostics.order import fit_order
from daebench.pages.report.sentences import number
from daebench.reports.engines.adapters import exudyn as adapter
from daebench.reports.engines.contender import States
from daebench.reports.engines.documentation import row
from daebench.reports.engines.motions import BY_KEY, T_END, compared, reference_of

SOLVERS = "DynamicSolverType"


def order(key: str, run: partial[States], steps: tuple[float, ...]) -> float:
    """Return the measured order of a solver on a motion."""
    motion, known = BY_KEY[key], reference_of(key)
    errors = [float(np.max(np.abs(compared(motion, run(motion.ivp, h, np.array([T_END])).q[-1]) - known.value))) for h in steps]
    return fit_order(steps, errors, floor=known.bound).slope


def check() -> list[dict[str, str]]:
    """Return the sentences with their measurements."""
    fine = tuple(2.0**-k for k in range(7, 12))
    index2 = order("pendulum", partial(adapter.run, adapter.points, "TrapezoidalIndex2", 1.0), fine)
    alpha = order("pendulum", partial(adapter.run, adapter.points, "GeneralizedAlpha", 0.8), fine)
    rk44 = order("top", partial(adapter.run, adapter.top, "RK44", 1.0), tuple(2.0**-k for k in range(13, 17)))
    return [
        row(
            SOLVERS,
            "TrapezoidalIndex2 is Newmark's method with constraints of index 2. (It names no order; the trapezoidal rule has two.)",
            f"order {number(index2, 3)} on the pendulum",
            abs(index2 - 2) < 0.1,
        ),
        row(
            SOLVERS,
            "GeneralizedAlpha follows Arnold and Brüls, who prove order two.",
            f"order {number(alpha, 3)} on the pendulum, spectral radius 0.8",
            abs(alpha - 2) < 0.1,
        ),
        row(SOLVERS, "RK44 has order four, on Lie groups too.", f"order {number(rk44, 3)} on the top", abs(rk44 - 4) < 0.2),
        index3(),
    ]


def index3() -> dict[str, str]:
    """Return with which spectral radii the constraints of index 3 are solved."""
    ivp, solved = BY_KEY["pendulum"].ivp, {}
    for radius in (0.5, 0.7, 0.9, 0.95, 1.0):
        try:
            states = adapter.run(adapter.points, "GeneralizedAlpha", radius, ivp, 1 / 256, np.arange(1, 81) / 8)
            solved[radius] = bool(np.max(np.abs(ivp.along("Gv", states.p, states.q))) < 0.01)
        except Exception:  # noqa: BLE001 - its solver raises an error of its own
            solved[radius] = False
    words = ", ".join(f"{radius:g} {'solved' if ok else 'not'}" for radius, ok in solved.items())
    sentence = "A spectral radius below 1 is what lets generalized-alpha integrate constraints of index 3."
    below = all(ok for radius, ok in solved.items() if radius < 1)
    return row("Theory, “Parameter selection”", sentence, f"pendulum, h = 1/256, |G v| below 0.01: {words}", below and not solved[1.0])

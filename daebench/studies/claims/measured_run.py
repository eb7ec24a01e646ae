"""The run of a method along which its claims are measured, and the step size where none is given."""

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from daebench.reference.solution import reach
from daebench.runs.ivp import Ivp
from daebench.runs.request import Request
from daebench.runs.state import CONSTRAINED, POISSON, State
from daebench.studies.claims.bench import Bench
from daebench.studies.claims.constrained import ConstrainedBench
from daebench.studies.claims.poisson import PoissonBench

MOST_STATES = 1000
"""States of the run that sizes are taken from, about."""

BENCHES: Mapping[State, Callable[..., Bench[Any, Any]]] = {CONSTRAINED: ConstrainedBench, POISSON: PoissonBench}


def bench_of(ivp: Ivp, method: Any, h: float, steps: int) -> Bench[Any, Any]:
    """Return a method to be measured on an initial value problem, along a run of so many steps with everything monitored."""
    request = Request(value=h, steps=steps, every=max(1, steps // MOST_STATES), watch=ivp.state.monitors)
    method.check(ivp, request)
    run = method.solve(ivp, request).complete()
    return BENCHES[ivp.state](ivp, method, run)


def default_step(ivp: Ivp, parts: float = 16) -> float:
    """Return the step size where none is given, 1, 2 or 5 times a power of ten.

    It is the largest such up to a sixteenth, or one of so many parts, of the mean of the first 64 steps of DOP853 at 1e-13, and up to 1 s.
    """
    most = min(reach(ivp, 64) / 64 / parts, 1.0)
    power = 10.0 ** np.floor(np.log10(most))
    return float(next((digit * power for digit in (5, 2) if digit * power <= most), power))

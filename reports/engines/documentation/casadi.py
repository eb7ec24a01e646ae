"""CasADi's sentences on index reduction, measured on the pendulum."""

from functools import partial

import numpy as np

from daebench.pages.report.sentences import number
from daebench.reports.engines.adapters import casadi as adapter
from daebench.reports.engines.documentation import row
from daebench.reports.engines.motions import BY_KEY

TOL = 1e-6
"""Tolerance of the runs."""


def check() -> list[dict[str, str]]:
    """Return the sentences with their measurements."""
    ivp, t = BY_KEY["pendulum"].ivp, np.arange(1, 801) / 8
    drift = {}
    for pole in (0.0, -1.0):
        g = np.abs(ivp.along("g", partial(adapter.run, adapter.reduced, pole)(ivp, TOL, t).q)).max(axis=1)
        drift[pole] = float(g[t <= 10].max()), float(g[t > 90].max())
    (free, later), (held, held_later) = drift[0.0], drift[-1.0]
    return [
        row(
            "dae_reduce_index",
            "Any practical integration drifts from the constraints that index reduction drops.",
            f"|g| at most {number(free)} to t = 10, {number(later)} from 90 to 100, tolerance 1e-6",
            later > 3 * free,
        ),
        row(
            "dae_reduce_index",
            "With a negative Baumgarte pole perturbations of the constraints decay; its example says that at -1 there is no drift.",
            f"|g| at most {number(held)} to t = 10, {number(held_later)} from 90 to 100",
            held_later < 3 * held,
        ),
    ]

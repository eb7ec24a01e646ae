"""How fast the oscillators of the transmission gain or lose energy, against the step."""

from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pandas as pd

from daebench.diagnostics.energy_verdict import energy_error
from daebench.diagnostics.integrals import integral_errors
from daebench.draw.figures import grid_of_axes, legend_below, save
from daebench.draw.methods import name_of, stroke_of
from daebench.pages.report.claims import require
from daebench.pages.report.tables import part
from daebench.reports.nonholonomic.motions import DRIVER, PAIR, SCHEMES, SYMMETRIC, TRANSMISSION, driven, ivp_of, solved

CASES = ("even", "uneven")
STEPS = (0.4, 0.2, 0.1, 0.05, 0.025)
SMALL = STEPS[2:]
"""Steps by which powers are measured."""
T_RATE = 2000.0
LEFT = 0.05
"""Part of the energy down to which its rate is measured."""


def rates(case: str, method: str) -> pd.DataFrame:
    """Return the rate of a scheme for each step: the slope of log E over time, E the energy of the oscillators x and z."""
    ivp, found = ivp_of(TRANSMISSION, case), []
    for h in STEPS:
        run = solved(ivp, method, h, T_RATE, STEPS[0])
        E = driven(ivp) + energy_error(ivp, run) - integral_errors(ivp, run)[DRIVER]
        # Where nothing is left of the energy, its logarithm is that of what the step adds and takes.
        there = np.cumprod(LEFT * E[0] < E).astype(bool)
        found.append(float(np.polyfit(run.t[there], np.log(E[there]), 1)[0]))
    return pd.DataFrame({"case": case, "method": method, "h": STEPS, "rate": found})


def check_rates(frame: pd.DataFrame) -> SimpleNamespace:
    """Return the powers of the step by which rates go on the uneven transmission; test that there are none on the even one."""
    powers = {}
    for name, rows in part(frame, case="uneven", h=SMALL).groupby("method", sort=False):
        (power, _), covariance = np.polyfit(np.log(rows["h"]), np.log(rows["rate"].abs()), 1, cov=True)
        powers[name] = SimpleNamespace(power=float(power), error=float(np.sqrt(covariance[0, 0])))
    for name, order in (("dla", 2), ("spark_lobatto3", 4), (PAIR, 4)):
        require(abs(powers[name].power - order) < 0.1, f"the rate of {name} goes with h^{order}", powers[name].power)
    for name in SYMMETRIC:
        uneven, even = (part(frame, case=case, method=name, h=0.1)["rate"].abs().item() for case in ("uneven", "even"))
        require(even < 1e-3 * uneven, f"the rate of {name} vanishes on the even transmission", (even, uneven))
    rate = part(frame, case="uneven", method="dla", h=0.1)["rate"].item()
    require(rate < 0, "dla takes energy from the oscillators", rate)
    return SimpleNamespace(powers=powers, half=np.log(2) / -rate)


def draw_rates(frame: pd.DataFrame, folder: Path) -> Path:
    """Draw the moduli of the rates against the step, a panel for each transmission."""
    figure, axes = grid_of_axes(1, 2, 3.4, x="step $h$", y="|rate of energy|", sharey=True)
    for ax, case in zip(axes[0], CASES, strict=True):
        for name in SCHEMES:
            rows = part(frame, case=case, method=name)
            ax.plot(rows["h"], rows["rate"].abs(), label=name_of(name), **stroke_of(name).points())
        ax.set(xscale="log", yscale="log", title=f"transmission, {case}", ylim=(1e-12, 1e-2))
    legend_below(figure, axes[0, 0], 5)
    return save(figure, folder, "rates", frame)

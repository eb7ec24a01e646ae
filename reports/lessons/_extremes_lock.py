"""Lock-up: a slider-crank whose rod is hardly longer than its crank, and G close to losing rank."""

from functools import cache

import numpy as np
import pandas as pd
from markupsafe import Markup

from daebench.diagnostics.integrals import energy_error
from daebench.draw.svg.axis import Axis
from daebench.draw.svg.panels import draw_panels
from daebench.methods.initial_value_problem import initial_value_problem
from daebench.methods.names import parse
from daebench.pages.lesson.control import Control, Values
from daebench.pages.lesson.experiment import Experiment, Shown
from daebench.pages.report import number
from daebench.reports.lessons._panels import MINUS_START, against_time, seconds
from daebench.runs.ivp import Array
from daebench.runs.request import Request
from daebench.runs.trajectory import Trajectory

SCHEMES = {"rattle": "RATTLE", "rk4": "Runge and Kutta, index reduced (rk4)"}
RODS, ROD, H, T_END = (2.0, 1.5, 1.2, 1.1, 1.03, 1.01, 1.003, 1.001, 1.0), 1.1, 0.005, 3.0


@cache
def run(scheme: str, rod: float, h: float) -> tuple[Trajectory, Array, Array]:
    """Return a run, its energy error, and the smaller singular value of G in parts of the larger one."""
    ivp = initial_value_problem("slider_crank", "turning", {"rod": rod})
    found = parse(scheme).solve(ivp, Request(value=h, t_end=T_END, every=1, watch=()))
    singular = np.linalg.svd(ivp.along("G", found.q), compute_uv=False)
    return found, energy_error(ivp, found), singular[:, -1] / singular[:, 0]


def show(values: Values) -> Shown:
    """Return the energy error and the rank of G along a run."""
    found, energy, rank = run(**values)
    panels = [
        against_time(found.t, {"": energy}, MINUS_START, "energy error"),
        against_time(
            found.t,
            {"": rank},
            "",
            "how far G is from losing rank",
            Axis("\N{GREEK SMALL LETTER SIGMA} least / largest", 1e-5, 1.0, log=True),
        ),
    ]
    says = Markup("Largest energy error <b>{}</b> J; the smaller singular value of <i>G</i> falls to {} of the larger one.").format(
        number(np.max(np.abs(energy))), number(rank.min())
    )
    if found.failure:
        says += Markup(" The run stopped at <i>t</i> = {:.3g} s: {}").format(
            found.t[-1], found.failure.partition(": ")[2].partition(", within")[0] + "."
        )
    return Shown(draw_panels(panels, alt="Energy error and rank of G against time.", height=250), says)


def table(values: Values) -> pd.DataFrame:
    """Return the numbers behind the picture."""
    found, energy, rank = run(**values)
    return pd.DataFrame({"t": found.t, "energy_error": energy, "rank": rank})


LOCK = Experiment(
    name="lock-up",
    title="A mechanism that locks",
    controls=(
        Control("rod", "rod, in cranks", RODS, ROD, RODS),
        Control("scheme", "method", tuple(SCHEMES), "rattle", tuple(SCHEMES), SCHEMES.__getitem__),
        Control("h", "step size h", (0.001, 0.002, 0.005, 0.01), H, (), seconds),
    ),
    show=show,
    table=table,
)

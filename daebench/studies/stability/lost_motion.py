"""The time for which methods follow a motion that amplifies errors: chaos, and starts near an unstable equilibrium."""

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from daebench.draw.figures import QUIET, drawing, save
from daebench.studies.grid.metrics import LOST
from daebench.studies.grid.rows import by_method, legends_below, resolution_panels, rows_of
from daebench.studies.grid.run_specification import GridRun
from daebench.studies.grid.runs import Runs
from daebench.studies.stability.extreme import Asked, uncertified

if TYPE_CHECKING:
    import pandas as pd

LOUD = 1e6
"""Amplification from which on a motion can be lost by what is small."""

EXPONENTIAL = 0.8
"""Part of the variance of logarithms that a line must explain for a growth to be called exponential."""

HALVINGS = tuple(range(0, 11, 2))
"""Halvings of the distance of stored times, where no step sizes are given."""

TOLERANCES = (1e-4, 1e-6, 1e-8, 1e-10, 1e-12)
"""Tolerances."""


def refusal(asked: Asked) -> str:
    """Return why a problem has no such extreme, as a sentence, or ""."""
    if why := uncertified(asked):
        return why
    assert asked.reference is not None
    largest = float(np.max(asked.reference.worst_amplification))
    if largest < LOUD:
        return f"errors of {asked.reference.name} grow by {largest:.2g} at most, so that nothing small makes it lost"
    return ""


def specifications(asked: Asked) -> list[GridRun]:
    """Return the runs."""
    reference = asked.reference
    assert reference is not None
    end, spacing = asked.t_end or reference.horizon, float(reference.t[1])
    metrics, outputs = (asked.ivp.state.position, "horizon"), int(end / spacing + 0.5)
    steps = asked.h or [spacing / 2**k for k in HALVINGS]
    return [
        asked.specification(method, value, metrics, t_end=end, outputs=outputs) for method, value in asked.resolutions(steps, TOLERANCES)
    ]


def measure(asked: Asked, runs: Runs) -> "pd.DataFrame":
    """Return one row a run, with the time until which it follows the motion, and the times at which that must end."""
    reference = asked.reference
    assert reference is not None
    table, end = runs(specifications(asked)), asked.t_end or reference.horizon
    grown = float(np.max(reference.worst_amplification[reference.t <= end]))
    return table.assign(double_horizon=reference.double_horizon, grown=grown, tenfold=_tenfold(reference.t, reference.amplification))


def _tenfold(t: np.ndarray, amplification: np.ndarray) -> float:
    """Return in which time a perturbation grows tenfold, by the line through the logarithms from the first tenfold on.

    It is NaN where that line explains less than :data:`EXPONENTIAL` of their variance: the growth is not exponential then.
    """
    first = int(np.argmax(amplification > 10))
    if not amplification[first] > 10 or len(t) - first < 3:
        return float("nan")
    logs = np.log10(amplification[first:])
    slope = float(np.polyfit(t[first:], logs, 1)[0])
    explained = float(np.corrcoef(t[first:], logs)[0, 1]) ** 2
    return 1 / slope if slope > 0 and explained > EXPONENTIAL else float("nan")


def says(table: "pd.DataFrame") -> list[str]:
    """Return until when each method follows at best, and what no method can."""
    sentences = []
    double, grown, tenfold, end = (float(table[name].iloc[0]) for name in ("double_horizon", "grown", "tenfold", "t_end"))
    sentences.append(f"A rounding on the way may have grown {grown:.1e} times by t = {end:.3g} s, from 1.1e-16 to {grown * 2.0**-53:.1e}.")
    if tenfold == tenfold:
        sentences.append(f"A perturbation grows tenfold in {tenfold:.2g} s, so that each digit of accuracy is worth so much time.")
    if np.isfinite(double):
        sentences.append(f"From t = {double:.3g} s on no run in double precision can be trusted, whatever its method.")
    for method, rows in by_method(table):
        good = [row for row in rows_of(rows) if not row["failure"]]
        if not good:
            sentences.append(f"{method} never reaches the end.")
            continue
        best = max(good, key=lambda row: (float(row["horizon"]), float(row["value"])))
        unit = " s" if best["knob"] == "h" else ""
        until = "to the end" if best["horizon"] >= end * (1 - 1e-12) else f"until t = {best['horizon']:.3g} s"
        sentences.append(f"{method} is within {LOST:.0%} {until} at best, with {best['knob']} = {best['value']:.1e}{unit}.")
    return sentences


def draw(out: Path, stem: str, table: "pd.DataFrame") -> Path:
    """Draw the time until which each method follows against its step, and against its tolerance."""
    double = float(table["double_horizon"].iloc[0])
    with drawing():
        figure, panels = resolution_panels(table, "horizon", 4.4)
        for axis in panels.values():
            if np.isfinite(double):
                axis.axhline(double, color=QUIET, linestyle="--", linewidth=1.0, label="double precision ends")
            axis.invert_xaxis()
            axis.set_ylim(bottom=0)
        next(iter(panels.values())).set_ylabel(f"followed within {LOST:.0%} until [s]")
        legends_below(panels)
        return save(figure, out, stem, table)

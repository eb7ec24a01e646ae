"""The picture of a certificate: errors over step sizes, and the energy error over time, a row a problem."""

from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from daebench.draw.figures import BLUE, QUIET, curve, drawing, grid_of_axes, legend_below, save
from daebench.studies.certificate.record import Certificate, title


def draw(certificate: Certificate) -> Path:
    """Write the picture of a certificate and its data into its folder; return the path of the SVG."""
    problems = certificate.measured
    data = pd.concat([part for problem in problems for part in (errors(problem), _energies(problem))], ignore_index=True)
    with drawing():
        figure, axes = grid_of_axes(len(problems), 2, 0.9 + 2.1 * len(problems))
        for (left, right), problem in zip(axes, problems, strict=True):
            _errors(left, problem)
            _energy(right, problem)
        axes[-1, 0].set_xlabel("step size h (s)")
        axes[-1, 1].set_xlabel("time t (s)")
        legend_below(figure, axes[0, 0], 4)
        return save(figure, certificate.folder / "figures", "measured", data)


def errors(problem: Any) -> pd.DataFrame:
    """Return the errors of an order study, a row for each component and step size."""
    orders = problem["numbers"]["orders"]
    rows = [
        {"problem": title(problem), "quantity": f"error of {name}", "h": h, "value": error}
        for name, values in orders["errors"].items()
        for h, error in zip(orders["h"], values, strict=True)
    ]
    return pd.DataFrame(rows)


def _energies(problem: Any) -> pd.DataFrame:
    spans = problem["numbers"]["curve"]
    frames = [
        pd.DataFrame({"problem": title(problem), "quantity": f"{name} energy error", "t": spans["t"], "value": spans[name]})
        for name in ("least", "largest")
    ]
    return pd.concat(frames, ignore_index=True)


def _errors(axis: Any, problem: Any) -> None:
    orders = problem["numbers"]["orders"]
    for k, (name, values) in enumerate(orders["errors"].items()):
        axis.loglog(orders["h"], np.array(values, dtype=float), label=f"error of {name}", **curve(k))
    axis.axvline(problem["setting"]["h"], color=QUIET, linewidth=0.8, linestyle=(0, (2, 2)), label="h of all other runs")
    axis.set_ylabel("largest error")
    axis.set_title(title(problem).replace("$", r"\$"))


def _energy(axis: Any, problem: Any) -> None:
    spans = problem["numbers"]["curve"]
    axis.fill_between(spans["t"], spans["least"], spans["largest"], color=BLUE, linewidth=0.5, alpha=0.8)
    axis.axhline(0.0, color=QUIET, linewidth=0.8)
    axis.set_ylabel("energy error")
    axis.ticklabel_format(axis="y", style="sci", scilimits=(-2, 3))
    energy = problem["numbers"]["energy"]
    axis.set_title(f"energy: {energy['verdict']}" + (f", {energy['law']}" if energy["law"] else ""))

"""Runs with their derivatives, and gradients of a functional of them, beside the runs alone, taking turns."""

import time
from collections.abc import Callable
from typing import Any

import numpy as np

from daebench.errors import BadInput
from daebench.methods.gradient import gradient
from daebench.methods.run import run
from daebench.runs.trajectory import Array

RUNS: tuple[tuple[dict[str, Any], tuple[str, ...]], ...] = (
    ({"problem": "spherical_pendulum", "case": "fig1.2", "h": 0.01}, ("mass", "length", "gravity")),
    ({"problem": "slider_crank", "case": "turning", "h": 0.005}, ("crank", "rod", "slider_mass", "gravity")),
)
"""Runs of RATTLE, and the parameters by which they are differentiated; of three the directions that are carried are four too."""


def mean_height(t: Array, q: Array, p: Array) -> Any:
    """Return the mean over time of the last entry of q: the functional whose gradient is timed."""
    return np.trapezoid(q[:, -1], t) / t[-1]


def measure_gradients(*, steps: int, repeat: int) -> list[dict[str, Any]]:
    """Return times of runs of RATTLE that keep every state, without and with derivatives, and of the gradient of a functional."""
    if steps < 1 or repeat < 1:
        raise BadInput(f"steps = {steps} and repeat = {repeat} must be at least 1.", "steps-or-repeat-not-positive")
    return [_row({**chosen, "method": "rattle", "steps": steps, "every": 1}, parameters, repeat) for chosen, parameters in RUNS]


def _row(settings: dict[str, Any], parameters: tuple[str, ...], repeat: int) -> dict[str, Any]:
    """Return the times of one run, after one of each that may have to compile."""

    def alone() -> float:
        trajectory = run(**settings).complete()
        mean_height(trajectory.t, trajectory.states["q"], trajectory.states["p"])
        return float(trajectory.seconds)

    def differentiated() -> float:
        return gradient(mean_height, **settings, sensitivities=parameters).trajectory.seconds

    rivals: dict[str, Callable[[], float]] = {"run": alone, "gradient": differentiated}
    times: dict[str, list[tuple[float, float]]] = {name: [] for name in rivals}
    for _ in range(repeat + 1):
        for name, rival in rivals.items():
            began = time.thread_time()
            stepping = rival()
            times[name].append((time.thread_time() - began, stepping))
    (run_seconds, steps_alone), (gradient_seconds, steps_differentiated) = (np.min(times[name][1:], axis=0) for name in rivals)
    return {
        "problem": settings["problem"],
        "parameters": len(parameters),
        "ns_per_step": 1e9 * steps_alone / settings["steps"],
        "ns_differentiated": 1e9 * steps_differentiated / settings["steps"],
        "steps_ratio": steps_differentiated / steps_alone,
        "run": 1e3 * run_seconds,
        "gradient": 1e3 * gradient_seconds,
        "gradient_ratio": gradient_seconds / run_seconds,
    }

"""Time of a step per link of long chains, and of a step of a problem in time: the rivals take turns, so that noise meets them alike."""

from typing import Any

from daebench.methods.initial_value_problem import initial_value_problem
from daebench.methods.names import method_of
from daebench.runs.request import Request

RIVALS: tuple[tuple[str, str, dict[str, Any], str, int], ...] = (
    ("pendulum_chain", "hanging", {"links": 40}, "rattle", 40),
    ("four_bar", "swing", {"bars": 40}, "rattle", 40),
    ("four_bar", "iftomm", {"bars": 40}, "rattle", 40),
    ("car_axis", "bari", {}, "lobatto3", 1),
)
"""Problem, case, parameters, method, and links that a step is divided by."""

H = 0.001


def measure_rows(*, steps: int, repeat: int) -> list[dict[str, Any]]:
    """Return a row a rival, with the best time of a step per link in several runs, ns, and its ratio to the first row's."""
    runs = []
    for problem, case, parameters, method, links in RIVALS:
        ivp = initial_value_problem(problem, case, parameters)
        runs.append((method_of(ivp, method), ivp, Request(value=H, steps=max(1, steps // links), every=0, watch=())))
    best = [float("inf")] * len(runs)
    for _ in range(repeat):
        for i, (method, ivp, request) in enumerate(runs):
            run = method.solve(ivp, request).complete()
            best[i] = min(best[i], run.seconds / run.steps / RIVALS[i][-1] * 1e9)
    heads = ("problem", "case", "method", "links")
    return [
        dict(zip(heads, (problem, case, method, links), strict=True)) | {"ns_per_link": time, "ratio": time / best[0]}
        for (problem, case, _, method, links), time in zip(RIVALS, best, strict=True)
    ]

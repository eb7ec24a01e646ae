"""How many lanes this processor does best with: measured once, and kept in the cache directory."""

import hashlib
import json
import time
from contextlib import suppress
from functools import cache
from types import ModuleType

import numpy as np

from daebench.compiler import sealed
from daebench.compiler.cache import cache_directory, toolchain
from daebench.compiler.native import Native

WIDTHS = (4, 8, 16, 32)
"""Numbers of lanes that are tried."""

BETTER = 0.95
"""Part of the time of fewer lanes that more lanes must do with: they are compiled for longer, and wait for each other more often."""

REPEATS, ITERATIONS, COLUMNS = 5, 2000, 64


@cache
def best_width() -> int:
    """Return the number of lanes, from the cache directory or measured."""
    from daebench.compiler.machine import machine, processor

    purpose = "\n".join(["lanes", toolchain(), machine()])
    path = cache_directory() / f"daebench_generated_lanes_{processor()[0]}"
    content = sealed.read(path, purpose)
    if content is not None:
        return int(json.loads(content)["lanes"])
    width = fastest(measured())
    with suppress(OSError):  # what cannot be kept is measured again by the next process
        sealed.write(path, purpose, json.dumps({"lanes": width}).encode())
    return width


def width_for(members: int) -> int:
    """Return the number of lanes that so many members do best with: as many as the processor does, unless half of them would be empty."""
    lanes = best_width()
    while lanes > WIDTHS[0] and 2 * members <= lanes:
        lanes //= 2
    return lanes


def fastest(times: dict[int, float]) -> int:
    """Return the number of lanes of the least time, or fewer where these take hardly more."""
    chosen = min(times)
    for width in sorted(times):
        if times[width] < BETTER * times[chosen]:
            chosen = width
    return chosen


def measured() -> dict[int, float]:
    """Return the time of a step of a point on a sphere in a lane, s, by the number of lanes, the least of several in turns."""
    kernels = {width: _kernel(width) for width in WIDTHS}
    counts = np.zeros((1, COLUMNS), dtype=np.int64)
    times = dict.fromkeys(WIDTHS, np.inf)
    for turn in range(REPEATS + 1):
        for width, kernel in kernels.items():
            numbers = np.repeat([[1.0], [1.0], [1.0], [1.0], [-1.0], [0.0]], COLUMNS, axis=1)
            began = time.perf_counter()
            kernel(numbers, counts, ITERATIONS)
            if turn:
                times[width] = min(times[width], (time.perf_counter() - began) / ITERATIONS / COLUMNS)
    return times


def _kernel(lanes: int) -> Native:
    """Return a function that takes steps of points in the columns of an array."""
    source = f"LANES = {lanes}\n{POINTS}"
    module = ModuleType(f"points_in_{lanes}_lanes", "points on spheres, to choose the number of lanes")
    vars(module).update(__file__=module.__name__, __digest__=hashlib.sha256(source.encode()).hexdigest())
    return Native(module, source, "turned", cached=False)


POINTS = """
def along(w, x, y):
    return w * x[0] + y[0], w * x[1] + y[1], w * x[2] + y[2]

def product(x, y):
    return x[0] * y[0] + x[1] * y[1] + x[2] * y[2]

def norm(x):
    return abs(x[0]) + abs(x[1]) + abs(x[2])

def step(q0, v0):
    dq, nu = (0.02 * v0[0], 0.02 * v0[1], 0.02 * v0[2]), 0.0 * v0[0]
    for _ in range(9):
        q = along(1.0, dq, q0)
        change = (product(q, q) - 3.0) / (2.0 * product(q, q0))
        back = change * q0[0], change * q0[1], change * q0[2]
        dq, nu = along(-1.0, back, dq), nu + change
        if not anyof((norm(back) > 1e-15 * max(1.0, norm(q))) & (norm(back) < numpy.inf)):
            break
    q1, v1 = along(1.0, dq, q0), along(-50.0 * nu, q0, v0)
    return q1, along(-1.0 * product(q1, v1) / product(q1, q1), q1, v1)

def turned(numbers, counts, iterations):
    for b in range(0, numbers.shape[1], LANES):
        live = take_all(0, counts, 0, b, LANES) == 0
        form = (0.0, 0.0, 0.0)
        q, v = take_all((form, form), numbers, 0, b, LANES)
        for _ in range(iterations):
            q, v = step(q, v)
        put_all(numbers, 0, b, live, (q, v))
"""
"""Steps of RATTLE for points on spheres of radius sqrt 3, in lanes."""

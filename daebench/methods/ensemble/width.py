"""How many lanes this processor does best with: measured once, and kept in the cache directory."""

import json
import time
from functools import cache
from typing import Any

import numpy as np

from daebench.compiler import sealed
from daebench.compiler.cache import cache_directory, toolchain
from daebench.compiler.machine_code import MADE_BY

WIDTHS = (4, 8, 16, 32)
"""Numbers of lanes that are tried."""

BETTER = 0.95
"""Part of the time of fewer lanes that more lanes must do with: they are compiled for longer, and wait for each other more often."""

REPEATS, ITERATIONS, COLUMNS = 5, 2000, 64


@cache
def best_width() -> int:
    """Return the number of lanes, from the cache directory or measured."""
    import llvmlite.binding as llvm

    purpose = "\n".join(["lanes", llvm.get_host_cpu_name(), toolchain(), *MADE_BY])
    path = cache_directory() / "daebench_generated_lanes"
    try:
        content = sealed.read(path, purpose)
        if content is not None:
            return int(json.loads(content)["lanes"])
        width = fastest(measured())
        sealed.write(path, purpose, json.dumps({"lanes": width}).encode())
    except OSError:  # nothing can be kept; what is known of processors must do
        return 8
    return width


def fastest(times: dict[int, float]) -> int:
    """Return the number of lanes of the least time, or fewer where these take hardly more."""
    chosen = min(times)
    for width in sorted(times):
        if times[width] < BETTER * times[chosen]:
            chosen = width
    return chosen


def measured() -> dict[int, float]:
    """Return the time of a Newton iteration of three points in a lane, s, by the number of lanes, the least of several in turns."""
    kernels = {width: _kernel(width) for width in WIDTHS}
    numbers, counts = np.ones((10, COLUMNS)), np.zeros((1, COLUMNS), dtype=np.int64)
    times = dict.fromkeys(WIDTHS, np.inf)
    for turn in range(REPEATS + 1):
        for width, kernel in kernels.items():
            began = time.perf_counter()
            kernel(numbers, counts, ITERATIONS)
            if turn:
                times[width] = min(times[width], (time.perf_counter() - began) / ITERATIONS / COLUMNS)
    return times


def _kernel(lanes: int) -> Any:
    """Return a function that does what a step of RATTLE for points on a sphere mostly does: it turns them, and puts them back."""
    from numba import njit

    from daebench.compiler.lanes.nested import put_all, select, take_all

    @njit(error_model="numpy")  # type: ignore[untyped-decorator]
    def step(point: Any, last: Any) -> Any:
        x, y, z = point
        u, v, w = x - 0.01 * y, y + 0.01 * x, z - 0.005
        change = (u * u + v * v + w * w - 3.0) / (2.0 * (u * x + v * y + w * z))
        size = abs(change * x) + abs(change * y) + abs(change * z)
        small = (size <= 1e-16) | ((size >= last) & (size <= 1e-12))
        return select(small, point, (u - change * x, v - change * y, w - change * z)), size

    @njit(error_model="numpy")  # type: ignore[untyped-decorator]
    def turned(numbers: Any, counts: Any, iterations: int) -> None:
        for b in range(0, numbers.shape[1], lanes):
            live = take_all(0, counts, 0, b, lanes) == 0
            form = (0.0, 0.0, 0.0)
            p, q, r, last = take_all((form, form, form, 0.0), numbers, 0, b, lanes)
            for _ in range(iterations):
                p, size = step(p, last)
                q, more = step(q, size)
                r, last = step(r, more)
            put_all(numbers, 0, b, live, (p, q, r, last))

    return turned

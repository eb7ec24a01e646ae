"""Further measurements of ``daebench bench``, and their output."""

from collections.abc import Callable
from types import MappingProxyType

from daebench.cli.console import bar, print_json, print_table
from daebench.studies.ensemble_timing import measure_ensembles, measure_heyoka, measure_narrow
from daebench.studies.gradient_timing import measure_gradients
from daebench.studies.row_timing import H, measure_rows
from daebench.studies.solver_timing import measure_solvers


def solvers(steps: int, repeat: int, *, as_json: bool) -> None:
    """Print the times of IDA."""
    with bar("bench --solvers"):
        rows = measure_solvers(repeat=repeat)
    if as_json:
        print_json({"problem": "spherical_pendulum", "case": "fig1.2", "method": "ida:index2", "repeat": repeat, "rows": rows})
        return
    columns = list(dict.fromkeys(name for row in rows for name in row))
    heads = [f"{name} ms" if name in ("native", "in_c", "python", "run") else name for name in columns]
    print_table(heads, [[cell(row.get(column)) for column in columns] for row in rows])


def gradients(steps: int, repeat: int, *, as_json: bool) -> None:
    """Print the times of gradients."""
    with bar("bench --gradients"):
        rows = measure_gradients(steps=steps, repeat=repeat)
    if as_json:
        print_json({"method": "rattle", "steps": steps, "repeat": repeat, "rows": rows})
        return
    heads = [f"{name} ms" if name in ("run", "gradient") else name for name in rows[0]]
    print_table(heads, [[cell(value) for value in row.values()] for row in rows])


def ensembles(steps: int, repeat: int, *, as_json: bool) -> None:
    """Print the time of a step of a member."""
    with bar("bench --ensemble"):
        rows, heyoka = measure_ensembles(steps=steps, repeat=repeat), measure_heyoka(repeat=repeat)
        narrow = measure_narrow(steps=steps, repeat=repeat)
    if as_json:
        print_json({"steps": steps, "repeat": repeat, "rows": rows, "avx2": narrow, "heyoka_ms_to_t_100": heyoka})
        return
    for table in (rows, [row | {"method": f"{row['method']}, AVX2"} for row in narrow or []]):
        if table:
            print_table(list(table[0]), [[cell(value) for value in row.values()] for row in table])
    if heyoka:
        print_table(["heyoka, ms a trajectory", *heyoka], [["spherical_pendulum, fig1.2, to t = 100", *map(cell, heyoka.values())]])


def generated(steps: int, repeat: int, *, as_json: bool) -> None:
    """Print size and times of generated code."""
    from daebench.pages.generation.timing import measure_generated

    with bar("bench --generated"):
        measured = measure_generated(steps=steps, repeat=repeat)
    if as_json:
        print_json({"steps": steps, "repeat": repeat, "rows": measured})
        return
    columns = ["problem", "method", "kB", "compile_s", "generated_ns", "machine_ns", "ratio", "note"]
    print_table(columns, [[cell(row.get(column)) for column in columns] for row in measured])


def rows(steps: int, repeat: int, *, as_json: bool) -> None:
    """Print the time of a step per link of long chains, and on a time-dependent problem."""
    with bar("bench --rows"):
        measured = measure_rows(steps=steps, repeat=repeat)
    if as_json:
        print_json({"h": H, "steps": steps, "repeat": repeat, "rows": measured})
        return
    print_table(list(measured[0]), [[cell(value) for value in row.values()] for row in measured])


def cell(value: object) -> str:
    """Return a value as text."""
    if value is None:
        return ""
    return f"{value:.4g}" if isinstance(value, float) else str(value)


MEASUREMENTS: MappingProxyType[str, Callable[..., None]] = MappingProxyType(
    {"--solvers": solvers, "--gradients": gradients, "--ensemble": ensembles, "--rows": rows, "--generated": generated}
)
"""Measurements by their option."""

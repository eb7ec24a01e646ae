"""CSV: no cell is a formula, numbers are numbers, and what daebench writes it reads back."""

import ast
import csv
import math
import re
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from hypothesis import given
from hypothesis import strategies as st

from daebench.draw.figures import save_table
from daebench.reference.keep.trajectory_file import read
from daebench.runs.csv_files import read_text, text_cell, write_frame, write_numbers, write_rows
from daebench.runs.state import STATES
from daebench.runs.trajectory_files import write_trajectory
from daebench.studies.grid import export

ROOT = Path(__file__).parents[2]
FORMULAS = [
    "=1+1",
    "=cmd|' /C calc'!A0",
    "+1+1",
    "-1+1",
    "-2-x",
    "@SUM(A1)",
    "\t=1",
    "\r=1",
    "\n=1",
    "=",
    "+",
    "-",
    "--1",
    "-.",
    "-1e",
    "\uff1d1",
]
FORMULAS += ['=HYPERLINK("http://evil.example","x")', "-1_0-", "+-1", "-1 ", "-\u0661", "-0x10", '=";\n"']
PLAIN = [
    "rattle",
    "ida:index2",
    "6,2",
    "a=b",
    "1-2",
    "it's",
    "'quoted'",
    "",
    "stopped at t = 1 (h = -1)",
    "q + p",
    "(-1)",
    "nan",
    "./x.py",
    "\u2212",
]
NUMBERS = ["-1", "+1", "-1.5e-30", "-0.1234567890123456789012345678901234", "-inf", "-.5", "+2.", "-1E5"]
STARTS = re.compile(r"[=+\-@\t\r\n\uff1d\uff0b\uff0d\uff20]")


def is_formula(cell):
    return bool(STARTS.match(cell)) and cell not in NUMBERS


def cells_of(path):
    """Return the cells as another program reads them, without pandas' rules."""
    with path.open(encoding="utf-8", newline="") as file:
        return list(csv.reader(file))


def by_rows(path, names, texts):
    write_rows(path, names, [[each] for each in texts])


WRITERS = {
    "frame": lambda path, names, texts: write_frame(path, {names[0]: texts}),
    "categories": lambda path, names, texts: write_frame(path, {names[0]: pd.Categorical(texts)}),
    "objects": lambda path, names, texts: write_frame(path, pd.DataFrame({names[0]: texts}, dtype=object)),
    "table": lambda path, names, texts: save_table(path, {names[0]: texts}),
    "store": lambda path, names, texts: export.write(pd.DataFrame({names[0]: texts}), path),
    "rows": by_rows,
}


@pytest.mark.parametrize("writer", WRITERS.values(), ids=WRITERS)
@pytest.mark.parametrize("name", ["method", "=method", "-x", "'=x"])
def test_no_cell_is_a_formula_and_every_text_is_read_back(writer, name, tmp_path):
    path, texts = tmp_path / "x.csv", [*FORMULAS, *(f"'{each}" for each in FORMULAS), *(each for each in PLAIN if each)]
    writer(path, [name], texts)
    (header,), *rows = cells_of(path)
    found = [cell for (cell,) in rows]
    assert not any(map(is_formula, [header, *found]))
    assert [read_text(cell) for cell in found] == texts
    assert read_text(header) == name
    assert found[-1] == texts[-1]  # what needs no mark has none


def test_a_number_and_a_plain_text_are_written_as_they_are():
    assert [(text_cell(text), read_text(text)) for text in PLAIN + NUMBERS] == [(text, text) for text in PLAIN + NUMBERS]


def test_any_text_is_read_back_and_is_no_formula(random):
    letters = ["'=+-@\t\r\n1e. x", "".join(map(chr, (*range(0x250), *range(0xFF00, 0x10000))))]
    for k, length in enumerate(random.integers(0, 9, 500)):
        text = "".join(random.choice(list(letters[k % 2]), length))
        cell = text_cell(text)
        assert read_text(cell) == text
        if STARTS.match(cell):
            float(cell)


@given(st.floats())
def test_any_number_is_written_as_itself(x):
    assert text_cell(f"{x:.17g}") == f"{x:.17g}"
    assert text_cell(x) == str(x)


def test_numbers_in_a_table_stay_numbers_and_what_is_missing_stays_missing(tmp_path):
    path = tmp_path / "x.csv"
    table = pd.DataFrame({"x": [-1.5, math.nan, 1e-300], "n": [-1, 0, 1], "mixed": [-2.5, "=1", None], "is": [True, False, True]})
    table["one"] = pd.Series([-3, None, 4], dtype="Int64")
    write_frame(path, table)
    assert cells_of(path)[1:] == [
        ["-1.5", "-1", "-2.5", "True", "-3"],
        ["", "0", "'=1", "False", ""],
        ["1e-300", "1", "", "True", "4"],
    ]
    pd.testing.assert_frame_equal(pd.read_csv(path)[["x", "n", "is"]], table[["x", "n", "is"]])
    write_frame(path, table, float_format="%.2g")
    assert cells_of(path)[1][0] == "-1.5"


def test_columns_of_one_name_and_tables_of_no_rows_are_written(tmp_path):
    write_frame(tmp_path / "twice.csv", pd.DataFrame([["=1", -1], ["x", 2]], columns=["a", "a"]))
    assert cells_of(tmp_path / "twice.csv") == [["a", "a"], ["'=1", "-1"], ["x", "2"]]
    write_frame(tmp_path / "empty.csv", pd.DataFrame({"a": [], "=b": []}))
    assert cells_of(tmp_path / "empty.csv") == [["a", "'=b"]]


def test_a_trajectory_is_read_back_to_the_last_digit(daebench, plain_functions, uncompiled_schemes, tmp_path, monkeypatch):
    written = []
    monkeypatch.setattr("daebench.cli.running.write_trajectory", lambda path, run: written.append(run) or write_trajectory(path, run))
    words = ("--case", "fig1.2", "--method", "rattle", "--h", 0.1, "--steps", 3, "--raw", "--out", tmp_path / "run.csv")
    assert daebench("run", "spherical_pendulum", *words)[0] == 0
    (run,) = written
    found = read(tmp_path / "run.csv", STATES["constrained"])
    for part in ("q", "p"):
        for i, column in enumerate(getattr(run, part).T):
            np.testing.assert_array_equal(found.values[f"{part}{i + 1}"], column)
    header, *rows = cells_of(tmp_path / "run.raw.csv")
    assert header == ["multiplier", "t", "lam1"]
    assert [float(row[2]) for row in rows] == [x for _, values in run.raw.values() for x in values[:, 0]]
    write_numbers(tmp_path / "x.csv", {"t": np.array([-0.1]), "=q1": np.array([-1 / 3])})
    assert cells_of(tmp_path / "x.csv") == [["t", "'=q1"], ["-0.10000000000000001", "-0.33333333333333331"]]


def test_every_csv_file_is_written_in_one_place():
    """But the digits of stored references, which are numbers alone, and whose bytes a checksum fixes."""
    writers = {"to_csv", "savetxt", "writer", "DictWriter"}
    found = set()
    for folder in ("daebench", "reference", "reports"):
        for path in (ROOT / folder).rglob("*.py"):
            text = path.read_text(encoding="utf-8")
            if not any(f".{name}(" in text for name in writers):
                continue
            calls = (each for each in ast.walk(ast.parse(text)) if isinstance(each, ast.Call))
            if any(isinstance(call.func, ast.Attribute) and call.func.attr in writers for call in calls):
                found.add(path.relative_to(ROOT).as_posix())
    assert found == {"daebench/runs/csv_files.py"}

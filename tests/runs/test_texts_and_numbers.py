"""Numbers and texts on their way in and out: ranges, JSON, cells of CSV files, the terminal, and messages."""

import csv
import json
import math

import numpy as np
import pytest

from daebench.cli.console import printable
from daebench.errors import LONGEST, BadInput, bounded, positive
from daebench.records import code
from daebench.records.comparison import DIFFERS, EQUAL, compare
from daebench.runs.csv_files import text_cell, write_numbers
from daebench.runs.json_values import plain
from daebench.runs.texts import values


def test_a_range_has_both_ends():
    assert values("--grid", ["a=0:1:5", "b=2:3:1"]) == {"a": [0.0, 0.25, 0.5, 0.75, 1.0], "b": [2.0]}


def test_json_has_null_for_what_is_no_finite_number():
    content = plain({"x": np.array([1.0, math.nan]), "y": (math.inf, 2), "z": "text"})
    assert json.loads(json.dumps(content, allow_nan=False)) == {"x": [1.0, None], "y": [None, 2], "z": "text"}


def test_a_table_of_numbers_is_read_back_to_the_last_bit(tmp_path, random):
    x = random.standard_normal(200) * 10.0 ** random.integers(-9, 9, 200)
    write_numbers(tmp_path / "x.csv", {"x": x, "n": np.arange(200)})
    rows = list(csv.DictReader((tmp_path / "x.csv").read_text().splitlines()))
    assert [float(row["x"]) for row in rows] == x.tolist()


@pytest.mark.parametrize(("text", "cell"), [("=1+1", "'=1+1"), ("@a", "'@a"), ("-1.5e3", "-1.5e3"), ("rattle", "rattle"), ("-x", "'-x")])
def test_a_cell_begins_like_no_formula(text, cell):
    assert text_cell(text) == cell


def test_what_is_printed_has_no_control_characters():
    assert printable("a\x1b[2Jb\nc\x9b") == "a\\x1b[2Jb\nc\\x9b"


def test_a_long_message_keeps_its_ends_and_is_no_longer_than_the_limit():
    said = bounded("begin " + "x" * 5000 + " end")
    assert len(said) <= LONGEST
    assert said.startswith("begin x")
    assert said.endswith("x end")


def test_a_step_size_has_all_its_digits():
    assert positive("h", 2.3e-308) == 2.3e-308
    with pytest.raises(BadInput, match="must be at least"):
        positive("h", 1e-310)


def test_a_number_is_made_by_the_code_of_the_package_too(monkeypatch):
    made = code.made_by.__wrapped__()
    monkeypatch.setattr(code, "code_digest", lambda: "another")
    assert code.made_by.__wrapped__() != made


def test_a_truth_value_is_no_number_in_a_list_either():
    assert [pair.verdict for pair in compare([1, True, 1], [True, True, 1.0])] == [DIFFERS, EQUAL, EQUAL]

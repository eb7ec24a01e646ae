"""Rows of a store in a file of their own: all of them, with all digits, and told apart by what made them."""

import json
import sys

import numpy as np
import pandas as pd
import pytest

from daebench.records.code import code_version
from daebench.records.rows import StoredRow
from daebench.records.store import Store, opened
from daebench.studies.grid.run_specification import GridRun

RUN = GridRun(problem="planar_pendulum", case="rotating", method="rattle", value=0.1, t_end=4.0, metrics=("energy", "q"))


@pytest.fixture
def path(tmp_path):
    row = {"problem": "planar_pendulum", "case": "rotating", "method": "rattle", "knob": "h", "value": 0.1, "gravity": 2.0, "failure": ""}
    row |= {"t_end": 4.0, "t_reached": 4.0, "steps": 40, "energy_error": 1e-3}
    with opened(tmp_path / "rows.db") as store:
        store.put([StoredRow("b", RUN.plain(), row | {"error_q": 0.1 + 0.2}, code_version(), 0.5)])
        store.put([StoredRow("a", RUN.plain(), row | {"error_q": np.inf}, "another version", 0.25)])
    return tmp_path / "rows.db"


@pytest.mark.parametrize("ending", [".csv", ".parquet"])
def test_all_rows_are_written_with_all_digits_and_the_fields_of_their_cells(daebench, path, ending):
    if ending == ".parquet":
        pytest.importorskip("pyarrow", reason="pyarrow, of the extra scale, is not installed")
    file = path.with_suffix(ending)
    found = json.loads(daebench("export", path, file, "--json")[1])
    assert (found["rows"], found["of_other_versions"]) == (2, 1)
    table = pd.read_csv(file, dtype={"error_q": str}) if ending == ".csv" else pd.read_parquet(file)
    assert list(table["key"]) == ["a", "b"]
    assert "Runs: 2" in file.with_name(f"{file.name}.txt").read_text()
    assert list(map(float, table["error_q"])) == [np.inf, 0.1 + 0.2]
    assert list(table["took"]) == [0.25, 0.5]
    assert (table["metrics"] == "energy q").all()
    assert (table[["t_end", "gravity", "outputs"]] == [4.0, 2.0, RUN.outputs]).all(axis=None)


def test_bad_input_is_one_sentence_and_makes_no_file(daebench, path, tmp_path, monkeypatch):
    Store(tmp_path / "empty.db").close()
    monkeypatch.setitem(sys.modules, "pyarrow", None)
    wrong = {
        "no-such-store": ("missing.db", "x.csv"),
        "store-without-rows": ("empty.db", "x.csv"),
        "export-file-ending": ("rows.db", "x.xlsx"),
        "pyarrow-missing": ("rows.db", "x.parquet"),
        "no-such-parent-folder": ("rows.db", "nowhere/x.csv"),
    }
    for code, (store, file) in wrong.items():
        status, out, err = daebench("export", tmp_path / store, tmp_path / file)
        assert (status, out, err.count("\n"), daebench.error.code) == (2, "", 1, code)
    assert {each.suffix for each in tmp_path.iterdir()} == {".db"}

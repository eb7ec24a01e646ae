"""``daebench reference``: what it prints, writes and refuses."""

import csv
import json
import re
import shutil

import numpy as np
import pandas as pd
import pytest
from daebench_site.json_keys import documented
from documented_keys import disagreements

NAME = "planar_pendulum-rotating"

pytestmark = pytest.mark.usefixtures("plain_functions")


@pytest.fixture
def reference(daebench, references):
    """Run ``daebench reference`` on the small reference."""
    return lambda *words: daebench("reference", *words, "--folder", references)


def test_list_gives_a_row_for_each_reference(reference):
    status, out, _ = reference("list", "--json")
    assert status == 0
    (row,) = json.loads(out)
    assert (row["name"], row["rows"], row["horizon"], row["double_horizon"]) == (NAME, 33, 4.0, None)
    assert NAME in reference("list")[1]


def test_a_folder_that_is_not_there_is_said_and_a_damaged_reference_hides_no_other(daebench, copied):
    status, _, err = daebench("reference", "list", "--folder", copied / "nowhere")
    assert (status, "there is no such folder" in err) == (2, True)
    shutil.copytree(copied / NAME, copied / "planar_pendulum-horizontal")
    status, out, _ = daebench("reference", "list", "--folder", copied)
    assert status == 1
    assert "its name should be planar_pendulum-horizontal and is planar_pendulum-rotating" in out
    assert re.search(rf"^ *{NAME} +33 +4 ", out, re.MULTILINE)


def test_show_tells_what_is_known(reference):
    status, out, _ = reference("show", NAME)
    assert status == 0
    for words in ("closed form, 50 digits", "bound at the end", "horizon of double precision", "amplification", "ida:ggl", "1e-14"):
        assert words in out
    assert json.loads(reference("show", NAME, "--json")[1])["definition"]["q0"] == ["0", "-1"]


def test_at_a_stored_time_the_stored_digits_are_given(reference, references):
    _, out, _ = reference("at", "planar_pendulum", "--case", "rotating", "--t", 1.5, "--json")
    found = json.loads(out)
    with (references / NAME / f"{NAME}.csv").open() as file:
        row = next(each for each in csv.DictReader(file) if float(each["t"]) == 1.5)
    assert found["digits"]["q"] == [row["q1"], row["q2"]]
    assert found["digits"]["lam"] == [row["lam1"]]
    assert found["q"] == [float(row["q1"]), float(row["q2"])]
    assert max(found["bound_of_digits"]["q"]) < 1e-31
    assert found["origin"] == "stored digits"


def test_between_stored_times_it_says_where_it_came_from(reference):
    status, out, _ = reference("at", "planar_pendulum", "--case", "rotating", "--t", 1.55)
    assert status == 0
    assert "integrated in double precision from the stored state at t = 1.5" in out
    found = json.loads(reference("at", "planar_pendulum", "--case", "rotating", "--t", 1.55, "--json")[1])
    assert found["bound_of_digits"] is None
    assert 0 < max(found["bound"]["q"]) < 1e-12


def test_a_damaged_reference_exits_with_one(daebench, copied):
    path = copied / NAME / f"{NAME}.csv"
    path.write_text(path.read_text().replace("1", "2", 1))
    status, _, err = daebench("reference", "show", NAME, "--folder", copied)
    assert status == 1
    assert "its SHA-256 should be" in err


def test_csv_is_exported_with_digits_and_bounds(reference, tmp_path):
    path = tmp_path / "x.csv"
    assert reference("export", NAME, "--times", "0:1:0.3", "--out", path)[0] == 0
    found = pd.read_csv(path, dtype=str)
    assert found["t"].tolist() == ["0.0", "0.3", "0.6", "0.8999999999999999"]
    assert list(found) == ["t", "q1", "q2", "p1", "p2", "lam1", "bound_q1", "bound_q2", "bound_p1", "bound_p2", "bound_lam1"]
    assert float(found["bound_q1"][0]) < 1e-15 < float(found["bound_q1"][1])


def test_a_whole_reference_keeps_its_digits_in_csv_and_json(reference, references, tmp_path):
    for kind in ("csv", "json"):
        assert reference("export", NAME, "--format", kind, "--out", tmp_path / f"x.{kind}")[0] == 0
    stored = pd.read_csv(references / NAME / f"{NAME}.csv", dtype=str)
    written = pd.read_csv(tmp_path / "x.csv", dtype=str)
    columns = json.loads((tmp_path / "x.json").read_text())["columns"]
    for name in stored:
        assert written[name].tolist() == stored[name].tolist() == columns[name]


def test_arrays_and_tables_hold_the_same_numbers(reference, tmp_path):
    pytest.importorskip("pyarrow", reason="pyarrow, of the extra scale, is not installed")
    for kind in ("npz", "parquet"):
        assert reference("export", NAME, "--format", kind, "--out", tmp_path / f"x.{kind}")[0] == 0
    table = pd.read_parquet(tmp_path / "x.parquet")
    with np.load(tmp_path / "x.npz") as arrays:
        assert arrays["q"].shape == arrays["bound_q"].shape == (33, 2)
        np.testing.assert_array_equal(arrays["q"][:, 0], table["q1"])
        np.testing.assert_array_equal(arrays["bound_lam"][:, 0], table["bound_lam1"])


def test_build_writes_a_reference(daebench, tmp_path, monkeypatch):
    monkeypatch.setattr("daebench.reference.make.build.ida_errors", lambda *_: [])
    status, out, _ = daebench("reference", "build", "planar_pendulum-horizontal", "--t-end", 2, "--folder", tmp_path, "--json")
    assert (status, (tmp_path / "planar_pendulum-horizontal").is_dir()) == (0, True)
    assert disagreements(json.loads(out), documented()["reference build"].keys) == []

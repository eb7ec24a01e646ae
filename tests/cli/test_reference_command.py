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
AT = ["at", "planar_pendulum", "--case", "rotating", "--t"]

pytestmark = pytest.mark.usefixtures("plain_functions")


@pytest.fixture
def reference(daebench, references):
    """Run ``daebench reference`` on the small reference."""
    return lambda *words: daebench("reference", *words, "--folder", references)


def test_a_damaged_reference_is_said_and_hides_no_other(daebench, copied):
    shutil.copytree(copied / NAME, copied / "planar_pendulum-horizontal")
    status, out, _ = daebench("reference", "list", "--folder", copied)
    assert (status, "its name should be planar_pendulum-horizontal" in out) == (1, True)
    assert re.search(rf"^ *{NAME} +33 +4 ", out, re.MULTILINE)
    path = copied / NAME / f"{NAME}.csv"
    path.write_text(path.read_text().replace("1", "2", 1))
    status, _, err = daebench("reference", "show", NAME, "--folder", copied)
    assert (status, "SHA-256" in err) == (1, True)


def test_at_a_stored_time_the_stored_digits_are_given(reference, references):
    _, out, _ = reference(*AT, 1.5, "--json")
    found = json.loads(out)
    with (references / NAME / f"{NAME}.csv").open() as file:
        row = next(each for each in csv.DictReader(file) if float(each["t"]) == 1.5)
    assert found["digits"]["q"] == [row["q1"], row["q2"]]
    assert found["digits"]["lam"] == [row["lam1"]]
    assert found["q"] == [float(row["q1"]), float(row["q2"])]
    assert max(found["bound_of_digits"]["q"]) < 1e-31
    assert found["origin"] == "stored digits"

    between = json.loads(reference(*AT, 1.55, "--json")[1])
    assert (between["bound_of_digits"], 0 < max(between["bound"]["q"]) < 1e-12, "t = 1.5" in between["origin"]) == (None, True, True)


def test_exported_times_have_bounds_and_a_whole_reference_keeps_its_digits(reference, references, tmp_path):
    assert reference("export", NAME, "--times", "0:1:0.3", "--out", tmp_path / "times.csv")[0] == 0
    found = pd.read_csv(tmp_path / "times.csv", dtype=str)
    assert found["t"].tolist() == ["0.0", "0.3", "0.6", "0.8999999999999999"]
    assert float(found["bound_q1"][0]) < 1e-15 < float(found["bound_q1"][1])
    for kind in ("csv", "json"):
        assert reference("export", NAME, "--format", kind, "--out", tmp_path / f"x.{kind}")[0] == 0
    stored, written = (pd.read_csv(path, dtype=str) for path in (references / NAME / f"{NAME}.csv", tmp_path / "x.csv"))
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

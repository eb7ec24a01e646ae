"""``daebench chaos``: what it prints and writes, and what it refuses."""

import csv
import json

import pytest

RUN = ("chaos", "double_pendulum", "--case", "horizontal", "--method", "rattle", "--h", 0.01, "--t-end", 5)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("chaos")


def test_json_counts_cells_and_files_have_a_row_a_cell(daebench, folder):
    status, out, _ = daebench(*RUN, "--plane", "q1=-1.5:1.5,p1=-1:1", "--energy", "case", "--cells", 6, "--out", folder, "--json")
    printed = json.loads(out)
    assert status == 0
    assert printed["cells"] == 36
    assert printed["empty"] == 12
    assert sum(printed[word] for word in ("chaotic", "regular", "undetermined", "stopped", "empty")) == 36
    assert printed["exponent"]["low"] <= printed["exponent"]["value"] <= printed["exponent"]["high"]
    with (folder / "chaos.csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 36
    assert list(rows[0])[:2] == ["q1", "p1"]
    assert {row["why"] for row in rows if row["verdict"] == "empty"} == {"no position found on the manifold"}
    assert (folder / "chaos.svg").is_file()


def test_people_read_the_largest_exponent_with_its_interval_and_what_was_written(daebench, tmp_path):
    status, out, _ = daebench(*RUN, "--plane", "q2,q4", "--cells", 3, "--out", tmp_path)
    assert status == 0
    assert "95 % interval" in out
    assert out.splitlines()[-1] == f"written: {tmp_path / 'chaos.csv'}, {tmp_path / 'chaos.svg'}"

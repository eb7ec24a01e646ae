"""``daebench ensemble``: what it prints and writes, and what it refuses."""

import csv
import json

import numpy as np

RUN = ("ensemble", "planar_pendulum", "--case", "horizontal", "--method", "rattle", "--h", 0.1, "--t-end", 5, "--members", 12)


def test_json_has_numbers_and_quantiles_and_files_a_row_a_member(daebench, tmp_path):
    status, out, _ = daebench(*RUN, "--points", 6, "--out", tmp_path, "--json")
    printed = json.loads(out)
    assert status == 0
    assert (printed["members"], printed["steps"], printed["failed"]) == (12, 50, 0)
    assert printed["lanes"] > 1
    energy = list(printed["quantiles"]["energy"].values())
    assert list(printed["quantiles"]["energy"]) == ["0.05", "0.25", "0.5", "0.75", "0.95"]
    assert energy == sorted(energy)
    assert "neighbourhood" in printed["starts"]
    assert [path.rpartition("/")[2] for path in printed["written"]] == ["starts.csv", "ends.csv", "bands.csv", "bands.svg"]
    with (tmp_path / "starts.csv").open(encoding="utf-8") as file:
        starts = list(csv.DictReader(file))
    with (tmp_path / "ends.csv").open(encoding="utf-8") as file:
        ends = list(csv.DictReader(file))
    assert len(starts) == len(ends) == 12
    assert list(starts[0]) == ["member", "h", "q1", "q2", "p1", "p2"]
    assert {"steps", "t", "max_energy", "max_g", "failure"} <= set(ends[0])
    radii = [np.hypot(float(row["q1"]), float(row["q2"])) for row in (*starts, *ends)]
    assert np.allclose(radii, 1.0, rtol=0, atol=1e-14)
    assert all(row["failure"] == "" for row in ends)
    assert {path.name for path in tmp_path.iterdir()} >= {"bands.svg", "bands.png", "bands.csv", "starts.csv.txt", "ends.csv.txt"}


def test_members_that_stop_end_it_with_1_and_are_named(daebench):
    status, out, _ = daebench(*RUN[:6], "--h", 4, "--steps", 5, "--members", 6)
    assert status == 1
    assert "no convergence" in out
    assert "member 0: rattle on planar_pendulum, case horizontal, stopped at t = 0" in out

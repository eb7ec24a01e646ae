"""``daebench step-for``: what it prints and writes, and how it ends."""

import json

RUN = ("step-for", "double_pendulum", "--case", "horizontal", "--method", "rattle", "--h", 0.02, "--t-end", 2, "--members", 64)


def test_json_has_the_step_and_the_tests(daebench, tmp_path):
    status, out, _ = daebench(*RUN, "--statistic", "energy", "--margin", 1, "--out", tmp_path, "--json")
    printed = json.loads(out)
    assert status == 0
    assert printed["h"] == printed["tried"][-1]["h"]
    assert printed["tried"][-1]["verdict"] == "equivalent"
    assert (tmp_path / "steps.csv").is_file()
    assert (tmp_path / "steps.svg").is_file()


def test_of_the_largest_step_that_passes_it_is_said_what_is_not_shown(daebench):
    status, out, _ = daebench(*RUN, "--statistic", "energy", "--margin", 1)
    assert status == 0
    passed = "h = 0.02 s passes, the largest tried: it agrees with 0.01 s; whether that agrees with the exact motion is not tested"
    assert passed in out.splitlines()


def test_no_step_that_passes_ends_with_one(daebench):
    status, out, _ = daebench(*RUN, "--statistic", "energy", "--margin", 1e-9, "--halvings", 2)
    assert status == 1
    assert "no step tried passes" in out


def test_members_without_an_interval_are_undecided_with_the_number_that_it_takes(daebench, tmp_path):
    few = (*RUN[:-1], 40, "--statistic", "energy", "--margin", 100, "--halvings", 2)
    status, out, _ = daebench(*few)
    assert status == 1
    why = "of 40 members the quantiles of 10 % and 90 % have no exact interval, which takes 42 members"
    assert f"h = 0.02 s is undecided: {why}" in out.splitlines()
    assert out.count("too few members") == 4
    _, out, _ = daebench(*few, "--out", tmp_path, "--json")
    row = json.loads(out)["tried"][0]
    assert (row["verdict"], row["needed"], row["why"]) == ("undecided", 42, why)
    assert row["differences"]["10 %"][1:] == [None, None]
    assert (tmp_path / "steps.svg").is_file()

"""A command replaces its own files, and those of another command or program only where it is told to."""

import itertools

import pytest

RUN = ("run", "planar_pendulum", "--case", "horizontal", "--method", "symplectic_euler", "--h", 0.1, "--t-end", 1)
COMMANDS = {
    "run": (RUN, "a.csv"),
    "run npz": (RUN, "a.npz"),
    "raw": ((*RUN[:5], "rattle", *RUN[6:], "--raw"), "a.csv"),
    "export": (("reference", "export", "planar_pendulum-horizontal", "--times", "0,1"), "a.csv"),
    "export npz": (("reference", "export", "planar_pendulum-horizontal", "--times", "0,1", "--format", "npz"), "a.npz"),
    "animate": (("animate", "planar_pendulum", "--methods", "symplectic_euler", "--h", 0.1, "--t-end", 1), "a.html"),
}
"""Commands that write a file, and its name."""


@pytest.fixture(autouse=True)
def here(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


def contents(folder):
    """Return the files of a folder but the texts beside them, with what is in them."""
    return {path.name: path.read_bytes() for path in folder.iterdir() if path.suffix != ".txt"}


@pytest.mark.parametrize("name", COMMANDS)
def test_a_command_may_be_run_again(daebench, here, name):
    command, file = COMMANDS[name]
    assert daebench(*command, "--out", file)[0] == 0
    before = contents(here)
    assert daebench(*command, "--out", file)[0] == 0
    assert contents(here).keys() == before.keys()


PAIRS = [(one, other) for one, other in itertools.permutations(COMMANDS, 2) if COMMANDS[one][1] == COMMANDS[other][1]]
"""Pairs of commands that write a file of the same name, of which two are one command."""


@pytest.mark.parametrize(("one", "other"), [*PAIRS, ("raw", "animate")])
def test_no_command_replaces_the_file_of_another_unasked(daebench, here, one, other):
    assert daebench(*COMMANDS[one][0], "--out", COMMANDS[one][1])[0] == 0
    before = contents(here)
    command, file = COMMANDS[other]
    status, _, error = daebench(*command, "--out", file)
    mine = one.split()[0].replace("raw", "run") == other.split()[0].replace("raw", "run")
    collides = file in before and not mine
    assert (status == 2) == collides
    if collides:
        assert contents(here) == before
        assert f"--out {file}: the file exists, and daebench " in error
        assert "add --overwrite" in error
        assert daebench(*command, "--out", file, "--overwrite")[0] == 0
        assert contents(here)[file] != before[file]
    else:
        assert all(contents(here)[each] == before[each] for each in before if mine is False)


@pytest.mark.parametrize("name", ["run", "run npz"])
@pytest.mark.parametrize("beside", [None, "notes on it", "Made by: somebody"], ids=str)
def test_a_file_of_nobody_knows_whom_is_kept(daebench, here, name, beside):
    command, file = COMMANDS[name]
    (here / file).write_text("my notes")
    if beside is not None:
        (here / f"{file}.txt").write_text(beside)
    status, _, error = daebench(*command, "--out", file)
    assert status == 2
    assert "the file exists" in error
    assert (here / file).read_text() == "my notes"

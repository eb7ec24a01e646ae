"""A command replaces its own files, and those of another command or program only where it is told to."""

import itertools

import pytest

RUN = "run planar_pendulum --case horizontal --h 0.1 --t-end 1 --method symplectic_euler"
EXPORT = "reference export planar_pendulum-horizontal --times 0,1"
COMMANDS = {
    "run": (RUN, "a.csv"),
    "run npz": (RUN, "a.npz"),
    "raw": (f"{RUN.replace('symplectic_euler', 'rattle')} --raw", "a.csv"),
    "export": (EXPORT, "a.csv"),
    "export npz": (f"{EXPORT} --format npz", "a.npz"),
    "animate": ("animate planar_pendulum --methods symplectic_euler --h 0.1 --t-end 1", "a.html"),
}
"""Commands that write a file, and its name."""


@pytest.fixture
def call(daebench, tmp_path, monkeypatch):
    """Return what calls one of the commands in a folder of its own, and returns its exit status."""
    monkeypatch.chdir(tmp_path)
    return lambda name, *more: daebench(*COMMANDS[name][0].split(), "--out", COMMANDS[name][1], *more)[0]


def contents(folder):
    """Return the files of a folder but the texts beside them, with what is in them."""
    return {path.name: path.read_bytes() for path in folder.iterdir() if path.suffix != ".txt"}


@pytest.mark.parametrize("name", COMMANDS)
def test_a_command_may_be_run_again(call, tmp_path, name):
    assert call(name) == 0
    before = contents(tmp_path)
    assert call(name) == 0
    assert contents(tmp_path).keys() == before.keys()


PAIRS = [(one, other) for one, other in itertools.permutations(COMMANDS, 2) if COMMANDS[one][1] == COMMANDS[other][1]]
"""Pairs of commands that write a file of the same name, of which two are one command."""


@pytest.mark.parametrize(("one", "other"), [*PAIRS, ("raw", "animate")])
def test_no_command_replaces_the_file_of_another_unasked(daebench, call, tmp_path, one, other):
    assert call(one) == 0
    before, file = contents(tmp_path), COMMANDS[other][1]
    same_command = COMMANDS[one][0].split()[0] == COMMANDS[other][0].split()[0]
    collides = file in before and not same_command
    assert call(other) == (2 if collides else 0)
    if collides:
        assert contents(tmp_path) == before
        assert daebench.error.code == "output-file-taken"
        assert call(other, "--overwrite") == 0
        assert contents(tmp_path)[file] != before[file]
    elif not same_command:
        assert contents(tmp_path).items() >= before.items()


@pytest.mark.parametrize("name", ["run", "run npz"])
@pytest.mark.parametrize("beside", [None, "notes on it", "Made by: somebody"], ids=str)
def test_a_file_of_nobody_knows_whom_is_kept(call, tmp_path, name, beside):
    file = tmp_path / COMMANDS[name][1]
    file.write_text("my notes")
    if beside is not None:
        file.with_name(f"{file.name}.txt").write_text(beside)
    assert (call(name), file.read_text()) == (2, "my notes")

"""How commands end: one sentence and an exit status, whatever goes wrong with pipes, disks, encodings, memory and Ctrl-C."""

import errno
import itertools
import json
import os
import re
import resource
import shutil
import signal
import subprocess
import sys
import time
from functools import partial

import pytest
from mistaken import written
from refusals import refused

from daebench.cli import console
from daebench.cli.endings import FAULT, ending, keep_interrupts
from daebench.errors import LONGEST, BadInput, DaebenchError, Interrupted, RunFailed, unknown
from daebench.runs.files import atomic

COMMAND = [sys.executable, "-m", "daebench"]
LISTINGS = ["list", "list problems --json", "list methods", "show planar_pendulum", "reference list"]


def started(words, **settings):
    """Return a command that has begun, in an environment that warns of nothing."""
    settings = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE} | settings
    settings["env"] = os.environ | {"PYTHONWARNINGS": "ignore"} | settings.get("env", {})
    return subprocess.Popen([*COMMAND, *words.split()], **settings)


def ended(words, **settings):
    """Return exit status, standard output and standard error of a command."""
    with started(words, **settings) as command:
        out, err = command.communicate()
    return command.returncode, out, err


@pytest.mark.sampled(by=lambda case: case in ("0-show planar_pendulum", "1-list problems --json"))
@pytest.mark.parametrize("words", LISTINGS)
@pytest.mark.parametrize("lines", [0, 1])
def test_nobody_who_reads_on_ends_a_command_quietly(words, lines):
    with started(words) as command:
        for _ in range(lines):
            command.stdout.readline()
        command.stdout.close()
        err = command.stderr.read()
    assert err == b""
    assert command.returncode in (0, 1)


def test_a_mistake_is_said_where_nobody_reads_the_output():
    with started("list problmes") as command:
        command.stdout.close()
        err = command.stderr.read()
    assert (command.returncode, err.count(b"problmes")) == (2, 1)


def test_a_broken_pipe_of_something_else_is_no_silence():
    sentence, status = ending(BrokenPipeError(errno.EPIPE, "Broken pipe"))
    assert (status, sentence != "") == (1, True)


@pytest.mark.sampled(by=lambda case: case in ("list", "list problems --json"))
@pytest.mark.parametrize("words", LISTINGS)
@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="there is no /dev/full")  # noqa: PTH110
def test_a_full_disk_below_standard_output_is_named(words):
    with open("/dev/full", "w") as full:  # noqa: PTH123
        status, _, err = ended(words, stdout=full)
    assert (status, err.decode()) == (2, f"daebench: standard output: {os.strerror(errno.ENOSPC)}.\n")


@pytest.mark.parametrize("error", [errno.ENOSPC, errno.EFBIG, errno.EDQUOT, errno.EIO, errno.EPIPE], ids=errno.errorcode.get)
def test_a_file_that_cannot_be_written_is_named_and_the_old_one_kept(tmp_path, error):
    path = tmp_path / "table.csv"
    path.write_text("old")

    def write_half():
        with atomic(path) as scratch:
            scratch.write_text("half")
            raise OSError(error, os.strerror(error))

    with refused("file-not-writable", DaebenchError):
        write_half()
    assert [each.name for each in tmp_path.iterdir()] == ["table.csv"]
    assert path.read_text() == "old"


SMALL = 20_000
"""Bytes that a file may have at most: as much as is left on the disk."""

WRITING = {
    "csv": "run planar_pendulum --method rattle --h 0.01 --t-end 20 --out x.csv",
    "npz": "run planar_pendulum --method rattle --h 0.01 --t-end 20 --out x.npz",
    "pictures": "compare planar_pendulum --methods rattle --h 0.1 --t-end 20 --out x",
    "page": "animate planar_pendulum --methods rattle --h 0.1 --t-end 20 --out x.html",
    "reference": "reference export planar_pendulum-rotating --out x.csv",
}


@pytest.mark.sampled(by=lambda case: case in ("csv", "reference"))
@pytest.mark.slow
@pytest.mark.parametrize("words", WRITING.values(), ids=WRITING)
def test_a_disk_with_no_room_is_one_sentence_with_the_file(tmp_path, words):
    assert ended(words, cwd=tmp_path)[0] == 0
    small = partial(resource.setrlimit, resource.RLIMIT_FSIZE, (SMALL, SMALL))
    status, _, err = ended(words, cwd=tmp_path, preexec_fn=small)
    assert (status, err.count(b"\n"), b"/x" in err, os.strerror(errno.EFBIG).encode() in err) == (1, 1, True, True)


ENCODINGS = {
    "C": {"LC_ALL": "C"},
    "C, as it says": {"LC_ALL": "C", "PYTHONUTF8": "0", "PYTHONCOERCECLOCALE": "0"},
    "Latin": {"PYTHONIOENCODING": "latin-1"},
    "ASCII": {"PYTHONIOENCODING": "ascii"},
    "DOS": {"PYTHONIOENCODING": "cp437"},
}


@pytest.mark.sampled(by=lambda case: case in ("list --json-ASCII", "list-DOS"))
@pytest.mark.parametrize("encoding", ENCODINGS.values(), ids=ENCODINGS)
@pytest.mark.parametrize("words", ["list", "list --json", "reference list"])
def test_lists_are_printed_in_whatever_encoding_there_is(encoding, words):
    status, out, err = ended(words, env=encoding)
    assert (status, err, b"pendulum" in out) == (0, b"", True)
    if "--json" in words:
        same = ended(words, env={"PYTHONIOENCODING": "utf-8"})[1]
        assert json.loads(out.decode("ascii" if "ascii" in encoding.values() else "utf-8")) == json.loads(same)


@pytest.mark.parametrize("length", [10, LONGEST - 1, LONGEST, LONGEST + 1, 10**5, 10**7])
@pytest.mark.parametrize("kind", [BadInput, DaebenchError, RunFailed, Interrupted])
def test_no_message_is_longer_than_can_be_read(kind, length):
    said = str(kind("a" * length + "; do this."))
    assert len(said) <= LONGEST
    assert said.endswith("; do this.")
    assert len(str(unknown("method", "b" * length, ["rattle"]))) <= LONGEST


ODD = ("x" * 10**5, "é" * 10**5, "\n" * 10**5, "./" + "d/" * 10**4 + "x.py", "\udcff.py", "a=" + "9" * 10**5, "1" * 400, "1" * 5000)
RUN = "run planar_pendulum --h 0.1"
PLACES = ("show", f"{RUN} --steps 1 --method", f"{RUN} --method rattle --steps", "list", "report", "", "reference show")
PLACES += ("ensemble planar_pendulum --method rattle --h 0.1 --steps 3 --members",)


def test_a_word_of_any_length_is_refused_in_one_short_sentence(daebench):
    for where, word in itertools.product(PLACES, ODD):
        status, out, err = daebench(*where.split(), word)
        assert (status, out, err.count("\n")) == (2, "", 1), (where, word[:9])
        assert len(err) <= LONGEST + 100


FAULTS = [KeyError("x"), TypeError("y" * 10**6), ZeroDivisionError(), RecursionError("deep"), AssertionError(), SystemError("z")]


@pytest.fixture
def raising(monkeypatch):
    """Return what has the list of problems raise an error."""

    def broken(error):
        def raises(*_, **__):
            raise error

        monkeypatch.setattr("daebench.methods.catalogue.problems", raises)

    return broken


@pytest.mark.parametrize("error", FAULTS, ids=lambda error: type(error).__name__)
def test_a_fault_of_ours_is_a_sentence_with_a_status_of_its_own(daebench, monkeypatch, raising, error):
    raising(error)
    status, out, err = daebench("list", "problems")
    assert (status, out, err.count("\n")) == (FAULT, "", 1)
    assert "test_endings.py" in err
    assert type(error).__name__ in err
    assert len(err) <= LONGEST + 100
    monkeypatch.setenv("DAEBENCH_TRACEBACK", "1")
    assert "Traceback" in daebench("list", "problems")[2]


def test_too_little_memory_is_said(daebench, raising):
    raising(MemoryError("Unable to allocate 7 TiB"))
    status, _, err = daebench("list", "problems")
    assert (status, err.count("\n"), "7 TiB" in err) == (1, 1, True)


MANY = {
    "run pendulum_chain --method rattle --h 0.01 --steps 1 --param links={}": "parameter-exceeds-memory",
    "run ablowitz_ladik --method lie --h 0.01 --steps 1 --param sites={}": "parameter-exceeds-memory",
    "long planar_pendulum --method rattle --h 0.1 --steps 1e3 --ensemble {}": "long-ensemble-too-large",
}


def test_more_than_fits_into_memory_is_refused_beforehand(daebench, folder):
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    for words, number in itertools.product(MANY, (2 * 10**6, 10**9, 10**18)):
        status, out, err = daebench(*words.format(number).split())
        assert (status, out, err.count("\n"), daebench.error.code) == (2, "", 1, MANY[words]), (words, number)
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss < before + 500_000


@pytest.mark.parametrize("came", [ImportError, SystemError])
def test_ctrl_c_that_a_library_takes_for_a_fault_of_its_own_is_still_ctrl_c(came):
    error = came("numpy cannot be loaded")
    error.__cause__ = KeyboardInterrupt()
    assert ending(error) == ("interrupted.", 130)
    assert ending(came("another"))[1] == FAULT


def test_ctrl_c_where_nothing_can_be_raised_comes_again(monkeypatch):
    class Dying:
        def __del__(self):
            signal.raise_signal(signal.SIGINT)

    def dies_and_goes_on():
        Dying()
        time.sleep(30)

    monkeypatch.setattr(sys, "unraisablehook", keep_interrupts)
    with pytest.raises(KeyboardInterrupt):
        dies_and_goes_on()


SHORT_RUN = "run planar_pendulum --method rattle --h 1e-3 --every 0 --steps"


@pytest.fixture(scope="module")
def seconds_of_a_command():
    """How long a short run takes with its kernel compiled: the second of two, s."""
    for _ in range(2):
        began = time.perf_counter()
        ended(f"{SHORT_RUN} 1")
    return time.perf_counter() - began


PARTS = [pytest.param(k / 12, marks=[pytest.mark.exhaustive] * (k not in (1, 7))) for k in range(1, 12)]
"""Parts of the time of a command, from its beginning to its end: the gate takes one early and one late."""


@pytest.mark.slow
@pytest.mark.parametrize("part", PARTS)
def test_ctrl_c_while_a_command_loads_is_one_sentence(part, seconds_of_a_command):
    code = "import os; os.write(2, b'.'); from daebench.cli.__main__ import main; main()"  # before, Python itself begins
    words = [*SHORT_RUN.split(), str(10**12)]
    with subprocess.Popen([sys.executable, "-c", code, *words], stdout=subprocess.PIPE, stderr=subprocess.PIPE) as command:
        assert command.stderr.read(1) == b"."
        time.sleep(0.1 + part * seconds_of_a_command)
        command.send_signal(signal.SIGINT)
        try:
            out, err = command.communicate(timeout=60)
        finally:
            command.kill()
    if command.returncode == 1:  # the run had begun: it is ended as any run that stops early, and says so
        assert (err, out.count(b"interrupted.")) == (b"", 1)
    else:
        assert (command.returncode, out, err.count(b"\n")) == (130, b"", 1)
        assert err.startswith(b"daebench: ")


def test_what_takes_long_says_what_it_does_where_there_is_no_terminal(daebench, folder, monkeypatch):
    monkeypatch.setattr(console, "SILENCE", 0.05)
    terms = "sum(sp.sin(k * q[0] + q[1]) * sp.exp(-q[1] ** 2 / (k + 1)) for k in range(25))"
    (folder / "mine.py").write_text(written("bead", H=f"M=sp.eye(2) * m, U={terms}"))
    status, out, err = daebench("check", "./mine.py")
    assert (status, out.count("ok")) == (0, 4)
    lines = err.splitlines()
    assert 1 <= len(lines) <= 14
    assert all(line.startswith("daebench: check ./mine.py") for line in lines)
    assert any("differentiable" in line for line in lines)


def test_a_short_command_says_nothing_beside_its_result(daebench):
    assert daebench("run", "planar_pendulum", "--method", "ida:index2", "--tol", "1e-6", "--t-end", "1", "--json")[2] == ""


DAMAGED = {"NaN": "NaN", "infinity": "Infinity", "minus infinity": "-Infinity", "beyond double precision": "1e999", "below": "-1e999"}


@pytest.mark.sampled(by=lambda case: case in ("amplification-NaN", "horizon-minus infinity", "drift-beyond double precision"))
@pytest.mark.parametrize("number", DAMAGED.values(), ids=DAMAGED)
@pytest.mark.parametrize("entry", ["amplification", "horizon", "drift"])
def test_a_certificate_with_what_is_no_number_is_damaged_and_the_others_are_listed(daebench, copied, number, entry):
    (name,) = (each.name for each in copied.iterdir() if each.is_dir())
    shutil.copytree(copied / name, copied / "planar_pendulum-resting")
    path = copied / name / "certificate.json"
    head, found, tail = path.read_text().partition(f'"{entry}": {{')
    path.write_text(head + found + re.sub(r"-?\d+\.\d+(e[-+]?\d+)?", number, tail, count=1))
    status, out, err = daebench("reference", "list", "--folder", copied)
    assert (status, err) == (1, "")
    assert f"{name}/certificate.json is truncated or altered: it has {number}" in " ".join(out.split())
    for command in (f"show {name}", f"verify {name}", "at planar_pendulum --case rotating --t 1", f"export {name}"):
        assert daebench("reference", *command.split(), "--folder", copied)[0] == 1

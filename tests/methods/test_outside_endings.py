"""Code that is named by its place ends nothing but its own run, whatever it does: a sentence, a status, and the rows of the others."""

import json
import os
import re
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import planting
import pytest
from ending_code import AT_IMPORT, ENDS, GO_ON, GOOD, LIBRARY_ENDS, PROGRAMS, SILENT, script

import daebench as package
from daebench.errors import LONGEST, BadInput
from daebench.methods.outside import process

PENDULUM = "planar_pendulum"
DRAWN = {name for family in (ENDS, LIBRARY_ENDS) for name in planting.drawn(family, planting.digest(), 3)}
"""Ways to end that the gate tries: other ones for each tree."""


def run(method, **settings):
    return package.run(PENDULUM, method=method, **{"h": 0.1, "steps": 5, "every": 1} | settings)


def one_sentence(text):
    """Return a text that is one line of bounded length without control characters."""
    assert text.isprintable()
    assert len(text) <= LONGEST
    return text


@pytest.mark.sampled(by=lambda case: case in DRAWN)
@pytest.mark.parametrize("name", ENDS)
def test_a_python_file_ends_its_own_run_alone(ends, name):
    found = run(f"./ends.py:{name}")
    assert ENDS[name] in one_sentence(found.failure)
    assert "t = 0.3 (step 4 of 5, h = 0.1)" in found.failure
    assert (found.steps, len(found.t)) == (GOOD, GOOD + 1)
    assert np.array_equal(found.q, np.tile(found.q[0], (GOOD + 1, 1)))


@pytest.mark.parametrize("name", GO_ON)
def test_a_python_file_that_prints_or_closes_goes_on(ends, capfd, name):
    assert run(f"./ends.py:{name}", steps=GOOD + 1).failure is None
    assert capfd.readouterr().out == ""


def test_code_that_closes_all_that_is_open_has_the_steps_that_it_took(ends):
    found = run(f"./ends.py:{SILENT}")
    assert re.search(r"status (1|120) after 5", found.failure)  # one or the other, by the release of Python
    assert found.steps == 5


@pytest.mark.sampled(by=lambda case: case in DRAWN)
@pytest.mark.parametrize("name", LIBRARY_ENDS)
def test_a_library_ends_its_own_run_alone(ending_library, name):
    found = run(f"{ending_library}:{name}", seconds_limit=1.0)
    assert LIBRARY_ENDS[name] in one_sentence(found.failure)
    good = 0 if name == "data" else GOOD
    assert found.steps >= good
    assert np.array_equal(found.q[: good + 1], np.tile(found.q[0], (good + 1, 1)))


@pytest.mark.parametrize("name", ["good", "prints", "changes_parameters"])
def test_a_library_that_is_odd_goes_on(ending_library, capfd, name):
    for _ in range(2):  # what it has made of the parameters is forgotten
        assert run(f"{ending_library}:{name}").failure is None
    assert capfd.readouterr().out == ""


@pytest.mark.parametrize("text", AT_IMPORT)
def test_a_file_that_ends_when_it_is_loaded_is_a_run_that_fails(folder, daebench, text):
    (folder / "ends.py").write_text(f"{text}\ndef step(p, q, h): return p, q\n")
    failure = run("./ends.py:step").failure
    assert AT_IMPORT[text] in one_sentence(failure)
    status, out, err = daebench("run", PENDULUM, "--method", "./ends.py:step", "--h", 0.1, "--steps", 5, "--json")
    assert (status, json.loads(out)["failure"], err) == (1, failure, "")


@pytest.mark.parametrize("text", PROGRAMS)
def test_a_program_ends_its_own_run_alone(folder, text):
    try:
        said = run(script(folder, text), seconds_limit=20.0).failure
    except BadInput as error:
        said = str(error)
    assert PROGRAMS[text] in one_sentence(said)


def test_functions_that_are_handed_over_tell_an_exit_from_an_interruption():
    def exits(p, q, h):
        sys.exit(0)

    def interrupted(p, q, h):
        raise KeyboardInterrupt

    class Exits:
        def __init__(self):
            sys.exit("at once")

        def step(self, p, q, h):
            return p, q

    assert run(exits).failure.endswith("SystemExit: 0.")
    assert run(Exits).failure.endswith("SystemExit: at once.")
    assert run(interrupted).interrupted


def test_cost_is_cpu_time_of_the_code(folder):
    (folder / "slow.py").write_text("import time\ndef step(p, q, h):\n    time.sleep(0.2)\n    return p, q\n")
    assert 0 < run("./slow.py:step").seconds < 0.9  # it sleeps for one


def test_runs_of_one_code_share_a_process_and_few_wait(folder):
    process.end_all()
    for k in range(process.MOST_IDLE + 2):
        (folder / f"code{k}.py").write_text("import os\ndef step(p, q, h):\n    return p * 0 + os.getpid(), q\n")
        first, second = (run(f"./code{k}.py:step", steps=1).p[-1, 0] for _ in range(2))
        assert first == second != os.getpid()
    assert len(process._idle) == process.MOST_IDLE
    process.end_all()
    assert not process._idle


def is_alive(number):
    """Return whether a process runs; one that has ended and that nobody asks for does not."""
    try:
        return Path(f"/proc/{number}/stat").read_text().rpartition(")")[2].split()[0] not in "ZX"
    except OSError:
        return False


def wait_until(true):
    until = time.monotonic() + 60.0
    while not true() and time.monotonic() < until:
        time.sleep(0.02)
    return true()


HANGS = """
import os, subprocess, time
from pathlib import Path

def step(p, q, h):
    other = subprocess.Popen(["sleep", "1000"])
    Path("numbers.part").write_text(f"{os.getpid()} {other.pid}")
    os.rename("numbers.part", "numbers")
    sum(iter(int, 1))
"""


@pytest.mark.sampled(left_out=("terminated",))
@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="there is no list of processes")
@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGTERM, signal.SIGINT], ids=["killed", "terminated", "interrupted"])
def test_no_process_outlives_daebench(folder, number):
    (folder / "hangs.py").write_text(HANGS)
    words = [sys.executable, "-m", "daebench", "run", PENDULUM, "--method", "./hangs.py:step", "--h", "0.1", "--steps", "5"]
    command = subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    try:
        assert wait_until(Path("numbers").exists)
        numbers = list(map(int, Path("numbers").read_text().split()))
        assert all(map(is_alive, numbers))
        command.send_signal(number)
        told = command.communicate(timeout=60)[0]
    finally:
        command.kill()
    assert command.returncode in (-number, 1, 130)
    assert "Traceback" not in told
    assert wait_until(lambda: not any(map(is_alive, numbers))), numbers
    assert number != signal.SIGINT or "interrupted" in told


COMMANDS = {
    "order": ("order", PENDULUM, "--methods", "{good},{code}", "--t-end", 1, "--halvings", 2),
    "diagnose": ("diagnose", "{code}", "--problem", PENDULUM),
    "advise": ("advise", PENDULUM, "--methods", "{good},{code}", "--accuracy", 1e-2, "--t-end", 1),
    "work-precision": ("work-precision", PENDULUM, "--methods", "{good},{code}", "--h", "0.1,0.05,0.025", "--t-end", 1, "--out", "wp"),
    "long": ("long", PENDULUM, "--methods", "{good},{code}", "--h", 0.1, "--steps", 1000, "--out", "long"),
    "certify": ("certify", "{code}", "--problem", PENDULUM, "--out", "certificate"),
    "animate": ("animate", PENDULUM, "--methods", "{good},{code}", "--h", 0.1, "--t-end", 1, "--out", "swing.html"),
    "stability": ("stability", PENDULUM, "--methods", "{good},{code}", "--only", "step-limit", "--t-end", 1, "--out", "limits"),
    "compare": ("compare", PENDULUM, "--methods", "{good},{code}", "--h", 0.1, "--t-end", 1),
    "run": ("run", PENDULUM, "--method", "{code}", "--h", 0.1, "--t-end", 1),
    "animate Poisson": ("animate", "free_rigid_body", "--methods", "{code}", "--h", 0.1, "--t-end", 1, "--out", "body.html"),
}


@pytest.mark.sampled(by=lambda case: case in ("order", "certify", "animate Poisson"))
@pytest.mark.slow
@pytest.mark.parametrize("command", COMMANDS)
def test_no_command_ends_with_code_that_ends(folder, daebench, command):
    (folder / "quits.py").write_text("import os\ndef step(p, q, h): os._exit(0)\n")
    words = [str(word).format(code="./quits.py:step", good="rattle") for word in COMMANDS[command]]
    for _ in range(1 + (command == "advise")):  # whose runs are stored then
        status, out, err = daebench(*words)
        assert status == 1
    said = " ".join((out + err).split())
    assert "./quits.py:step" in said
    assert "status 0" in said
    assert "fault of daebench" not in said
    if "{good}" in " ".join(map(str, COMMANDS[command])) and command != "animate":
        assert "rattle" in out


def test_terminal_escapes_are_nowhere(ends, daebench):
    for words in (
        ("run", PENDULUM, "--method", "./ends.py:escapes", "--h", 0.1, "--steps", 5),
        ("compare", PENDULUM, "--methods", "./ends.py:escapes,./ends.py:closes", "--h", 0.1, "--t-end", 0.5),
    ):
        status, out, err = daebench(*words)
        assert status == 1
        assert "\x1b" not in out + err
        assert "[2Jno root" in " ".join(out.split())


def test_memory_of_a_machine_is_the_most_that_code_may_have(folder):
    (folder / "limits.py").write_text(
        "import resource\ndef step(p, q, h):\n    return p * 0 + resource.getrlimit(resource.RLIMIT_DATA)[0], q\n"
    )
    if sys.platform == "linux":
        limit = run("./limits.py:step", steps=1, watch=()).p[-1, 0]
        assert 0 < limit <= os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")

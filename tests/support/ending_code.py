"""Code from outside that ends its process, or misbehaves otherwise, after three good steps: in Python, in C and as a program."""

import shutil
import stat
import subprocess

import pytest

GOOD = 3
"""Steps before it."""

PYTHON = """
import ctypes, os, signal, sys
import numpy as np

taken = 0

def later(action):
    def step(p, q, h):
        global taken
        taken += 1
        return (p, q) if taken <= 3 else action(p, q)
    return step

def raising(error):
    raise error

def deeper(p, q):
    return deeper(p, q)

def closing(p, q):
    os.closerange(1, 2)
    sys.stdout.close()
    return p, q

def printing(p, q):
    print("\\x1b[2J printed")
    os.write(1, b"written\\n")
    ctypes.CDLL(None).puts(b"put")
    return p, q

def forking(p, q):
    os.fork()
    return p, q

class Unnamed(Exception):
    def __str__(self):
        raise ValueError("no text")

leaves = later(lambda p, q: os._exit(0))
leaves_with_3 = later(lambda p, q: os._exit(3))
sys_exit = later(lambda p, q: sys.exit(0))
quits = later(lambda p, q: quit())
aborts = later(lambda p, q: os.abort())
reads_nothing = later(lambda p, q: ctypes.string_at(0))
kills = later(lambda p, q: os.kill(os.getpid(), signal.SIGKILL))
kills_its_group = later(lambda p, q: os.killpg(0, signal.SIGKILL))
terminates = later(lambda p, q: os.kill(os.getpid(), signal.SIGTERM))
interrupts = later(lambda p, q: os.kill(os.getpid(), signal.SIGINT) or os.read(0, 1) and None)
recurses = later(deeper)
closes_all = later(lambda p, q: os.closerange(0, 100) or (p, q))
closes = later(closing)
prints = later(printing)
forks = later(forking)
huge = later(lambda p, q: ([10**400] * len(p), q))
wide = later(lambda p, q: (p[:1], q))
text = later(lambda p, q: ("no", "state"))
lazy = later(lambda p, q: (1 / 0 for _ in range(2)))
spoils = later(lambda p, q: (p * np.nan, q))
escapes = later(lambda p, q: raising(ValueError("\\x1b[2Jno\\rroot\\u202e " + "a" * 10**6)))
unnamed = later(lambda p, q: raising(Unnamed()))
greedy = later(lambda p, q: [np.zeros(2**27) for _ in range(10**4)])
"""

ENDS = {
    "leaves": "the process of the code exited with status 0 after 3 steps",
    "leaves_with_3": "the process of the code exited with status 3 after 3 steps",
    "sys_exit": "SystemExit: 0",
    "quits": "SystemExit",
    "aborts": "was ended by signal SIGABRT (aborted) after 3 steps",
    "reads_nothing": "was ended by signal SIGSEGV (segmentation fault) after 3 steps",
    "kills": "was ended by signal SIGKILL (killed, as the system does where memory runs out) after 3 steps",
    "kills_its_group": "was ended by signal SIGKILL",
    "terminates": "was ended by signal SIGTERM (terminated) after 3 steps",
    "interrupts": "the code raises KeyboardInterrupt",
    "recurses": "RecursionError",
    "huge": "a number in it is too large for double precision",
    "wide": "their shapes are (1,) and (2,)",
    "text": "must return p and q, of shape (2,) each; it returned tuple",
    "lazy": "reading what it returned raises ZeroDivisionError",
    "spoils": "a value is no longer finite",
    "escapes": "ValueError: [2Jno root aaa",
    "unnamed": "Unnamed",
    "greedy": "MemoryError",
}
"""What is said of each; the others go on."""

GO_ON = ("closes", "prints", "forks")
"""Codes that go on."""

SILENT = "closes_all"
"""Code that goes on, but cannot say so."""

LIBRARY = r"""
#include <stdlib.h>
#include <stdio.h>
#include <math.h>
#include <signal.h>
#include <string.h>
#include <unistd.h>
#define ARGUMENTS (const double *par, double *p, double *q, double h)
#define LATER(name, action) int name ARGUMENTS { static int taken; if (++taken > 3) { action; } return 0; }
static int deeper(int depth) { volatile char room[1 << 16]; room[0] = depth; return deeper(depth + 1) + room[0]; }
LATER(good, )
LATER(stops, return 3)
LATER(reads_nothing, *(volatile int *)0 = 1)
LATER(aborts, abort())
LATER(exits, exit(0))
LATER(leaves, _exit(0))
LATER(kills, kill(getpid(), SIGKILL))
LATER(overflows, return deeper(0))
LATER(divides, volatile int none = 0; return 10 / none)
LATER(spoils, p[0] = NAN)
LATER(writes_far, memset(p, 65, 1 << 24))
LATER(writes_near, p[64] = 1)
LATER(writes_before, q[-1] = 1)
LATER(changes_parameters, ((double *)par)[0] = 1e9)
LATER(waits, for (;;) sleep(1))
LATER(prints, printf("printed\n"))
int data = 5;
double real ARGUMENTS { return 1.5; }
"""

LIBRARY_ENDS = {
    "stops": "the function of the library returned 3 instead of 0",
    "reads_nothing": "was ended by signal SIGSEGV (segmentation fault) after 3 steps",
    "aborts": "was ended by signal SIGABRT (aborted) after 3 steps",
    "exits": "exited with status 0 after 3 steps",
    "leaves": "exited with status 0 after 3 steps",
    "kills": "was ended by signal SIGKILL",
    "overflows": "was ended by signal SIGSEGV",
    "divides": "was ended by signal SIGFPE",
    "spoils": "a value is no longer finite",
    "writes_far": "was ended by signal SIG",
    "writes_near": "writes outside of the vectors",
    "writes_before": "writes outside of the vectors",
    "waits": "the limit of 1 s is reached",
    "data": "was ended by signal SIGSEGV (segmentation fault) after 0 steps",
}

AT_IMPORT = {
    "import os; os._exit(0)": "the process of the code exited with status 0 while the file was loaded",
    "import sys; sys.exit(0)": "line 1: SystemExit: 0",
    "exit()": "line 1: SystemExit",
    "import os; os.abort()": "was ended by signal SIGABRT (aborted) while the file was loaded",
}
"""What is said of files that end when they are loaded."""

STATES = "for k in 1 2 3 4 5; do echo 0 0 1 0; done"

PROGRAMS = {
    "exit 0": "the program ended after 0 of 5 states: it exited with status 0",
    "kill -SEGV $$": "it was ended by signal SIGSEGV (segmentation fault)",
    r"printf '\033[2J\n'": "writes '[2J', which is not a state",
    f"{STATES}; yes '[' | head -100000 | tr -d '\\n'": "writes 0 numbers in a line",
    f"{STATES}; yes '{{\"a\":' | head -100000 | tr -d '\\n'": "it must write its seconds",
    r"printf 'bad \033[2J\n' >&2; exit 2": "it exited with status 2: bad [2J",
}
"""What is said of shell scripts."""


@pytest.fixture
def ends(folder):
    (folder / "ends.py").write_text(PYTHON)
    return folder


@pytest.fixture(scope="module")
def ending_library(tmp_path_factory):
    if shutil.which("gcc") is None:
        pytest.skip("there is no C compiler")
    place = tmp_path_factory.mktemp("ending")
    (place / "ends.c").write_text(LIBRARY)
    subprocess.run(["gcc", "-w", "-O1", "-shared", "-fPIC", "-o", "libends.so", "ends.c", "-lm"], cwd=place, check=True)
    return place / "libends.so"


def script(folder, text):
    """Return the name of a method that is a shell script."""
    path = folder / "script"
    path.write_text(f"#!/bin/sh\n{text}\n")
    path.chmod(path.stat().st_mode | stat.S_IXUSR)
    return f"exec:{path}"

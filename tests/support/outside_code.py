"""Code from outside: steps of RATTLE and mistaken ones in Python, in C, and as a program; and how tests run them."""

import shutil
import stat
import subprocess
import sys
import textwrap

import pytest

import daebench

RATTLE = """
import numpy as np

calls = 0

def step(p, q, h):
    '''One step of RATTLE for a ball on a string: mass, length and gravity 1.'''
    force = np.array([0.0, 0.0, -1.0])
    start = p + h / 2 * force
    a, b, c = h * h * (q @ q), -2 * h * (q @ (q + h * start)), (q + h * start) @ (q + h * start) - 1.0
    lam = 2 * c / (-b + np.sqrt(b * b - 4 * a * c))
    half = start - lam * q
    end = q + h * half
    last = half + h / 2 * force
    return last - end * (end @ last) / (end @ end), end

def solve(p, q, h, t):
    rows, now = [], 0
    for end in t:
        while now < round(end / h):
            p, q = step(p, q, h)
            now += 1
        rows.append((p, q))
    return np.array([row[0] for row in rows]), np.array([row[1] for row in rows])

class Counting:
    def __init__(self):
        self.steps = 0
    def step(self, p, q, h):
        self.steps += 1
        return step(p, q, h) if self.steps <= 100 else (p, q)

counting = Counting()

def in_place(p, q, h):
    p += 1.0
    return p, q

def fails(p, q, h):
    global calls
    calls += 1
    return (p, q) if calls < 8 else (p / (1 // (calls - calls)), q)

def one(p, q, h):
    return p

def blows_up(p, q, h):
    return 1e200 * p * p, q

def spoils(p, q, h):
    return p, q + np.nan

def hangs(p, q, h):
    try:
        while p[0] > 0.105: pass  # hangs
    except Exception:
        return p, q
    return p + [h, 0, 0], q

class Hanging:
    def __init__(self):
        while True: pass  # Hanging
    def step(self, p, q, h):
        return p, q

def shrinks(p, q, h):
    return (p + [h, 0, 0], q) if p[0] < 0.105 else (p, q[:2])

def forgets(p, q, h):
    if p[0] > 0.105:
        q *= 2
    return p + [h, 0, 0], q

def reduced(p, q, h):
    '''Symplectic Euler on the index-reduced equation.'''
    force = np.array([0.0, 0.0, -1.0])
    p = p + h * (force - (p @ p + force @ q) / (q @ q) * q)
    return p, q + h * p

def interrupted(p, q, h):
    import os, signal, time
    for _ in range(3):
        os.kill(os.getppid(), signal.SIGINT)  # daebench waits for this process
        time.sleep(0.15)
    while True: pass

def prints(p, q, h):
    print("a step")
    return p, q

def raises(p, q, h):
    raise ValueError("no root")  # raises

def of_poisson(y, h):
    return y
"""

LIBRARY = r"""
#include <math.h>
#include <unistd.h>
static double dot(const double *a, const double *b) { return a[0]*b[0] + a[1]*b[1] + a[2]*b[2]; }
int step(const double *par, double *p, double *q, double h)
{
    double moved[3], start[3] = {p[0], p[1], p[2] - h / 2 * par[0] * par[2]};
    for (int i = 0; i < 3; i++) moved[i] = q[i] + h * start[i] / par[0];
    double k = h / par[0], a = k * k * dot(q, q), b = -2 * k * dot(q, moved), c = dot(moved, moved) - par[1] * par[1];
    double lam = 2 * c / (-b + sqrt(b * b - 4 * a * c)), end[3], last[3];
    for (int i = 0; i < 3; i++) end[i] = q[i] + h * (start[i] - lam * q[i]) / par[0];
    for (int i = 0; i < 3; i++) last[i] = start[i] - lam * q[i] - (i == 2) * h / 2 * par[0] * par[2];
    double along = dot(end, last) / dot(end, end);
    for (int i = 0; i < 3; i++) { p[i] = last[i] - along * end[i]; q[i] = end[i]; }
    return 0;
}
int gives_up(const double *par, double *p, double *q, double h) { return q[2] > -0.999 ? 0 : 7; }
int twice(const double *par, double *p, double *q, double h) { return step(par, p, q, h / 2) || step(par, p, q, h / 2); }
int fails_late(const double *par, double *p, double *q, double h)
{
    return step(par, p, q, h) || q[0] < 0;
}
int hangs(const double *par, double *p, double *q, double h)
{
    volatile double moved = p[0] += h;
    while (moved > 0.105) sleep(1);  /* the thread is left, and is not to keep a core busy */
    return 0;
}
int doubles(const double *par, double *y, double h) { y[0] *= 2; return 0; }
"""

PROGRAM = """
#!{python}
import json, sys, time
import numpy as np
sys.path.insert(0, {folder!r})
from mine import step

asked = json.loads(sys.stdin.readline())
p, q, began = np.array(asked["p"]), np.array(asked["q"]), time.perf_counter()
for k in range(1, asked["steps"] + 1):
    p, q = step(p, q, asked["h"])
    if k == asked["steps"] or asked["every"] and k % asked["every"] == 0:
        print(*map(repr, map(float, (*p, *q))))
print(json.dumps({{"seconds": time.perf_counter() - began}}))
"""

BALL = {"problem": "spherical_pendulum", "case": "fig1.1"}


@pytest.fixture
def mine(folder):
    (folder / "mine.py").write_text(RATTLE)
    return folder


@pytest.fixture(scope="module")
def library(tmp_path_factory):
    if shutil.which("gcc") is None:
        pytest.skip("there is no C compiler")
    place = tmp_path_factory.mktemp("library")
    (place / "mine.c").write_text(LIBRARY)
    subprocess.run(["gcc", "-O2", "-shared", "-fPIC", "-o", "libmine.so", "mine.c", "-lm"], cwd=place, check=True)
    return place / "libmine.so"


@pytest.fixture
def program(mine):
    path = mine / "program"
    path.write_text(textwrap.dedent(PROGRAM.format(python=sys.executable, folder=str(mine))).lstrip())
    path.chmod(path.stat().st_mode | stat.S_IXUSR)
    return path


def run(method, **settings):
    """Return the trajectory of a method on the spherical pendulum, of 200 steps where nothing else is said."""
    return daebench.run(BALL["problem"], case=BALL["case"], method=method, **{"h": 0.01, "t_end": 2.0} | settings)


def script(folder, text):
    """Return the name of a method that is a shell script."""
    path = folder / "script"
    path.write_text(f"#!/bin/sh\n{text}\n")
    path.chmod(path.stat().st_mode | stat.S_IXUSR)
    return f"exec:{path}"

"""Codes as people write them for certificates: a ball on a rod by RATTLE, and the same with mistakes; measured in this process, briefly."""

import contextlib
import os

import uncompiled

from daebench.studies.certificate import measure, process
from daebench.studies.orders import bench as runs

BALL = '''"""A ball on a rod: mass 2, length 1, gravity 3, by RATTLE and by what is not."""

import numpy as np
from forces import GRAVITY, LENGTH, MASS, force


def on_rod(q, direction):
    """Return how far q has to move along a direction to be on the sphere."""
    a, b, c = direction @ direction, 2 * (q @ direction), q @ q - LENGTH**2
    return -2 * c / (b + np.sqrt(b * b - 4 * a * c))


def tangent(p, q):
    return p - q * (q @ p) / (q @ q)


def rattle(p, q, h, sign=1.0, mass=MASS):
    half = p + sign * h / 2 * force(q)
    moved = q + h / mass * half
    end = moved + on_rod(moved, q) * q
    half = (end - q) * mass / h
    return half + sign * h / 2 * force(end), end


def step(p, q, h):
    """RATTLE."""
    p, q = rattle(p, q, h)
    return tangent(p, q), q


def shake(p, q, h):
    """The velocity is not projected."""
    return rattle(p, q, h)


def sign(p, q, h):
    """The force has the wrong sign."""
    p, q = rattle(p, q, h, sign=-1.0)
    return tangent(p, q), q


def massless(p, q, h):
    """The mass is left out where the ball moves."""
    p, q = rattle(p, q, h, mass=1.0)
    return tangent(p, q), q


def projected(p, q, h):
    """Heun's method for the free ball, and both constraints met afterwards."""
    middle = p + h * force(q)
    end = q + h / 2 * (p + middle) / MASS
    end = end * LENGTH / np.sqrt(end @ end)
    return tangent(p + h * force(q), end), end


CLAIMS = {"order": 2, "symmetric": True, "symplectic": True, "keeps_g": True, "keeps_Gv": True}
for code in (step, shake, sign, massless, projected):
    code.claims = CLAIMS
'''

FORCES = """import numpy as np

MASS, LENGTH, GRAVITY = 2.0, 1.0, 3.0


def force(q):
    return np.array([0.0, 0.0, -MASS * GRAVITY])
"""

PARAMETERS = {"mass": 2.0, "gravity": 3.0}
PROBLEM = "spherical_pendulum:fig1.1"

RIGID = '''"""Euler's equations of a free rigid body by turns about its axes: I = (0.6, 0.8, 1)."""

import numpy as np

INERTIA = (0.6, 0.8, 1.0)


def turn(y, k, t):
    angle = t * y[k] / INERTIA[k]
    i, j = (k + 1) % 3, (k + 2) % 3
    c, s = np.cos(angle), np.sin(angle)
    out = y.copy()
    out[i], out[j] = c * y[i] + s * y[j], c * y[j] - s * y[i]
    return out


def step(y, h):
    for k, share in ((0, 0.5), (1, 0.5), (2, 1.0), (1, 0.5), (0, 0.5)):
        y = turn(y, k, share * h)
    return y


step.claims = {"order": 2, "symmetric": True, "symplectic": True}


def euler(y, h):
    w = y / np.array(INERTIA)
    return y + h * np.cross(y, w)


euler.claims = step.claims
'''


def write_codes(folder):
    """Write the codes into a folder."""
    (folder / "ball.py").write_text(BALL)
    (folder / "forces.py").write_text(FORCES)
    (folder / "rigid.py").write_text(RIGID)


def in_this_process(tasks, folder, seconds=0.0, progress=None):
    """Answer tasks in this process, in the folder of the code."""
    with contextlib.chdir(folder):
        return [process.answer(task) for task in tasks]


def measure_briefly(monkeypatch):
    """Have codes be measured in this process, along short runs, with formulations that are not compiled."""
    monkeypatch.setattr(process, "measured", in_this_process)
    monkeypatch.setattr(measure, "LONG", 1000)
    monkeypatch.setattr(measure, "SHORT", 250)
    monkeypatch.setattr(runs, "SLOW", 0.05)
    monkeypatch.setattr("daebench.methods.formulations.constrained._module", uncompiled.kept_module)
    monkeypatch.setenv("DAEBENCH_CACHE", os.environ["DAEBENCH_CACHE"])


LIBRARY = r"""
#include <math.h>
static double dot(const double *a, const double *b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
int step(const double *par, double *p, double *q, double h)
{
    double force[3] = {0, 0, -par[0] * par[2]}, moved[3], end[3];
    for (int i = 0; i < 3; i++) moved[i] = q[i] + h / par[0] * (p[i] + h / 2 * force[i]);
    double a = dot(q, q), b = 2 * dot(moved, q), c = dot(moved, moved) - par[1] * par[1];
    double along = -2 * c / (b + sqrt(b * b - 4 * a * c));
    for (int i = 0; i < 3; i++) end[i] = moved[i] + along * q[i];
    for (int i = 0; i < 3; i++) p[i] = (end[i] - q[i]) * par[0] / h + h / 2 * force[i];
    double off = dot(end, p) / dot(end, end);
    for (int i = 0; i < 3; i++) { p[i] -= off * end[i]; q[i] = end[i]; }
    return 0;
}
"""

PROGRAM = """#!{python}
import json, sys, time
import numpy as np
from ball import step

asked = json.loads(sys.stdin.readline())
p, q, began = np.array(asked["p"]), np.array(asked["q"]), time.perf_counter()
for k in range(1, asked["steps"] + 1):
    p, q = step(p, q, asked["h"])
    if k == asked["steps"] or asked["every"] and k % asked["every"] == 0:
        print(*map(repr, map(float, (*p, *q))))
print(json.dumps({{"seconds": time.perf_counter() - began}}))
"""

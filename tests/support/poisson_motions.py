"""Poisson systems with right sides written by hand, integrated by DOP853, and their generated modules without machine code."""

from functools import cache

import numpy as np
import uncompiled
from scipy.integrate import solve_ivp

from daebench.methods.formulations import poisson_residuals
from daebench.methods.initial_value_problem import initial_value_problem

_kept = {}


def plain_module(ivp, formulation, multipliers):
    """The generated source run as it stands, with ``njit`` standing for nothing, made once."""
    key = (ivp.problem, len(ivp.y0), formulation, multipliers)
    if key not in _kept:
        text = poisson_residuals.source("Uncompiled.", ivp.source.derivation, formulation, multipliers)
        _kept[key] = uncompiled.run(text, "uncompiled")
    return _kept[key]


@cache
def ivp_of(name):
    problem, case = {
        "body": ("free_rigid_body", "hlw"),
        "top": ("heavy_top_lie_poisson", "kovalevskaya"),
        "prey": ("lotka_volterra", "6,2"),
        "three": ("lotka_volterra_3d", "blow_up"),
        "late": ("lotka_volterra_3d", "late"),
        "lattice": ("ablowitz_ladik", None),
    }[name]
    return initial_value_problem(problem, case)


# ---- right sides written by hand -----------------------------------------------------------------------------------------


def body(y):
    return np.cross(y, np.array(y) / [0.6, 0.8, 1.0])


def top(state):
    y, Gamma = state[:3], state[3:]
    omega = np.array(y) / [1.0, 1.0, 0.5]
    return np.concatenate([np.cross(y, omega) + np.cross(Gamma, [1.0, 0.0, 0.0]), np.cross(Gamma, omega)])


def prey(y):
    return np.array([y[0] * (y[1] - 2), y[1] * (1 - y[0])])


def three(y):
    return np.array([y[0] * (y[1] + y[2]), y[1] * (y[0] - y[2] + 1), y[2] * (y[0] + y[1] + 1)])


def lattice(state):
    """(4.10) in complex numbers, on a circle of length 1."""
    y = state[:16] + 1j * state[16:]
    around = np.roll(y, 1) + np.roll(y, -1)
    rate = 1j * ((around - 2 * y) * 16**2 + abs(y) ** 2 * around)
    return np.concatenate([rate.real, rate.imag])


BY_HAND = {"body": body, "top": top, "prey": prey, "three": three, "late": three, "lattice": lattice}


@cache
def solution(name, t):
    found = solve_ivp(lambda _, y: BY_HAND[name](y), (0, t), ivp_of(name).y0, method="DOP853", rtol=1e-13, atol=1e-14)
    assert found.success
    return found.y[:, -1]

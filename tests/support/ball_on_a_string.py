"""RATTLE by hand for a ball of mass 1 on a string of length 1, in gravity 1 against the last axis: the multiplier is in closed form."""

import numpy as np


def force(q):
    return -np.eye(len(q))[-1]


def shake(p, q, h):
    """Return momenta and positions after a step whose momenta are not projected."""
    start = p + h / 2 * force(q)
    moved = q + h * start
    a, b, c = h * h * (q @ q), -2 * h * (q @ moved), moved @ moved - 1.0
    half = start - 2 * c / (-b + np.sqrt(b * b - 4 * a * c)) * q
    return half + h / 2 * force(q), q + h * half


def rattle(p, q, h):
    p, q = shake(p, q, h)
    return p - q * (q @ p) / (q @ q), q

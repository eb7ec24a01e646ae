"""The planar pendulum that rotates, in closed form: the digits of its reference."""

import mpmath as mp

from daebench.problems.planar_pendulum import closed_form

NAME = "planar_pendulum-rotating"
COMPONENTS = ("q1", "q2", "p1", "p2", "lam1")
UNIT = {"mass": 1, "length": 1, "gravity": 1}


def exact(t):
    """Return q, p and lam at a time, with as many digits as mpmath works with."""
    q, p = closed_form(mp.mpf(t), (0, -1), (mp.mpf(5) / 2, 0), UNIT)
    return q, p, [(p[0] ** 2 + p[1] ** 2 - q[1]) / 2]


def texts(t, digits):
    """Return the numbers of all components at a time as decimal texts."""
    with mp.workdps(digits + 16):
        return [mp.nstr(x, digits) for part in exact(t) for x in part]

"""Whether every step follows the velocities: the equations of a step have more than one solution, and Newton may find another."""

from typing import Any

import numpy as np

from daebench.runs.trajectory import Array

WRONG = 0.5
"""Smallest jump of a step that does not continue the motion; a turn by theta in one step, resolved, gives theta^2/12."""


def largest_jump(t: Array, q: Array, v: Array) -> Any:
    """Return the largest distance of the end of a step from that by the velocities at its two ends, in steps of the largest velocity.

    ::

        max_n |q_{n+1} - q_n - (t_{n+1} - t_n) (v_n + v_{n+1})/2|  /  max_n (t_{n+1} - t_n) max(|v_n|, |v_{n+1}|)

    It is O(h^2) for a method of order two and O(h) for one of order one. On a circle, where a step of RATTLE meets a quadratic equation,
    the other solution is opposite: its jump is the diameter over h |v|.

    Parameters
    ----------
    t : ndarray, shape(n,)
        Times of all steps, s.
    q, v : ndarray, shape(n, ..., d)
        Positions and velocities of one motion, or of several.

    Returns
    -------
    float or ndarray, shape(...)
        0 for a motion that rests.
    """
    off, way = jump_and_way(t, q, v)
    return np.divide(off, way, out=np.zeros_like(way), where=way > 0)[()]


def jump_and_way(t: Array, q: Array, v: Array) -> tuple[Array, Array]:
    """Return the two maxima whose ratio :func:`largest_jump` is, shape(...)."""
    h = np.diff(t).reshape(-1, *[1] * (q.ndim - 2))
    off = _length(q[1:] - q[:-1] - h[..., None] * (v[:-1] + v[1:]) / 2)
    speed = _length(v)
    return np.max(off, axis=0), np.asarray(np.max(h * np.maximum(speed[:-1], speed[1:]), axis=0))


def _length(vectors: Array) -> Array:
    return np.asarray(np.sqrt(np.sum(vectors * vectors, axis=-1)))

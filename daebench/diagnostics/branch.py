"""Whether every step goes where the velocities lead: the equations of a step have more than one solution, and Newton may find another."""

import numpy as np

from daebench.runs.trajectory import Array

WRONG = 0.5
"""Jump from which on a step is not the one that continues the motion; a turn by theta in one step, resolved, gives theta^2/12."""


def largest_jump(t: Array, q: Array, v: Array) -> float:
    """Return how far a step ends from where the velocities at its two ends lead, at most, in steps of the largest velocity.

    ::

        max_n |q_{n+1} - q_n - (t_{n+1} - t_n) (v_n + v_{n+1})/2|  /  max_n (t_{n+1} - t_n) max(|v_n|, |v_{n+1}|)

    It is O(h^2) for a method of order two and O(h) for one of order one. On a circle, where a step of RATTLE meets a quadratic equation,
    the other solution is opposite: its jump is the diameter over h |v|.

    Parameters
    ----------
    t : ndarray, shape(n,)
        Times of all steps, s.
    q, v : ndarray, shape(n, d)
        Positions and velocities.

    Returns
    -------
    float
        0 for a motion that rests.
    """
    h = np.diff(t)
    off = np.linalg.norm(np.diff(q, axis=0) - h[:, None] * (v[:-1] + v[1:]) / 2, axis=1)
    speed = np.linalg.norm(v, axis=1)
    way = float(np.max(h * np.maximum(speed[:-1], speed[1:])))
    return float(np.max(off)) / way if way > 0 else 0.0

"""The monitor call after steps of a tolerance-driven run, as functions of its unknowns, see :mod:`daebench.methods.solvers.monitored`.

The numbers at its head are common to it and to that monitor. The functions are read as text, and compiled with generated functions of one
problem into one function that C can call. A regular step is recorded in the memory of :mod:`daebench.compiler.callbacks`; all others are
left to the monitor of the run, which examines them and reports its findings. Each condition here is a condition of the monitor, or holds
whenever that does.
"""

from typing import Any

import numpy as np
from numpy import isfinite, sqrt

from daebench.compiler.callbacks import (
    BEFORE,
    CHANGES,
    CONSERVED,
    EXPLAINED,
    HEAD,
    JUMPS,
    LARGEST,
    LAST,
    MODE,
    ORDER,
    OUTPUT,
    POSITIONS,
    RESULT,
    SIGMA,
    STEADY,
    STEP,
    TOLERANCE,
    UNKNOWNS,
    carray,
    real_pointer,
    word_pointer,
)

COLLAPSE = 1e-9
"""A thousand steps that cover less than this part of the run will not end: the step size has collapsed."""

LEAST = 10.0
"""So has one below this many spacings of the numbers at t, if it is neither at the very start nor the last: it will not move t at all."""

INCREMENT = 1e-7
"""Increment of an unknown, in parts of its modulus and of 1, by which derivatives are taken."""

ROUNDINGS = 8.0 * float(np.finfo(float).eps)
"""Relative change of a value that rounding explains."""

SUDDEN = 100.0
"""A step that changes what is conserved by so many times as much as the tolerance explains has gone over a singularity.

Over 8 problems of the catalogue with 14 solvers at tolerances from 1e-2 to 1e-11 no step changed it by more than 30 times as much.
"""

AHEAD = 2.0
"""How many of the last step the loss of rank may be ahead: the next one may be as much larger."""

CLOSE = 1e-3
"""Part of the largest sigma so far below which the loss is near however short the steps are: solvers shrink them towards it."""

UNRESOLVED = 0.2
"""Relative change of sigma in a step above which the step is searched for a loss of rank inside."""


SIZE = 0
"""Number of unknowns that are no multipliers, of the problem at hand."""


def conserved(y: Any, par: Any) -> Any:
    """Return the constants of a motion, generated for the problem at hand."""
    raise NotImplementedError


def independent(y: Any, par: Any) -> float:
    """Return the square of what goes to zero where G loses rank, generated for the problem at hand."""
    raise NotImplementedError


def outside(y: Any, par: Any) -> bool:
    """Return whether the unknowns have left the domain, generated for the problem at hand."""
    raise NotImplementedError


def parameters(user: Any) -> Any:
    """Return the parameters, a tuple, generated for the problem at hand."""
    raise NotImplementedError


def explained(y: Any, h: float, tolerance: float, positions: int, par: Any) -> Any:
    """Return the change of the first and of the last conserved value by errors of tol (1 + |y_j|) in all unknowns.

    ``positions`` is the number of positions where velocities are out of the error test, and so uncertain by the error of positions over the
    step; else 0.
    """
    at, moved = conserved(y, par), y.copy()
    first, last, farthest = ROUNDINGS * abs(at[0]), ROUNDINGS * abs(at[-1]), 0.0
    for j in range(positions):
        farthest = max(farthest, abs(y[j]))
    for j in range(SIZE):
        length = 1.0 + abs(y[j])
        error = tolerance * length
        if 0 < positions <= j:
            error += tolerance * (1.0 + farthest) / h
        moved[j] = y[j] + INCREMENT * length
        other = conserved(moved, par)
        first += abs(other[0] - at[0]) * error / (INCREMENT * length)
        last += abs(other[-1] - at[-1]) * error / (INCREMENT * length)
        moved[j] = y[j]
    return first, last


def at_least_explained(y: Any, tolerance: float, par: Any) -> Any:
    """Return a part of what ``explained`` gives, from one value in place of one for each unknown: all of these are moved at once.

    The modulus of a sum is at most the sum of moduli, so that no more is returned than there is.
    """
    at, moved = conserved(y, par), y.copy()
    for j in range(SIZE):
        moved[j] = y[j] + INCREMENT * (1.0 + abs(y[j])) * (1.0 if j % 2 else -1.0)
    other = conserved(moved, par)
    return abs(other[0] - at[0]) * tolerance / INCREMENT, abs(other[-1] - at[-1]) * tolerance / INCREMENT


def state(user: Any, address: Any) -> Any:
    """Return unknowns in the order of the blocks, shape(n,), of those at an address."""
    n, order = int(carray(real_pointer(user), HEAD)[UNKNOWNS]), carray(word_pointer(user), HEAD)[ORDER]
    values = carray(real_pointer(address), n)
    if order:
        places, values = carray(word_pointer(order), n), values.copy()
        for i in range(n):
            values[places[i]] = carray(real_pointer(address), n)[i]
    return values


def usual_change(user: Any, t: float, y: Any, values: Any, par: Any) -> bool:
    """Return whether what is conserved changes no more in a step than before, or than the tolerance explains; note the change."""
    memory = carray(real_pointer(user), HEAD)
    first, last = abs(values[0] - memory[CONSERVED]), abs(values[-1] - memory[CONSERVED + len(values) - 1])
    if first <= memory[JUMPS] and last <= memory[JUMPS + len(values) - 1]:
        return True
    least = at_least_explained(y, memory[TOLERANCE], par)
    if not (first <= SUDDEN * least[0] and last <= SUDDEN * least[1]):
        h, positions = t - memory[LAST], int(memory[POSITIONS])
        before = explained(state(user, carray(word_pointer(user), HEAD)[BEFORE]), h, memory[TOLERANCE], positions, par)
        after = explained(y, h, memory[TOLERANCE], positions, par)
        memory[EXPLAINED] += 1.0
        if not (first <= SUDDEN * max(before[0], after[0]) and last <= SUDDEN * max(before[1], after[1])):
            return False
    memory[JUMPS], memory[JUMPS + len(values) - 1] = max(first, memory[JUMPS]), max(last, memory[JUMPS + len(values) - 1])
    return True


def usual_rank(memory: Any, sigma: float) -> bool:
    """Return whether G is far from losing rank, and was in the step."""
    before, largest = memory[SIGMA], max(sigma, memory[LARGEST])
    return bool(abs(sigma - before) <= UNRESOLVED * min(sigma, before) and sigma > AHEAD * (before - sigma) and sigma > CLOSE * largest)


def finite(values: Any) -> bool:
    """Return whether all values are finite."""
    total = 0.0
    for value in values:
        total += value
    return bool(isfinite(total))


def usual_step(user: Any, t: float, y: Any, par: Any) -> bool:
    """Return whether nothing is amiss with a step that ended at t, and note it then."""
    memory, values = carray(real_pointer(user), HEAD), conserved(y, par)
    if not finite(values) or outside(y, par) or (memory[STEADY] > 0.0 and not usual_change(user, t, y, values, par)):
        return False
    sigma = sqrt(abs(independent(y, par)))
    if not usual_rank(memory, sigma):
        return False
    for k in range(len(values)):
        memory[CONSERVED + k] = values[k]
    memory[SIGMA], memory[LARGEST], memory[LAST] = sigma, max(sigma, memory[LARGEST]), t
    return True


def look_callback(t: float, address: Any, user: Any) -> int:
    """Look as ``MODE`` says at time t at the unknowns at an address; return 0, or 1 where something is amiss."""
    memory, y, par = carray(real_pointer(user), HEAD), state(user, address), parameters(user)
    if memory[MODE] == STEP:
        return 0 if usual_step(user, t, y, par) else 1
    if memory[MODE] == CHANGES:
        memory[RESULT], memory[RESULT + 1] = explained(y, t, memory[TOLERANCE], int(memory[POSITIONS]), par)
        return 0
    values = conserved(y, par)
    if memory[MODE] == OUTPUT:
        return 0 if finite(values) and not outside(y, par) else 1
    for k in range(len(values)):
        memory[RESULT + k] = values[k]
    memory[RESULT + 3] = independent(y, par)
    return 0


WRITTEN = (explained, at_least_explained, state, usual_change, usual_rank, finite, usual_step, look_callback)
"""The functions that are the same for all problems."""

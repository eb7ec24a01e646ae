"""Numbers of what is amiss with a step, common to the monitor of a run and its compiled look at each step."""

import numpy as np

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

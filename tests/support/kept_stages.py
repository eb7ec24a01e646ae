"""Motions of a case that a certificate rests on, each made once, and equations of motion that are off by a little."""

import mpmath as mp

from daebench.methods.solvers.taylor_equations import library
from daebench.reference.keep.definition import Definition, define
from daebench.reference.make.independent_computations import Computations


def keeping():
    """Return a function that gives the result of a stage, which it makes once."""
    made = {}

    def keep(stage, make):
        if stage not in made:
            made[stage] = make()
        return made[stage]

    return keep


def times(t_end, n):
    return [mp.mpf(t_end) * k / n for k in range(n + 1)]


def computations(problem, case, t_end, n):
    """Return the motions of a case of the catalogue, each made once."""
    return Computations(define(problem, case), times(t_end, n), keeping())


def computations_at(ivp, t_end, n):
    """Return the motions from where an initial value problem begins, each made once."""
    return Computations(Definition(ivp, {}), times(t_end, n), keeping())


def spoiled(equations, where, share):
    """Return equations with one rate off by a part of it."""
    factor = library().real128(1) + library().real128(share)
    return [(x, rate * factor if k == where else rate) for k, (x, rate) in enumerate(equations)]

"""Functions of generated modules: those of the same text are one, and whatever a function reads or calls is part of its text."""

import gc

import pytest
from scenes import scene

from daebench.compiled import uncollected
from daebench.fixed_step import FixedStep
from daebench.syntax import decorated

BODY = """
def inner(x):
    return {inner}

def outer(x):
    return {outer}

def root(x):
    return outer(x)
"""
PLAIN = {"inner": "x + EPS", "outer": "inner(x)"}


def function(name, constants, **parts):
    """Return what a module calls a function by: one function, in whatever module."""
    made = {"shared": lambda text: lambda function: text, "njit": lambda **_: lambda function: None}
    exec(decorated(BODY.format(**(PLAIN | parts)), ["root"], True, constants), made)
    return made[name]


@pytest.mark.parametrize("name", ["inner", "outer"])
def test_a_function_is_another_where_something_that_it_reads_or_calls_is(name):
    same = function(name, {"EPS": "1.0", "INF": "numpy.inf"})
    assert same == function(name, {"EPS": "1.0", "INF": "0"})
    assert same != function(name, {"EPS": "2.0", "INF": "numpy.inf"})
    assert same != function(name, {"EPS": "1.0"}, inner="x - EPS")


def test_kernels_of_a_problem_share_functions_and_nothing_that_differs():
    where = scene("spherical-fast")
    bare, watched = (FixedStep("rattle").kernel(where, "float64", watch, count=False) for watch in ((), ("energy",)))
    single = FixedStep("rattle").kernel(where, "float32", (), count=False)
    assert bare.g is watched.g
    assert bare.newton_judge is watched.newton_judge
    assert bare.newton_judge is not single.newton_judge
    assert bare.watch is not watched.watch
    assert bare.integrate is not watched.integrate


def test_garbage_is_collected_again_after_a_block_that_fails():
    def failing():
        with uncollected():
            collecting.append(gc.isenabled())
            raise KeyError

    collecting = []
    with pytest.raises(KeyError):
        failing()
    assert collecting == [False]
    assert gc.isenabled()

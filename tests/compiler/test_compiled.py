"""Functions of generated modules: those of the same text are one, and whatever a function reads or calls is part of its text."""

import gc
import os
import subprocess
import sys

import pytest
from ivps import ivp

from daebench.compiler.sharing import uncollected
from daebench.compiler.syntax import decorated
from daebench.methods.fixed_step.constrained import FixedStep

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
    where = ivp("spherical-fast")
    bare, monitored = (FixedStep("rattle").kernel(where, "dual2", watch, count=False) for watch in ((), ("energy",)))
    lanes = FixedStep("rattle").kernel(where, "lanes4", (), count=False)
    assert bare.g is monitored.g
    assert bare.newton_judge is monitored.newton_judge
    assert bare.newton_judge is not lanes.newton_judge
    assert bare.newton_judge.py_func.__qualname__ != lanes.newton_judge.py_func.__qualname__
    assert bare.monitored_errors is not monitored.monitored_errors
    assert bare.integrate is not monitored.integrate


PROGRAM = """
import sys
from daebench.compiler.cache import generated
from daebench.compiler.syntax import decorated

BODY = '''
def inner(x):
    return {inner}

def root(x):
    return {root}
'''

for asked in sys.argv[1:]:
    inner, root = asked.split(";")
    text = decorated(BODY.format(inner=inner, root=root), ["root"], True, {})
    header = "from daebench.compiler.sharing import shared\\nfrom daebench.compiler.machine_code import njit\\n\\n"
    module = generated("small", asked, lambda _: header + text)
    print(module.root(2.0), sum(module.root.stats.cache_hits.values()))
"""


def said(cache, *asked):
    """Return what roots of modules give in a process of its own, and whether their machine code was on disk."""
    run = [sys.executable, "-c", PROGRAM, *asked]
    done = subprocess.run(run, env=os.environ | {"DAEBENCH_CACHE": str(cache)}, capture_output=True, text=True, check=True)
    return [tuple(map(float, line.split())) for line in done.stdout.splitlines()]


def test_machine_code_is_read_by_a_process_that_has_not_seen_where_its_functions_were_first(tmp_path):
    first, second, third = "x + 1.0; inner(x)", "x + 1.0; 2.0 * inner(x)", "x - 1.0; 3.0 * inner(x)"
    assert said(tmp_path, first, second) == [(3.0, 0), (6.0, 0)]
    assert said(tmp_path, third) == [(3.0, 0)]
    assert said(tmp_path, second) == [(6.0, 1)]
    assert said(tmp_path, third, second, first) == [(3.0, 1), (6.0, 1), (3.0, 1)]


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

"""Functions of numbers are compiled without counts of references to arrays, and functions that make arrays are not."""

import re

import numpy as np
import pytest

from daebench.compiler.syntax import decorated
from daebench.methods.fixed_step.constrained import FixedStep
from daebench.methods.fixed_step.poisson import PoissonStep
from daebench.methods.initial_value_problem import initial_value_problem
from daebench.runs.request import Request

SOURCE = """
def norm(x):
    return sqrt(max(x[0] * x[0], abs(x[1])))

def step(x, h):
    return (x[0] + h * norm(x), float(len(x)))

def made(n):
    return empty(n)

def copied(x):
    return x.copy()

def indirectly(x):
    return made(3)[0] + step(x, 1.0)[0]

def root(x):
    return indirectly(x) + copied(x)[0]
"""


def numeric(**options):
    """Return the names of the functions that are decorated as functions of numbers."""
    return set(re.findall(r"@shared\([^)]*numeric=True\)\ndef (\w+)", decorated(SOURCE, ["root"], False, **options)))


def test_a_function_is_one_of_numbers_if_all_that_it_calls_is():
    assert numeric(tuples=True) == {"norm", "step"}


def test_where_vectors_are_arrays_no_function_is_one_of_numbers():
    assert numeric() == set()


@pytest.mark.parametrize(("watch", "wanted"), [((), False), (("manifold",), False), (("energy",), True), (("manifold", "energy"), True)])
def test_conserved_quantities_are_compiled_only_where_they_are_monitored(get_ivp, watch, wanted):
    ivp, method = get_ivp("spherical-fast"), FixedStep("rattle")
    assert hasattr(method.kernel(ivp, "float64", watch, count=True), "first") == wanted
    monitored = method.solve(ivp, Request(value=0.01, steps=50, watch=watch)).complete()
    uncompiled = FixedStep("rattle", compiled=False).solve(ivp, Request(value=0.01, steps=50, watch=watch)).complete()
    assert list(monitored.maxima) == list(uncompiled.maxima)
    for name, largest in monitored.maxima.items():
        np.testing.assert_allclose(largest, uncompiled.maxima[name], rtol=0, atol=1e-13)


def test_a_step_on_arrays_of_many_sites_is_the_step_that_is_not_compiled():
    ivp = initial_value_problem("ablowitz_ladik", parameters={"sites": 32})
    request = Request(value=1e-4, steps=20, watch=())
    ends = [PoissonStep("midpoint", compiled=compiled, anyway=True).solve(ivp, request).complete().y[-1] for compiled in (True, False)]
    assert ivp.arrays
    np.testing.assert_allclose(*ends, rtol=0, atol=1e-13)

"""Methods in the coordinates of a chart, local and canonical, on every problem of the catalogue that declares one."""

import re
from functools import cache
from pathlib import Path

import numpy as np
import pytest
import sympy as sp
from runs import method

from daebench.compiler.definition import source_of
from daebench.errors import BadInput
from daebench.methods.catalogue import problems
from daebench.methods.initial_value_problem import initial_value_problem
from daebench.runs.make_ivp import make_ivp
from daebench.runs.request import Request
from daebench.runs.scales import constrained_scales
from daebench.systems.constrained import Case, Chart, ConstrainedHamiltonian, coordinates

GATE = ("torus", "driven_slider_crank")
"""Curved, and driven in time with a mass matrix that is not diagonal; others take long to derive."""

FILES = Path(__file__).parents[2] / "problems"
CHARTED = [name for name in problems() if re.search(r'\bchart("|=)', (FILES / f"{name}.py").read_text(encoding="utf-8"))]
"""Read from the texts: to derive all problems takes long, and each process that collects tests would do so."""


@pytest.mark.exhaustive
def test_all_problems_that_have_a_chart_are_asked():
    assert [name for name in problems() if getattr(initial_value_problem(name).facts, "CHART", False)] == CHARTED


@cache
def time_of(name):
    """Return a twentieth of the time in which the motion changes by itself."""
    return 0.05 / constrained_scales(initial_value_problem(name), 0.01, rated=True)[1]


def end(name, how, steps):
    ivp = initial_value_problem(name)
    found = method(how).solve(ivp, Request(value=time_of(name) / steps, steps=steps, every=steps)).complete()
    return np.concatenate([found.p[-1] / (1 + np.abs(found.p).max()), found.q[-1]])


@pytest.mark.sampled(by=GATE.__contains__)
@pytest.mark.parametrize("name", CHARTED)
def test_in_a_chart_the_motion_is_that_of_1_18(name):
    """The energy that time and forces have added, p_t, is among the numbers compared."""
    reference = end(name, "gauss4", 20)
    for how in ("canonical:gauss3", "local:gauss3"):
        assert np.abs(end(name, how, 10) - reference).max() < 1e-9, how


def test_what_has_no_canonical_coordinates_is_refused_in_a_sentence():
    (x, y), p = coordinates(2)
    s, u = sp.symbols("s u", real=True)
    chart = Chart(eta=(u,), xi=(s,), p=(u, 2 * s * u), q=(s, s**2), inverse_eta=(p[0],), inverse_xi=(x,))
    magnetic = ConstrainedHamiltonian(
        q=(x, y), p=p, H=(p[0] ** 2 + p[1] ** 2) / 2 + p[0] * y, g=[y - x**2], cases={"a": Case(q=(1, 1), p=(1, 2))}, chart=chart
    )
    with pytest.raises(BadInput, match=r"needs H = 1/2 p\^T M\^-1 p \+ U\(q\) and a chart whose positions depend on xi alone, which bead"):
        method("canonical:gauss2").solve(make_ivp(source_of(magnetic, "bead"), "a"), Request(value=0.01, steps=3))

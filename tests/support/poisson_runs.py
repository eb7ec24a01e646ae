"""Poisson systems and methods that tests sweep, uncompiled, and what they measure of them."""

from dataclasses import replace
from functools import cache

import numpy as np

from daebench.methods.catalogue import problems
from daebench.methods.initial_value_problem import initial_value_problem
from daebench.methods.names import POISSON, parse
from daebench.methods.registry import poisson_registry
from daebench.runs.request import Request

FORMS = ("", "darboux:")
SMALLER = {"ablowitz_ladik": {"sites": 5}}
"""Structural parameters of what is swept where the default is larger than a sweep needs."""


@cache
def ivp(name, case=None):
    """Return a Poisson system of the catalogue, small."""
    return initial_value_problem(name, case, SMALLER.get(name))


def method(name, *, anyway=True):
    return replace(parse(name, anyway=anyway, kind=POISSON), compiled=False)


def names():
    """Return every scheme in every form."""
    return [form + scheme for form in FORMS for scheme, made in poisson_registry().items() if not (form and made.poisson == "split")]


def pairs():
    """Return every scheme on every Poisson system in every form that it takes, as (problem, method)."""
    return [(problem, name) for problem in problems("poisson") for name in names() if method(name).refusal(ivp(problem)) is None]


@cache
def rate(name):
    """Return the largest rate at which neighbours part at the start, 1/s: the norm of the derivative of the field."""
    where = ivp(name)
    y = where.y0.astype(complex)
    columns = [np.imag(where.value("field", y + 1e-30j * e)) / 1e-30 for e in np.eye(len(y))]
    return float(np.linalg.norm(columns, 2))


def run(problem, name, h, steps, **more):
    return method(name).solve(ivp(problem), Request(value=h, steps=steps, **more)).complete()

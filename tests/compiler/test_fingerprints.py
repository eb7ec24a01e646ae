"""Definitions that are made in one process share what was derived from them if and only if they are the same, to the last digit."""

from dataclasses import replace

import numpy as np
import pytest
import sympy as sp

from daebench.methods.catalogue import find_problem
from daebench.methods.initial_value_problem import initial_value_problem
from daebench.systems.poisson import PoissonCase

SITES = 6


@pytest.fixture(scope="module")
def lattice():
    return find_problem("ablowitz_ladik").define(sites=SITES)


def start_of(definition):
    return np.concatenate(initial_value_problem(definition).start)


@pytest.mark.parametrize("site", [SITES])
def test_lattices_that_differ_at_one_site_alone_have_starts_of_their_own(lattice, site):
    starts = []
    for value in (sp.Rational(1, 2), sp.Rational(1, 3)):
        here = sp.Piecewise((value, sp.Eq(lattice.site, site)), (sp.Rational(1, 2), True))
        starts.append(start_of(replace(lattice, cases={"one": PoissonCase(y=(here, sp.Integer(0)), about="")})))
    expected = np.full((2, 2 * SITES), 0.5)
    expected[:, SITES:] = 0
    expected[1, site - 1] = 1 / 3
    assert np.array(starts) == pytest.approx(expected, abs=0)


def with_start(name, value):
    """Return a problem with one case, in which the first number of the start is given."""
    problem = find_problem(name).define()
    case = next(iter(problem.cases.values()))
    part = "y" if hasattr(case, "y") else "q"
    return replace(problem, cases={"one": replace(case, **{part: (value, *getattr(case, part)[1:])}, parameters={})})


@pytest.mark.sampled(by=lambda case: case.startswith("0.1") or case.endswith("1e-09-planar_pendulum"))
@pytest.mark.parametrize("name", ["free_rigid_body", "ablowitz_ladik", "planar_pendulum", "pendulum_chain"])
@pytest.mark.parametrize("number", [0.1, 1 / 3, 1e-9], ids=str)
def test_definitions_that_differ_by_one_rounding_have_fingerprints_of_their_own(name, number):
    beside = np.nextafter(number, 1)
    exact = [with_start(name, some).fingerprint for some in (sp.Float(number, 17), sp.Float(beside, 17), number, float(beside))]
    assert len({*exact[:2]}) == len({*exact[2:]}) == 2
    assert with_start(name, sp.Float(number, 17)).fingerprint == exact[0]

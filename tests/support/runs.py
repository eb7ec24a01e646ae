"""Runs of uncompiled methods by their names, and what several tests measure of them."""

from dataclasses import replace

import numpy as np
from ivps import ivp
from oracles import solution

from daebench.diagnostics.reversibility import reversibility_defect
from daebench.diagnostics.symplecticity import symplecticity_defect, tangent_basis
from daebench.methods.names import parse
from daebench.runs.request import Request

ROUND_OFF = 1e-12

PROJECTED = ("midpoint+proj", "rk4+proj", "midpoint+symproj", "gauss2+symproj", "rk4+symproj")
PLACES = ("spherical-fast", "stretched-M", "relativistic", "coupled-rods")


def method(name, **options):
    return replace(parse(name, options), compiled=False)


def run(name, place, h, steps, options=None, **more):
    where = ivp(place) if isinstance(place, str) else place
    return method(name, **(options or {})).solve(where, Request(value=h, steps=steps, **more)).complete()


def state_error(name, place, n, T=0.5):
    q, p = solution(place, T)
    found = run(name, place, T / n, n, every=0, watch=())
    return max(np.abs(found.q[-1] - q).max(), np.abs(found.p[-1] - p).max())


def defects(name, place, h=0.01, steps=10, **options):
    """Return the defects of the two-form on the tangent space and of reversal over some steps."""
    where = ivp(place)
    flow = method(name, **options).flow(where, h, steps)
    X = tangent_basis(where, where.p0, where.q0)
    return symplecticity_defect(flow, where.p0, where.q0, X), reversibility_defect(flow, where.p0, where.q0)

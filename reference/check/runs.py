"""Runs in double precision with which references are compared: the methods for each kind of problem, and how they are run."""

from dataclasses import replace

from daebench.runs.ivp import Ivp
from daebench.runs.request import Request
from daebench.runs.trajectory import PoissonTrajectory, Trajectory

Solution = Trajectory | PoissonTrajectory

RATTLE = "rattle/kahan_li8"
"""Order 8 on the constrained system itself, for every H. It needs no multiplier formula, and at most half the compile time of lobatto5,
which has the same order and gives about the same digits."""

GAUSS = "local:gauss4"
"""Order 8 in the problem's chart, for a motion that passes a rank loss: its steps use neither G nor multipliers."""

STRANG, MIDPOINT = "strang/kahan_li8", "midpoint/kahan_li8"
"""Order 8 on a Poisson system, with and without a splitting."""


def own_name(ivp: Ivp, *, crosses: bool = False) -> str:
    """Return the name of our own method for a problem; for a motion that passes a rank loss, that of a method that can."""
    if ivp.on_manifold:
        return GAUSS if crosses else RATTLE
    return STRANG if ivp.facts.SPLITTINGS else MIDPOINT


def coarsest(name: str) -> int:
    """Return the number of steps from output to output in our method's first run: without compensated sums every step adds rounding."""
    return 8 if name == RATTLE else 1


def ida_names(ivp: Ivp) -> tuple[str, ...]:
    """Return the names of IDA in the formulations that reach furthest: with multipliers as derivatives, or with Casimir functions."""
    if ivp.on_manifold:
        return "ida:index2", "ida:ggl"
    return ("ida:casimirs", "ida:ode") if ivp.casimirs else ("ida:ode",)


def solved(ivp: Ivp, name: str, request: Request) -> Solution:
    """Return the run of a method, with compensated sums if possible, and with multipliers if there are any.

    A method for Poisson systems is used even if it is not a Poisson integrator for this system, because only its accuracy matters here.
    """
    from daebench.methods.names import kind_of, parse

    method = parse(name, kind=kind_of(ivp), compensated=name == RATTLE, anyway=True)
    run: Solution = method.solve(ivp, replace(request, multipliers=ivp.on_manifold))
    return run

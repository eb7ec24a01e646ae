"""Runs in double precision that references are held against: which methods there are for each kind of problem, and how they are run."""

from dataclasses import replace

from daebench.runs.ivp import ConstrainedIvp, Ivp, PoissonIvp
from daebench.runs.request import Request
from daebench.runs.trajectory import PoissonTrajectory, Trajectory

Solution = Trajectory | PoissonTrajectory

RATTLE = "rattle/kahan_li8"
"""Order 8 on the constrained system itself, for every H; it needs no multiplier formula, and half the compile time of lobatto5 or less,
which has the same order and gives much the same digits."""

GAUSS = "local:gauss4"
"""Order 8 in the problem's chart, for a motion that passes rank loss: neither G nor multipliers have a part in its steps."""

STRANG, MIDPOINT = "strang/kahan_li8", "midpoint/kahan_li8"
"""Order 8 on a Poisson system, where it has a splitting and where it has none."""


def own_name(ivp: Ivp, *, crosses: bool = False) -> str:
    """Return the name of our own method for a problem, one that passes rank loss where the motion does."""
    if isinstance(ivp, ConstrainedIvp):
        return GAUSS if crosses else RATTLE
    return STRANG if ivp.facts.SPLITTINGS else MIDPOINT


def coarsest(name: str) -> int:
    """Return the steps from output to output of our method's first run: where sums are not compensated every step adds rounding."""
    return 8 if name == RATTLE else 1


def ida_names(ivp: Ivp) -> tuple[str, ...]:
    """Return the names of IDA in the formulations that reach furthest: those with multipliers as derivatives, or with Casimir functions."""
    if isinstance(ivp, ConstrainedIvp):
        return "ida:index2", "ida:ggl"
    return ("ida:casimirs", "ida:ode") if ivp.casimirs else ("ida:ode",)


def solved(ivp: Ivp, name: str, request: Request) -> Solution:
    """Return the run of a method; sums are compensated where it can, and multipliers are there where there are some.

    A method for Poisson systems is run whether it is a Poisson integrator for this one or not: it is its accuracy that counts here.
    """
    from daebench.methods.names import POISSON, parse

    if isinstance(ivp, PoissonIvp):
        run: Solution = parse(name, kind=POISSON, anyway=True).solve(ivp, request)
    else:
        run = parse(name, compensated=name == RATTLE).solve(ivp, replace(request, multipliers=True))
    return run

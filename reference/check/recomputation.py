"""Runs in double precision with which references are compared, and the records of a verification."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace

import numpy as np

from daebench.diagnostics.unit_rows import condition
from daebench.methods.names import kind_of, parse
from daebench.reference.keep.record import EPS, Reference
from daebench.runs.ivp import Array, Ivp
from daebench.runs.request import Request
from daebench.runs.trajectory import PoissonTrajectory, Trajectory


@dataclass(frozen=True)
class Check:
    """One check."""

    what: str
    """The checked quantity."""
    expected: str
    found: str
    """Its required value, and its actual value."""
    ok: bool
    """Whether the check holds."""


@dataclass(frozen=True)
class Digits:
    """Digits in which a recomputation agrees with the stored numbers of a part."""

    method: str
    """The method that recomputed the numbers."""
    part: str
    """"q", "p" or "lam"; or "y"."""
    at: tuple[tuple[float, float], ...]
    """A time, s, and the digits up to that time: -log10 of the largest error in units of the part's largest modulus. The last time is that
    of the whole comparison.
    """
    visible: float
    """Smallest alteration of a stored number that the comparison is certain to detect up to that last time, in units of the part."""

    @property
    def overall(self) -> float:
        """Digits of the whole comparison."""
        return self.at[-1][1]


@dataclass(frozen=True)
class Verification:
    """Result of the verification of one reference."""

    name: str
    """PROBLEM-CASE."""
    checks: tuple[Check, ...]
    """The checks, in order."""
    digits: tuple[Digits, ...] = ()
    """Digits in which recomputations agree."""
    unseen: str = ""
    """Alterations that no check can detect, as a sentence."""

    @property
    def ok(self) -> bool:
        """Whether every check holds."""
        return all(check.ok for check in self.checks)


def agreed(what: str, expected: object, actual: object) -> Check:
    """Return the check that two values are equal."""
    return Check(what, str(expected), str(actual), expected == actual)


def at_most(what: str, limit: float, value: float, place: str = "") -> Check:
    """Return the check that a number does not exceed a limit; NaN fails."""
    return Check(what, f"<= {limit:.2e}", f"{value:.2e}{place}", bool(value <= limit))


Solution = Trajectory | PoissonTrajectory

RATTLE = "rattle/kahan_li8"
"""Order 8 on the constrained system itself, for every H. It needs no multiplier formula, and at most half the compile time of lobatto5,
which has the same order and gives about the same digits."""

DLA = "dla/kahan_li8"
"""The same for constraints on velocities, which RATTLE does not have."""

GAUSS = "local:gauss4"
"""Order 8 in the problem's chart, for a motion that passes a rank loss: its steps use neither G nor multipliers."""

STRANG, MIDPOINT = "strang/kahan_li8", "midpoint/kahan_li8"
"""Order 8 on a Poisson system, with and without a splitting."""


def own_name(ivp: Ivp, *, crosses: bool = False) -> str:
    """Return the name of our own method for a problem; for a motion that passes a rank loss, that of a method that can."""
    if ivp.on_manifold:
        return GAUSS if crosses else DLA if ivp.nonholonomic else RATTLE
    return STRANG if ivp.facts.SPLITTINGS else MIDPOINT


def coarsest(name: str) -> int:
    """Return the number of steps from output to output in our method's first run: without compensated sums every step adds rounding."""
    return 8 if name == RATTLE else 1


def ida_names(ivp: Ivp) -> tuple[str, ...]:
    """Return the names of IDA in the formulations that reach furthest: with multipliers as derivatives, or with Casimir functions."""
    if ivp.m:
        return "ida:index2", "ida:ggl" if ivp.holonomic else "ida:index1"
    return ("ida:casimirs", "ida:ode") if ivp.casimirs else ("ida:ode",)


def solved(ivp: Ivp, name: str, request: Request) -> Solution:
    """Return the run of a method, with compensated sums if possible, and with multipliers if there are any.

    A method for Poisson systems is used even if it is not a Poisson integrator for this system, because only its accuracy matters here.
    """
    method = parse(name, kind=kind_of(ivp), compensated=name == RATTLE, anyway=True)
    run: Solution = method.solve(ivp, replace(request, multipliers=ivp.m > 0))
    return run


Parts = Mapping[str, Array]

ROUNDINGS = 10.0
"""Effect of rounding the start and each step, in units of the rounding of a start; measured values are at most 3."""

WORTH = 1e-6
"""Fraction of the motion at which a comparison ends, because rounding alone may be as large."""

TOLD = (1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0, 200.0, 500.0, 1000.0)
"""Times at which digits of agreement are given, s."""


@dataclass(frozen=True)
class Recomputed:
    """A run in double precision with its error estimate."""

    method: str
    """Its name, with its step size or tolerance."""
    states: Parts
    limit: Parts
    """Every part at the first n stored times, and the largest error that it may have; shape (n, components)."""

    def checks(self, reference: Reference) -> Iterator[Check]:
        """Yield one check for each part: the largest difference in units of the allowed error."""
        for part, limit in self.limit.items():
            ratio = np.max(np.abs(self.states[part] - reference.values[part][: len(limit)]) / limit, axis=1)
            k = int(np.argmax(ratio))
            what = f"{part} by {self.method} up to t = {reference.t[len(ratio) - 1]:g}, in units of its own error"
            yield at_most(what, 1.0, float(ratio[k]), f" at t = {reference.t[k]:g}")

    def digits(self, reference: Reference) -> Iterator[Digits]:
        """Yield the digits of agreement of each part."""
        for part, limit in self.limit.items():
            n, size = len(limit), reference.size(part)
            error = np.abs(self.states[part] - reference.values[part][:n]).max(axis=1) / size
            agreed = -np.log10(np.maximum(np.maximum.accumulate(error), EPS))
            last = float(reference.t[n - 1])
            at = {t: float(agreed[np.searchsorted(reference.t[:n], t, "right") - 1]) for t in (*(t for t in TOLD if t < last), last)}
            yield Digits(self.method, part, tuple(at.items()), float(2 * limit.max() / size))


def followed(reference: Reference) -> int:
    """Return the number of stored times at which runs in double precision are compared: those at which rounding is below a millionth."""
    lost = np.flatnonzero(_rounded(reference) > WORTH)
    return int(lost[0]) if lost.size else len(reference.t)


def rounding_of(reference: Reference, part: str, n: int) -> Array:
    """Return the largest effect of rounding on a part at the first n stored times, shape(n, 1).

    ::

        u (10 A(t) size + t rate)      u = 2^-53, A the worst amplification, rate the largest |dx/dt|

    The second term is the effect of a clock with error u: the weights of a composition do not add up to 1 to the last bit. For multipliers
    near rank loss, and for those of redundant constraints, both terms are multiplied by the condition number of G M^-1 G^T.
    """
    rate = float(np.abs(np.diff(reference.values[part], axis=0)).max()) / float(reference.t[1])
    rounding = reference.size(part) * _rounded(reference)[:n] + EPS * rate * reference.t[:n]
    return np.asarray(rounding * suffered(reference, part)[:n])[:, None]


def suffered(reference: Reference, part: str) -> Array:
    """Return the factor by which rounding affects a part more than elsewhere at each row, shape(n,)."""
    if part != "lam":
        return np.ones(len(reference.t))
    ivp = reference.ivp()
    if ivp.on_manifold and ivp.singular:
        return np.array([condition(ivp, q) for q in reference.values["q"]])
    return reference.conditioning


def _rounded(reference: Reference) -> Array:
    return np.asarray(ROUNDINGS * EPS * np.maximum.accumulate(reference.worst_amplification))


def so_far(difference: Array) -> Array:
    """Return the largest modulus of a row's numbers up to each row, shape(n, 1)."""
    return np.asarray(np.maximum.accumulate(np.abs(difference).max(axis=1)))[:, None]

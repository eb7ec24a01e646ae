"""The verdict on long runs in a sentence."""

import math

from daebench.diagnostics.energy import Drift
from daebench.diagnostics.random_walk import CONFIDENCE, MEMBERS, Walk

UNKNOWN = "undetermined: there is too little to tell; take more steps."


def sentence(found: Walk | Drift | None) -> str:
    """Return what a verdict says, with two standard errors on either side of each number; slopes are in units of H a second."""
    if found is None or math.isnan(found.slope):
        return UNKNOWN
    return _of_ensemble(found) if isinstance(found, Walk) else _of_few(found)


def _of_ensemble(walk: Walk) -> str:
    slope = _around(walk.slope, walk.slope_error)
    if math.isnan(walk.exponent):
        spread = f"the {walk.members} members do not spread beyond round-off"
    else:
        spread = f"the spread of {walk.members} members grows as t^({_around(walk.exponent, walk.exponent_error)})"
    told = {
        "bounded": f"bounded: {spread}, and their mean does not drift: its slope is {slope}.",
        "random walk": f"random walk: {spread}, and their mean does not drift: its slope is {slope}.",
        "linear": f"linear: the mean drifts by {slope} a second; {spread}.",
        "growing": f"growing: {spread}, and the slope of their mean is {slope}, neither as of a random walk nor of a linear drift.",
        "undetermined": f"undetermined: {spread}, and the slope of their mean is {slope}; take more steps or more members.",
    }
    return told[walk.kind]


def _of_few(drift: Drift) -> str:
    slope = _around(drift.slope, drift.slope_error)
    growth = "" if math.isnan(drift.growth) else f", growing as t^({_around(drift.growth, drift.growth_error)})"
    told = {
        "bounded": f"bounded: the slope is {slope}",
        "linear": f"linear: the energy drifts by {slope} a second{growth}",
        "growing": f"growing: the slope is {slope}{growth}",
    }
    return f"{told[drift.kind]}; whether it is a random walk is told from {MEMBERS} members or more."


def _around(value: float, error: float) -> str:
    """Return a number and its confidence interval, the error with two digits and the number with as many places."""
    wide = CONFIDENCE * error
    if not (math.isfinite(wide) and wide > 0):
        return f"{value:.3g}"
    places = 1 - math.floor(math.log10(wide))
    if 0 <= places <= 4:
        return f"{value:.{places}f} +- {wide:.{places}f}"
    power = math.floor(math.log10(max(abs(value), wide)))
    digits = max(0, places + power)
    return f"({value / 10.0**power:.{digits}f} +- {wide / 10.0**power:.{digits}f})e{power:+03d}"

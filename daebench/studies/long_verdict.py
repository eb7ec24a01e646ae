"""The verdict on long runs in a sentence."""

import math

from daebench.diagnostics.energy import Drift
from daebench.diagnostics.random_walk import CONFIDENCE, MEMBERS, Walk
from daebench.studies.long_table import Share

LITTLE = "undetermined: there is too little to tell; take more steps."


def sentence(found: Walk | Drift | None, share: Share) -> str:
    """Return what a verdict says, and of which members it is where it is not of all at their ends.

    There are two standard errors on either side of each number; slopes are in units of H a second.
    """
    if share.begun and share.failed == share.begun:
        return "undetermined: every member stopped early." if share.begun == share.asked else _all_begun_failed(share)
    parts = [_verdict(found, share), *([] if share.whole else [_told(share)])]
    return " ".join(part for part in parts if part)


def _all_begun_failed(share: Share) -> str:
    return f"undetermined: {share.begun} of {share.asked} members have begun, and every one of them stopped early."


def _verdict(found: Walk | Drift | None, share: Share) -> str:
    if found is None or math.isnan(found.slope):
        return LITTLE
    return _of_ensemble(found) if isinstance(found, Walk) else _of_few(found, share)


def _told(share: Share) -> str:
    """Return up to when and from how many members the verdict is told, and what becomes of the others."""
    behind = share.begun - share.failed - share.told
    numbers = {
        "stopped early": share.failed,
        "far behind" if share.told else "before the first sample": behind,
        "not begun": share.asked - share.begun,
    }
    left = ", ".join(f"{number} of {share.asked} {what}" for what, number in numbers.items() if number)
    told = f"Told to t = {share.until:.4g} from {share.told} of {share.asked} members" if share.told else "Told from no member"
    return f"{told}{f'; left out: {left}' if left else ''}."


def _of_ensemble(walk: Walk) -> str:
    slope, spread = _around(walk.slope, walk.slope_error), _spread(walk)
    still = f"their mean does not drift beyond four standard errors: its slope is {slope}"
    growing = {
        "slope": f"growing: the mean drifts by {slope} a second, but not at the same rate in both halves of the time; {spread}.",
        "scatter": f"growing: what all members do alike swells, where the slope of their mean is {slope}; {spread}.",
        "spread": f"growing: {spread}, so that each drifts its own way; {still}.",
    }
    told = {
        "bounded": f"bounded: {spread}, and {still}.",
        "random walk": f"random walk: {spread}, and {still}.",
        "linear": f"linear: the mean drifts by {slope} a second; {spread}.",
        "undetermined": f"undetermined: {spread}, and {still}; take more steps or more members.",
    }
    return growing[walk.why] if walk.kind == "growing" else told[walk.kind]


def _spread(walk: Walk) -> str:
    """Return how the members part."""
    if not math.isnan(walk.exponent):
        return f"the spread of {walk.members} members grows as t^({_around(walk.exponent, walk.exponent_error)})"
    if walk.spreads:
        return f"the {walk.members} members spread beyond round-off too late to tell how that grows"
    return f"the {walk.members} members do not spread beyond round-off"


def _of_few(drift: Drift, share: Share) -> str:
    slope = _around(drift.slope, drift.slope_error)
    growth = "" if math.isnan(drift.growth) else f", growing as t^({_around(drift.growth, drift.growth_error)})"
    told = {
        "bounded": f"bounded: the slope is {slope}",
        "linear": f"linear: the energy drifts by {slope} a second{growth}",
        "growing": f"growing: the slope is {slope}{growth}",
    }
    few = f", of which there are {share.told} so far" if share.asked >= MEMBERS else ""
    return f"{told[drift.kind]}; whether it is a random walk is told from {MEMBERS} members or more{few}."


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

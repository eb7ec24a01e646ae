"""The verdict on long runs in a sentence."""

import math

from daebench.diagnostics.drift import Drift, between
from daebench.diagnostics.random_walk import CONFIDENCE, MEMBERS, Walk
from daebench.studies.long.table import Share

LITTLE = "undetermined: there are too few samples; take more steps."


def sentence(growth: Walk | Drift | None, share: Share) -> str:
    """Return the sentence on a verdict, and of which members it is where it is not of all at their ends.

    There are two standard errors on either side of each number; slopes are in units of H a second.
    """
    if share.begun and share.failed == share.begun:
        begun = f"{share.begun} of {share.asked} members have begun, and every one of them"
        return f"undetermined: {'every member' if share.begun == share.asked else begun} stopped early."
    parts = [_verdict(growth, share), *([] if share.whole else [_told(share)])]
    return " ".join(part for part in parts if part)


def _verdict(growth: Walk | Drift | None, share: Share) -> str:
    if growth is None or math.isnan(growth.slope):
        return LITTLE
    return _of_ensemble(growth) if isinstance(growth, Walk) else _of_few(growth, share)


def _told(share: Share) -> str:
    """Return up to when and from how many members the verdict is told, and what becomes of the others."""
    behind = share.begun - share.failed - share.told
    numbers = {
        "stopped early": share.failed,
        "far behind" if share.told else "before the first sample": behind,
        "not begun": share.asked - share.begun,
    }
    left = ", ".join(f"{number} of {share.asked} {what}" for what, number in numbers.items() if number)
    coverage = f"Told to t = {share.until:.4g} from {share.told} of {share.asked} members" if share.told else "Told from no member"
    return f"{coverage}{f'; left out: {left}' if left else ''}."


def _of_ensemble(walk: Walk) -> str:
    bound = f"their mean changes by at most {walk.change_bound:.2g} over the time"
    if walk.verdict == "drifts":
        apart = f"{_spread(walk)}, so each member has its own drift; {bound}." if walk.law == "apart" else f"{_law(walk)}; {_spread(walk)}."
        return f"drifts: {apart}"
    sentences = {
        "kept": "kept: no member has an error above rounding.",
        "bounded": f"bounded: {_spread(walk)}, and {bound}.",
        "random walk": f"random walk: {_spread(walk)}; {bound}.",
        "undetermined": f"undetermined: {walk.reason}; {_spread(walk)}; take more steps or more members.",
    }
    return sentences[walk.verdict]


def headline(growth: Walk | Drift | None) -> str:
    """Return the answer in a few words, with the exponent of the spread and its interval where there is one."""
    if growth is None:
        return "undetermined"
    brief = growth.verdict if growth.verdict != "drifts" else f"drifts, {growth.law}"
    if isinstance(growth, Walk) and not math.isnan(growth.exponent):
        spread = _around(growth.exponent, growth.exponent_error).replace("+-", "$\\pm$")
        return f"{brief}: spread ~ t^({spread}), 95 %, over {growth.decades:.1f} decades, {growth.members} members"
    return brief


def _law(growth: Walk | Drift) -> str:
    """Return the law of a drift of the mean, and how much it is."""
    of = f"the mean of {growth.members} members" if isinstance(growth, Walk) else "the energy"
    if growth.law == "saturated":
        within = "" if math.isnan(growth.level_low) else f" ({between(growth.level_low, growth.level_high)}, 95 %)"
        return f"{of} saturated at {growth.level:.3g}{within}"
    if growth.law == "linear":
        return f"linear: {of} drifts by {_around(growth.slope, growth.slope_error)} a second"
    return f"{growth.law}: {of} changes by {growth.change:.3g} over the time"


def _spread(walk: Walk) -> str:
    """Return how the members part."""
    if not math.isnan(walk.exponent):
        return f"the spread of {walk.members} members grows as t^({_around(walk.exponent, walk.exponent_error)}), 95 %"
    if walk.spreads:
        return f"the {walk.members} members spread beyond round-off too late to measure its growth"
    return f"the {walk.members} members do not spread beyond round-off"


def _of_few(drift: Drift, share: Share) -> str:
    interval = between(drift.exponent_low, drift.exponent_high)
    power = "" if math.isnan(drift.exponent) else f", as t^({drift.exponent:.3g}), 95 %: {interval}"
    sentences = {
        "kept": "kept: the error is no more than rounding",
        "bounded": f"bounded: the mean changes by at most {drift.change_bound:.2g} over the time",
        "drifts": f"drifts: {_law(drift)}{power if drift.law in ('linear', 'power') else ''}",
        "undetermined": f"undetermined: {drift.reason}",
        "failed": f"failed: {drift.reason}",
    }
    few = f", of which there are {share.told} so far" if share.asked >= MEMBERS else ""
    return f"{sentences[drift.verdict]}; a random walk can be identified from {MEMBERS} members or more{few}."


def _around(value: float, error: float) -> str:
    """Return a number and its interval of 95 %, the error with two digits and the number with as many places."""
    wide = CONFIDENCE * error
    if not (math.isfinite(wide) and wide > 0):
        return f"{value:.3g}"
    places = 1 - math.floor(math.log10(wide))
    if 0 <= places <= 4:
        return f"{value:.{places}f} +- {wide:.{places}f}"
    power = math.floor(math.log10(max(abs(value), wide)))
    digits = max(0, places + power)
    return f"({value / 10.0**power:.{digits}f} +- {wide / 10.0**power:.{digits}f})e{power:+03d}"

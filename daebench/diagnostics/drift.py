"""A drift: the secular part of the error of a conserved quantity, its law, and the verdict on it."""

from dataclasses import dataclass, replace

NAN = float("nan")

KEPT, BOUNDED, DRIFTS, UNDETERMINED, FAILED = "kept", "bounded", "drifts", "undetermined", "failed"

VERDICTS = {
    KEPT: "it is round-off: at most 10 eps sqrt(N) max(|T|, |U|) after N steps",
    BOUNDED: "its mean changes by no more than a stated bound, and moves within half of its oscillation",
    DRIFTS: "its mean changes, or its oscillation grows, by a stated law",
    UNDETERMINED: "none of these can be decided, for a stated reason",
    FAILED: "the run stopped, or a number in it is not finite",
}
"""Verdicts on an error, and their meaning."""


LAWS = ("linear", "power", "exponential", "saturated", "step", "irregular", "growing scatter")
"""Laws of drifts."""


@dataclass(frozen=True)
class Drift:
    """The secular part of an error, and the verdict on it.

    Parameters
    ----------
    verdict : str
        One of :data:`VERDICTS`.
    reason : str
        Why it is undetermined, or failed; else "".
    law : str
        Law of a drift: "linear", "power", "exponential", "saturated", "step", "irregular" or "growing scatter"; else "".
    exponent, exponent_error : float
        Exponent alpha of the secular part ~ t^alpha, and a quarter of the length of its interval; NaN where no power of t fits.
    exponent_low, exponent_high : float
        Ends of its interval of 95 %; an end at 0.1 or 10 is open.
    change : float
        Change of the mean from the start to the end, by the shape that fits best.
    change_bound : float
        Upper bound on the modulus of the change of the mean over the time.
    level : float
        Mean at the end; for law "saturated" the limit.
    level_low, level_high : float
        Ends of the limit's interval of 95 %, one of them infinite where it may have no limit; NaN for other laws.
    slope, slope_error : float
        Least-squares slope over the whole run, in the error's unit per unit of time, and the standard error that it has if the secular
        part is a straight line. The verdict does not use them.
    """

    verdict: str
    reason: str = ""
    law: str = ""
    exponent: float = NAN
    exponent_error: float = NAN
    exponent_low: float = NAN
    exponent_high: float = NAN
    change: float = NAN
    change_bound: float = NAN
    level: float = NAN
    level_low: float = NAN
    level_high: float = NAN
    slope: float = NAN
    slope_error: float = NAN

    @property
    def brief(self) -> str:
        """The law of a drift, otherwise the verdict."""
        return self.law or self.verdict

    def undecided(self, reason: str) -> "Drift":
        """Return the same numbers with the verdict "undetermined" for a reason, and no law."""
        none = dict.fromkeys(("exponent", "exponent_error", "exponent_low", "exponent_high", "level_low", "level_high"), NAN)
        return replace(self, verdict=UNDETERMINED, reason=reason, law="", **none)

    @property
    def words(self) -> str:
        """The law in words with the interval of its number, such as "saturated at -26.6 (-26.7 to -26.5)"; "" without a drift."""
        if self.law in ("linear", "power"):
            begin = self.law if self.law == "linear" else f"t^{self.exponent:.2g}"
            return f"{begin} (t^{between(self.exponent_low, self.exponent_high, ' to t^')})"
        if self.law == "saturated":
            return f"saturated at {self.level:.3g} ({between(self.level_low, self.level_high)})"
        return self.law


def between(low: float, high: float, to: str = " to ") -> str:
    """Return the ends of an interval, with as many digits as tell them apart, from three up to six."""
    texts = [(f"{low:.{digits}g}", f"{high:.{digits}g}") for digits in (3, 4, 5, 6)]
    return to.join(next((pair for pair in texts if pair[0] != pair[1]), texts[-1]))

"""Records of a verification: one a check, digits of agreement, and alterations that no check could have seen."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Check:
    """One thing that was looked at.

    Parameters
    ----------
    what : str
        What was looked at.
    expected, found : str
        What it should be, and what it is.
    ok : bool
        Whether the one is the other.
    """

    what: str
    expected: str
    found: str
    ok: bool


@dataclass(frozen=True)
class Digits:
    """Digits in which a recomputation agrees with the stored numbers of a part.

    Parameters
    ----------
    method : str
        What recomputed them.
    part : str
        "q", "p" or "lam"; or "y".
    at : tuple of (float, float)
        A time, s, and the digits up to that time: -log10 of the largest error in units of the part's largest modulus. The last time is
        that of the whole comparison.
    visible : float
        Smallest alteration of a stored number that the comparison is sure to see at that last time, in units of the part.
    """

    method: str
    part: str
    at: tuple[tuple[float, float], ...]
    visible: float

    @property
    def overall(self) -> float:
        """Digits of the whole comparison."""
        return self.at[-1][1]


@dataclass(frozen=True)
class Verification:
    """What was found out about one reference.

    Parameters
    ----------
    name : str
        PROBLEM-CASE.
    checks : tuple of Check
        What was looked at, in order.
    digits : tuple of Digits
        How far recomputations agree.
    unseen : str
        What could be altered without any check seeing it, as a sentence.
    """

    name: str
    checks: tuple[Check, ...]
    digits: tuple[Digits, ...] = ()
    unseen: str = ""

    @property
    def ok(self) -> bool:
        """Whether every check holds."""
        return all(check.ok for check in self.checks)


def agreed(what: str, expected: object, actual: object) -> Check:
    """Return the check that two things are equal."""
    return Check(what, str(expected), str(actual), expected == actual)


def at_most(what: str, limit: float, value: float, place: str = "") -> Check:
    """Return the check that a number does not exceed a limit; what is not a number does."""
    return Check(what, f"<= {limit:.2e}", f"{value:.2e}{place}", bool(value <= limit))

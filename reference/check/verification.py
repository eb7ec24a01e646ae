"""Records of a verification: one for each check, digits of agreement, and alterations that no check can detect."""

from dataclasses import dataclass


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

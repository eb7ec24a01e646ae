"""Claims of a report: a sentence is tested before it is printed, and one that does not hold ends the report."""

from typing import Any

from daebench.errors import DaebenchError


class ClaimRefuted(DaebenchError):
    """A sentence of a report that the run does not bear out."""


def require(holds: Any, claim: str, measured: Any) -> None:
    """Go on if a claim holds.

    Raises
    ------
    ClaimRefuted
        If it does not; the message has the claim and the measured value.

    Examples
    --------
    >>> order = 1.98
    >>> require(abs(order - 2) < 0.1, "RATTLE has order two", order)
    """
    if not bool(holds):
        raise ClaimRefuted(f"the report would say that {claim}, but {measured} was measured; it is not written.", "claim-of-report-refuted")

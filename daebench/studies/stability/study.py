"""All extremes of a problem, one after the other."""

from collections.abc import Sequence

from daebench.errors import require_known
from daebench.studies.stability import lost_motion, outcome_map, parameter_range, penalty, round_off, step_limit
from daebench.studies.stability.extreme import Asked, Extreme

EXTREMES = {module.EXTREME.name: module.EXTREME for module in (step_limit, outcome_map, parameter_range, penalty, round_off, lost_motion)}
"""The extremes, by name."""


def chosen(asked: Asked, only: Sequence[str] = ()) -> tuple[list[Extreme], dict[str, str]]:
    """Return the extremes that a problem has, and why it has not the others.

    Raises
    ------
    BadInput
        If a name is unknown.
    """
    if only:
        require_known(*(("extreme", name, EXTREMES) for name in only))
    refused = {name: why for name in only or EXTREMES if (why := EXTREMES[name].refusal(asked))}
    return [EXTREMES[name] for name in only or EXTREMES if name not in refused], refused

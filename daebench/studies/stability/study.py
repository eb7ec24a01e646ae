"""All extremes of a problem, one after the other."""

from collections.abc import Sequence
from itertools import starmap
from types import ModuleType

from daebench.errors import require_known
from daebench.studies.stability import lost_motion, outcome_map, parameter_range, penalty, round_off, step_limit
from daebench.studies.stability.extreme import Asked, Extreme

ABOUT = {
    step_limit: "the largest usable step of each method, by bisection",
    outcome_map: "outcomes of runs over step size and a parameter",
    parameter_range: "mass ratios from 1e-8 to 1e8, or another parameter over given values",
    penalty: "a stiff penalty in place of the constraint, as eps goes to 0",
    round_off: "step sizes and tolerances to 0, until round-off wins or a solver gives up",
    lost_motion: "the time for which a motion that amplifies errors is followed: chaos, starts near unstable equilibria",
}
"""The module of each extreme, and what it does in one line."""

PARTS = ("refusal", "specifications", "measure", "says", "draw")
"""Functions that each of them has."""


def _extreme(module: ModuleType, about: str) -> Extreme:
    """Return the extreme of a module, which has its name."""
    name = module.__name__.rpartition(".")[2].replace("_", "-")
    return Extreme(name=name, about=about, **{part: getattr(module, part) for part in PARTS})


EXTREMES = {extreme.name: extreme for extreme in starmap(_extreme, ABOUT.items())}
"""The extremes, by name."""


def chosen(asked: Asked, only: Sequence[str] = ()) -> tuple[list[Extreme], dict[str, str]]:
    """Return the extremes that a problem has, and why it has not the others, and not all methods; BadInput if a name is unknown."""
    if only:
        require_known(*(("extreme", name, EXTREMES) for name in only))
    refused = {name: why for name in only or EXTREMES if (why := EXTREMES[name].refusal(asked))}
    absent = {name: why.removesuffix(".") for name, why in asked.left_out.items()}
    return [EXTREMES[name] for name in only or EXTREMES if name not in refused], refused | absent

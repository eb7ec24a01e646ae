"""The one way to draw the starts of an ensemble: from a distribution by its name, with parameters in a box."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from daebench.errors import BadInput, require_known, whole
from daebench.runs.ivp import Ivp
from daebench.starts.box import Bounds, Vary
from daebench.starts.energy import Energy
from daebench.starts.liouville import Liouville
from daebench.starts.members import Distribution, Grid, Neighbourhood, Starts

DISTRIBUTIONS: Mapping[str, Any] = {"neighbourhood": Neighbourhood, "liouville": Liouville, "energy": Energy, "grid": Grid}
"""Distributions of starts by name. A new one is one more file, and its entry here."""


def draw_starts(
    ivp: Ivp,
    distribution: str | Distribution = "neighbourhood",
    *,
    members: int | None = None,
    h: Any = None,
    parameters: Mapping[str, Any] | None = None,
    vary: Bounds | None = None,
    seed: int = 0,
    **settings: Any,
) -> Starts:
    """Return the members of an ensemble with their starts drawn, and a sentence that says how.

    ::

        >>> from daebench import initial_value_problem
        >>> ivp = initial_value_problem("planar_pendulum")
        >>> starts = draw_starts(ivp, "neighbourhood", members=3, h=0.01, vary={"gravity": (9.0, 10.0)}, size=0.1)
        >>> len(starts.members), sorted(starts.members.parameters)
        (3, ['gravity'])

    Parameters
    ----------
    ivp : Ivp
        The problem.
    distribution : str or Distribution
        Name in ``DISTRIBUTIONS``, or one of its classes with its settings.
    members : int, optional
        Number of members; a grid has its own.
    h : float or array_like, shape(n,)
        Step size of all, or of each, s; a grid may have it.
    parameters : mapping of str to array_like, shape(n,), optional
        Parameters that differ from member to member.
    vary : mapping of str to (float, float), optional
        Bounds of parameters that are drawn, see :class:`daebench.starts.box.Vary`.
    seed : int
        Seeds all random numbers, at least 0.
    **settings
        Settings of a distribution given by name: ``size`` of a neighbourhood, ``box`` of liouville, ``E`` and ``box`` of energy, ``values``
        of a grid.

    Raises
    ------
    BadInput
        If a name or a number is not what it must be, or nothing can be drawn.
    """
    chosen = distribution_of(distribution, settings)
    if not vary:
        return chosen.draw(ivp, members, h, parameters, seed)
    if isinstance(chosen, Grid):
        members = chosen.size if members is None else members
    if members is None or whole("members", members) < 1 or whole("seed", seed) < 0:
        raise BadInput(
            "parameters that vary need a number of members of at least 1, and a seed of at least 0.", "draws-without-seed-or-members"
        )
    if twice := set(vary) & set(parameters or {}):
        raise BadInput(f"{', '.join(sorted(twice))} is given, and is to vary too; give it once.", "varied-and-given")
    drawn = Vary(vary)
    starts = chosen.draw(ivp, members, h, {**(parameters or {}), **drawn.parameters(ivp, members, seed)}, seed)
    return replace(starts, about=f"{starts.about[:-1]}; {drawn.about}.")


def distribution_of(distribution: str | Distribution, settings: Mapping[str, Any]) -> Distribution:
    """Return a distribution with its settings; raise BadInput if a name is unknown."""
    if not isinstance(distribution, str):
        if settings:
            raise BadInput(
                f"{', '.join(settings)} cannot be given beside a distribution that has its settings.", "distribution-and-settings"
            )
        return distribution
    require_known(("distribution of starts", distribution, DISTRIBUTIONS))
    kind = DISTRIBUTIONS[distribution]
    for name in settings:
        require_known((f"setting of {distribution}", name, [*kind.__dataclass_fields__]))
    chosen: Distribution = kind(**settings)
    return chosen

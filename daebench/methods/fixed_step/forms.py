"""Formulations of the right-hand side that an ODE's scheme can be run on besides (1.18)."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from daebench.errors import positive

if TYPE_CHECKING:
    from daebench.runs.ivp import ConstrainedIvp
    from daebench.runs.local_flow import Map, State


def _same(p: Any, q: Any) -> "State":
    return tuple(p), tuple(q)


def _enter(ivp: "ConstrainedIvp") -> "Map":
    from daebench.runs.local_flow import enter

    return enter(ivp)


def _leave(ivp: "ConstrainedIvp") -> "Map":
    from daebench.runs.local_flow import leave

    return leave(ivp)


@dataclass(frozen=True)
class Form:
    """A form of the system.

    Parameters
    ----------
    about : str
        What it is.
    options : mapping of str to float
        Free numbers and their defaults; all must be greater than 0.
    enter, leave : callable
        ``enter(ivp)`` returns the map from (p, q) to what a scheme computes in, ``leave(ivp)`` the map back.
    """

    about: str
    options: Mapping[str, float] = field(default_factory=dict)
    enter: Callable[["ConstrainedIvp"], "Map"] = lambda ivp: _same
    leave: Callable[["ConstrainedIvp"], "Map"] = lambda ivp: _same

    def numbers(self, options: Mapping[str, float]) -> tuple[float, ...]:
        """Return the free numbers, as kernels take them; raise :class:`BadInput` where one is not greater than 0."""
        return tuple(positive(name, options.get(name, default)) for name, default in self.options.items())


OWN = Form("the system that a scheme is made for")
"""What a scheme is run on where no form is named."""

FORMS: Mapping[str, Form] = {
    "baumgarte": Form("(1.18) with (1.12) + 2 alpha G H_p + beta^2 g = 0 in place of (1.12)", {"alpha": 10.0, "beta": 10.0}),
    "stiff": Form("no constraint, but g^T g / (2 eps^2) added to H", {"eps": 1e-3}),
    "local": Form("local coordinates y of the manifold, HLW (2.22): y' = B(y) grad K(y)", {}, _enter, _leave),
}
"""The forms of constrained problems by name."""

POISSON_FORMS = {"darboux": "canonical coordinates z = (q, p, c), HLW VII.4.3: z' = B0 grad K(z)"}
"""Forms of a Poisson system that a scheme can be run on besides its own coordinates."""

LIFTED = "lifted"
"""What comes before the colon in the name of a method for a Poisson system that runs on the constrained system above it."""

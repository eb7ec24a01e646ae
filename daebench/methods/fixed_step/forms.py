"""Formulations of the right-hand side, other than (1.18), that an ODE scheme can be run on."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import partial
from typing import TYPE_CHECKING, Any

from daebench.errors import BadInput, positive

if TYPE_CHECKING:
    from daebench.runs.ivp import ConstrainedIvp
    from daebench.runs.local_flow import Map


def _enter(ivp: "ConstrainedIvp", form: str) -> "Map":
    from daebench.runs.local_flow import enter

    return enter(ivp, form)


def _leave(ivp: "ConstrainedIvp", form: str) -> "Map":
    from daebench.runs.local_flow import leave

    return leave(ivp, form)


def _in_chart(form: str) -> dict[str, Any]:
    """Return the maps of a form that computes in coordinates of the chart."""
    return {"enter": partial(_enter, form=form), "leave": partial(_leave, form=form)}


@dataclass(frozen=True)
class Form:
    """A form of the system."""

    about: str
    """Description."""
    options: Mapping[str, float] = field(default_factory=dict)
    """Free numbers and their defaults; all must be greater than 0."""
    most: Mapping[str, float] = field(default_factory=dict)
    """Largest value of such a number, if it is limited."""
    instead: str = ""
    """The motion that a run approximates in place of the constrained motion; "" for the constrained motion."""
    enter: Callable[["ConstrainedIvp"], "Map"] | None = None
    leave: Callable[["ConstrainedIvp"], "Map"] | None = None
    """``enter(ivp)`` returns the map from (p, q) to what a scheme computes in, ``leave(ivp)`` the map back; None if these are p and q."""

    def numbers(self, options: Mapping[str, float]) -> tuple[float, ...]:
        """Return the free numbers, as kernels take them; raise :class:`BadInput` if one is not greater than 0, or too large."""
        given = {name: positive(name, options.get(name, default)) for name, default in self.options.items()}
        for name, most in self.most.items():
            if given[name] > most:
                raise BadInput(f"{name} = {given[name]:g} must be at most {most:g}.", "number-too-large")
        return tuple(given.values())


OWN = Form("the system that a scheme is made for")
"""Form of a scheme if none is named."""

FORMS: Mapping[str, Form] = {
    "baumgarte": Form("(1.18) with (1.12) + 2 alpha G H_p + beta^2 g = 0 in place of (1.12)", {"alpha": 10.0, "beta": 10.0}),
    "stiff": Form(
        "no constraint, but g^T g / (2 eps^2) added to H",
        {"eps": 1e-3},
        instead="that of the penalised system, whose motion differs from the constrained one by eps^2 in positions and eps in velocities",
    ),
    "soft": Form(
        "g'' = (1 - r) a - r (c g' + k g), as in physics engines: stiffness k, damping c, impedance r; a = g'' without lam",
        {"stiffness": 1e4, "damping": 200.0, "impedance": 0.9},
        most={"impedance": 1.0},
        instead="that of soft constraints, whose motion differs from the constrained one by (1/impedance - 1)/stiffness",
    ),
    "local": Form("local coordinates y of the manifold, HLW (2.22): y' = B(y) grad K(y)", **_in_chart("local")),
    "canonical": Form("coordinates xi of a chart and their momenta (dq/dxi)^T p: a Hamiltonian system", **_in_chart("canonical")),
}
"""The forms of constrained problems by name."""

POISSON_FORMS = {"darboux": "canonical coordinates z = (q, p, c), HLW VII.4.3: z' = B0 grad K(z)"}
"""Forms of a Poisson system that a scheme can be run on besides its own coordinates."""

LIFTED = "lifted"
"""Prefix of the name of a method for a Poisson system that runs on a constrained system which maps to it."""

"""Fixed-step methods for either kind of problem as what is measured: which are accepted and what order they claim."""

from typing import Any

from daebench.errors import BadInput
from daebench.methods.fixed_step.constrained import FixedStep
from daebench.methods.fixed_step.lifted import Lifted
from daebench.methods.fixed_step.poisson import PoissonStep
from daebench.methods.outside.method import OutsideMethod
from daebench.runs.ivp import Ivp

PoissonScheme = PoissonStep | Lifted
"""A fixed-step method for Poisson systems, with its claims."""


def measured(method: Any, ivp: Ivp, why: str) -> Any:
    """Return a method, of either kind of problem, where it is a fixed-step method that takes this problem, or from outside.

    If it is not, BadInput says so with ``why`` that matters, or with the reason for which it refuses the problem.
    """
    if ivp.on_manifold and ivp.arrays:
        raise BadInput(
            f"{ivp.problem} with {ivp.facts.NODES} nodes is held as arrays, for which there is no reference solution {why}; "
            "take fewer nodes.",
            "no-reference-of-arrays",
        )
    if method.knob != "h":
        raise BadInput(
            f"{method.name} chooses its own steps {why}; give a fixed-step method, for example "
            f"{'rattle' if ivp.on_manifold else 'strang'}.",
            "own-steps-where-fixed-needed",
        )
    if isinstance(method, FixedStep) and not ivp.on_manifold:
        raise BadInput(
            f"{method.name} is given as a method for constrained problems, and {ivp.problem} is a Poisson system.", "method-for-constrained"
        )
    if refusal := method.refusal(ivp):
        raise BadInput(refusal, "method-refuses-problem")
    return method


def order_of(method: FixedStep | PoissonScheme) -> int:
    """Return the order that a method claims."""
    return method.claims.order if isinstance(method, FixedStep) else method.order


def claimed_order(method: FixedStep | PoissonScheme | OutsideMethod) -> int | None:
    """Return the order that a method claims; None of one from outside that claims none."""
    return method.claims.order if isinstance(method, OutsideMethod) else order_of(method)


def symmetric(method: PoissonScheme | OutsideMethod) -> bool | None:
    """Return whether a method for Poisson systems claims that Phi_{-h} o Phi_h is the identity; a composition of one that does too."""
    if isinstance(method, OutsideMethod):
        return method.claims.symmetric
    return method.member.symmetric if isinstance(method, PoissonStep) else method.method.claims.symmetric

"""The dictionary of faults: a description of each, and its remedy."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Fault:
    """A known fault.

    Parameters
    ----------
    about : str
        Behaviour of a code with the fault, as the end of "the code ...".
    remedy : str
        What to change, as a sentence.
    """

    about: str
    remedy: str


FAULTS = {
    "reference_gradient_at_q1": Fault(
        "corrects positions along G(q1), the gradients at the end of the step",
        "Take the gradients in q1 = q0 + h M^-1 (p - h/2 G(q0)^T lam) at q0, and keep them while lam is solved for.",
    ),
    "reference_gradient_each_sweep": Fault(
        "recomputes the gradients in each iteration for the positions",
        "Compute G(q0) once, before the iteration, and move positions and momenta only along it; only g is recomputed.",
    ),
    "momentum_not_corrected": Fault(
        "corrects positions for the constraint and leaves the momentum as it was",
        "Take the same impulse h/2 G(q0)^T lam from the momentum after the first kick with which q1 was reached.",
    ),
    "velocity_not_projected": Fault(
        "does not project the velocity at the end of the step: that is SHAKE",
        "End the step with p1 - G(q1)^T mu, and mu such that G(q1) M^-1 p1 = 0.",
    ),
    "full_kick": Fault("kicks with the whole step h in place of half of it", "Multiply the force by h/2 in each of the two kicks."),
    "old_force": Fault("computes the second kick with the force at q0", "Recompute the force at q1 before the second kick."),
    "one_sweep": Fault("ends the iteration for the positions after one iteration", "Iterate until the positions change only by rounding."),
    "loose_tolerance": Fault(
        "ends the iteration for the positions before the constraint holds",
        "Iterate until the increments are round-off; a tolerance on |g| causes a drift of the energy.",
    ),
    "mass_missing_in_position": Fault(
        "leaves M^-1 out where positions are corrected", "Move positions by h/2 M^-1 times the impulse G(q0)^T lam that the momentum gets."
    ),
    "mass_missing_in_velocity": Fault(
        "leaves M^-1 out where velocities are projected",
        "Solve (G M^-1 G^T) mu = G M^-1 p at q1, and take G^T mu from the momentum, or M^-1 G^T mu from the velocity.",
    ),
    "velocity_for_momentum": Fault(
        "takes momenta for velocities, or velocities for momenta",
        "Take p = M v throughout: q' = M^-1 p, and p1 is to be returned as a momentum.",
    ),
    "multiplier_sign": Fault(
        "uses a multiplier with the wrong sign",
        "Take the constraint forces with one sign in positions and momenta: -h/2 G^T lam in both halves of the step.",
    ),
    "multiplier_half": Fault(
        "uses half of a multiplier, or twice a multiplier, in a place",
        "Take the whole impulse with which q1 was reached from the momentum, and all of mu at the end.",
    ),
    "index_reduced": Fault(
        "integrates the index-reduced equations, lam computed from p and q, with a method for systems without constraints",
        "Solve for the multipliers in each step, such that g(q1) = 0; index-reduced equations preserve neither constraints nor two-form.",
    ),
    "projected_after": Fault(
        "takes a step without its constraints and projects the result onto the manifold",
        "Put the constraint into the step, along G(q0); a projection after it is neither symmetric nor symplectic.",
    ),
    "baumgarte": Fault(
        "returns to the constraint by Baumgarte feedback, which removes energy or adds some",
        "Leave out the feedback, and solve for the multipliers in each step, such that g(q1) = 0.",
    ),
    "step_off_by_one": Fault(
        "is a step ahead or behind, in positions, momenta, or both", "Count the steps: n calls must return the state at n h."
    ),
}
"""The faults by their names; each is relative to RATTLE, HLW (1.26)."""

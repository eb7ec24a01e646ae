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
        "Solve for the multipliers in each step, such that g(q1) = 0; most steps on index-reduced equations lose g = 0 and the two-form.",
    ),
    "projected_after": Fault(
        "takes a step without its constraints and projects the result onto the manifold",
        "Put the constraint into the step, along G(q0); a projection after it is neither symmetric nor symplectic.",
    ),
    "baumgarte": Fault(
        "returns to the constraint by Baumgarte feedback, which removes energy or adds some",
        "Leave out the feedback, and solve for the multipliers in each step, such that g(q1) = 0.",
    ),
    "reference_gradient_after_drift": Fault(
        "takes the gradients where the positions have drifted to, q0 + h v, before they are corrected",
        "Take the gradients G(q0) at the start of the step, before positions drift: for a bond, the vector between the positions there.",
    ),
    "reference_gradient_at_midpoint": Fault(
        "takes the gradients half way from q0 to q1", "Take the gradients in q1 = q0 + h M^-1 (p - h/2 G(q0)^T lam) at q0."
    ),
    "position_based": Fault(
        "moves positions, puts them back on the constraint and takes the velocity (q1 - q0) / h: that is position-based dynamics, "
        "of order 1, which dissipates energy",
        "Kick by half, reach q1 along G(q0) with the same impulse in the momentum, kick by half with the force at q1, and project "
        "the velocity.",
    ),
    "momentum_at_half_step": Fault(
        "returns the momentum of the middle of the step with the position of its end: that is the leapfrog form of SHAKE",
        "Add the second half of the kick at q1, and project the momentum, before it is returned.",
    ),
    "velocity_projected_at_q0": Fault(
        "projects velocities along gradients of another position than q1",
        "Recompute G at q1 before the velocity is projected: p1 - G(q1)^T mu with G(q1) M^-1 p1 = 0.",
    ),
    "velocity_projected_before_kick": Fault(
        "projects velocities before the second kick, not after it", "Add the second half of the kick first, and project p1 after it."
    ),
    "force_before_correction": Fault(
        "computes the second kick at q0 + h v, before positions are corrected", "Compute the force of the second kick at q1."
    ),
    "kick_missing": Fault(
        "leaves out a kick", "Multiply the force by h/2 in each of two kicks, at q0 before the drift and at q1 after it."
    ),
    "position_without_force": Fault(
        "drifts with the momentum before the first kick, so that the force is missing in the positions",
        "Kick by half first, and drift with the momentum after it.",
    ),
    "multiplier_times_h": Fault(
        "multiplies or divides a multiplier by h once too often",
        "Take the impulse from the momentum with which q1 was reached: M times the displacement, divided by h.",
    ),
    "multiplier_clamped": Fault(
        "leaves multipliers of one sign out, as for a rope or a contact", "Let the multipliers have both signs: a rod pulls and pushes."
    ),
    "constraint_missing": Fault(
        "leaves a constraint out", "Impose all constraints, on positions and on velocities; count the loop over them."
    ),
    "constraint_shifted": Fault(
        "meets the constraint with another value than zero", "Give the code the lengths of the problem, or the problem those of the code."
    ),
    "reaction_missing": Fault(
        "moves one body of a constraint, and leaves the other where it is",
        "Give each body of a constraint its part of the impulse, M^-1 G(q0)^T lam in all rows.",
    ),
    "force_scaled": Fault(
        "has a multiple of the problem's force, or its sign is wrong",
        "Compare -H_q with the force of the code at one position: its sign, the masses in it, and the parameters of both.",
    ),
    "other_equations": Fault(
        "solves other equations than the problem's: another mass, inertia or force",
        "Compare H_p and H_q of the code at one state with those of the problem, and the parameters of both.",
    ),
    "momentum_damped": Fault(
        "multiplies the momentum by a factor in each step", "Leave the factor out; a damped problem is another problem than the one given."
    ),
    "step_size_ignored": Fault("takes steps of one size, whatever h is", "Use the h that is given to the step."),
    "step_off_by_one": Fault(
        "is a step ahead or behind, in positions, momenta, or both", "Count the steps: n calls must return the state at n h."
    ),
}
"""The faults by their names; each is relative to RATTLE, HLW (1.26)."""

"""Kinds of work of schemes."""

WORK = ("H_p", "H_q", "g", "G", "second", "solve", "newton")
"""On constrained problems: evaluations of H_p, H_q, g, G, second derivatives, linear solves, Newton iterations."""

POISSON_WORK = ("field", "half", "flow", "second", "solve", "newton")
"""On Poisson systems: evaluations of B grad H, of one half of its components, and of flows of parts; then as in :data:`WORK`."""

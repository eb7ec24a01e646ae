"""Stabilised and soft constraints, mapped: what damping, stiffness and the step make of energy, constraints and cost."""

"""Trusted trajectories: the tolerance-driven solvers that make them."""

"""Formulations for tolerance-driven solvers: index 3, 2, 1, stabilised, and the index-reduced ODE."""

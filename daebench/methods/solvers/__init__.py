"""Tolerance-driven solvers: IDA, CVODE, SciPy, heyoka and solve_dae."""

"""Variants that may follow the name of a solver of ODEs, known before a solver is imported."""

CVODE = ("adams", "bdf")
"""Families of linear multistep methods: Adams, orders 1 to 12, and BDF, orders 1 to 5."""

PROJECTED = "bdf:projected"
"""CVODE's BDF with each step projected onto the constraints, of constrained problems."""

SCIPY = {"DOP853": False, "RK45": False, "RK23": False, "Radau": True, "BDF": True, "LSODA": True}
"""SciPy's methods, and whether they use the Jacobian."""

HEYOKA = ("taylor",)
"""Taylor series."""

"""The formulations of constrained problems and of Poisson systems by name, each with a description in one line."""

FORMULATIONS = {
    "index3": "(1.9) as it stands: q, p (or v), lam with 0 = g(q)",
    "index2": "(1.9) with 0 = G H_p, HLW (1.11), in place of g = 0",
    "index1": "(1.9) with HLW (1.12) in place of g = 0",
    "ggl": "Gear-Gupta-Leimkuhler: both g = 0 and G H_p = 0, with a second multiplier",
    "baumgarte": "index1 with (1.12) + 2 alpha G H_p + beta^2 g = 0; alpha = beta = 10 by default",
    "ode": "HLW (1.18): lam(p, q) is computed and inserted",
}
"""Those of constrained problems."""

OPTIONS: dict[str, dict[str, float]] = {"baumgarte": {"alpha": 10.0, "beta": 10.0}}
"""Free numbers of the formulations that have any, with their defaults, 1/s."""

POISSON_FORMULATIONS = {
    "casimirs": "y' = B H_y + C_y^T mu with 0 = C(y) - C(y0): index 2, with a multiplier for each Casimir function",
    "ode": "HLW (2.12): y' = B H_y",
}
"""Those of Poisson systems."""

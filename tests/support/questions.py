"""What each command that runs methods is asked in tests, and the numbers of its JSON that a wrong choice changes."""

import math

import pytest

H, T = ("--h", "0.11"), ("--t-end", "2")
ALONE = ("--repeat", "0", "--workers", "1", "--out", "OUT")

WORDS = {
    "run": ("PROBLEM", "--method", "METHOD", *H, *T),
    "compare": ("PROBLEM", "--methods", "METHOD", *H, *T),
    "animate": ("PROBLEM", "--methods", "METHOD", *H, *T, "--out", "OUT/motion.html"),
    "ensemble": ("PROBLEM", "--method", "METHOD", *H, *T, "--members", "4"),
    "chaos": ("PROBLEM", "--method", "METHOD", *H, "--t-end", "4", "--cells", "2"),
    "order": ("PROBLEM", "--methods", "METHOD", "--halvings", "4"),
    "check": ("PROBLEM", "--method", "METHOD"),
    "step-for": ("PROBLEM", "--method", "METHOD", *H, *T, "--statistic", "energy", "--margin", "1", "--members", "64", "--halvings", "1"),
    "tolerance-for": ("PROBLEM", "--drift", "10", *H, *T),
    "long": ("PROBLEM", "--methods", "METHOD", *H, "--steps", "64", "--stride", "1", "--workers", "1", "--out", "OUT"),
    "bench": ("--problem", "PROBLEM", "--methods", "METHOD", "--steps", "10", "--h", "0.11", "--repeat", "1"),
    "shadow": ("PROBLEM", "--method", "METHOD", *H, *T, "--orders", "2,4"),
    "precision": ("PROBLEM", "--methods", "METHOD", "--ways", "float64", *H, *T, *ALONE),
    "baumgarte": ("PROBLEM", "--methods", "rk4,rattle", "--tol", "1e-6", "--h", "0.1", "--t-end", "0.2"),
    "advise": ("PROBLEM", "--methods", "METHOD", "--accuracy", "0.1", *T, "--ensemble", "2", "--share", "0", "--store", "OUT/runs.db"),
    "stability": ("PROBLEM", "--methods", "METHOD", "--only", "step-limit", *T, "--workers", "1", "--out", "OUT"),
    "work-precision": ("PROBLEM", "--methods", "METHOD", "--h", "0.125,0.0625", *T, *ALONE),
    "modes": ("PROBLEM", "--methods", "METHOD"),
    "certify": ("METHOD", "--problem", "PROBLEM", "--h", "0.11", "--out", "OUT"),
    "generate": ("PROBLEM", "--method", "METHOD", "--h", "0.001", "--language", "python", "--overwrite", "--out", "OUT"),
}
"""Each command with what it is asked; OUT is a folder that its calls share, with the runs that are stored there."""


def components(series):
    return {row["component"]: row["order"] for row in series if row["component"] in ("q", "p", "y")}


SHOWN = {
    "run": lambda shown: shown["y"] if "y" in shown else shown["q"] + shown["p"],
    "compare": lambda shown: [shown["rows"][0][name] for name in ("energy_error", "position_error")],
    "ensemble": lambda shown: shown["quantiles"]["energy"],
    "chaos": lambda shown: shown["exponent"]["value"],
    "order": lambda shown: components(shown["series"]),
    "check": lambda shown: {row["property"]: row["verdict"] for row in shown["claims"]},
    "step-for": lambda shown: shown["tried"][0]["differences"]["mean"],
    "tolerance-for": lambda shown: [row["ratio"] for row in shown["tried"]],
    "long": lambda shown: [window["rms"] for window in shown["runs"][0]["windows"]],
    "bench": lambda shown: [math.copysign(1.0, shown["rows"][0]["ns_per_step"]), shown["rows"][0]["note"]],
    "shadow": lambda shown: [row["range"] for row in shown["runs"][0]["ranges"]],
    "precision": lambda shown: [shown["smallest_steps"][0]["energy_error"], shown["smallest_steps"][0]["failure"]],
    "baumgarte": lambda shown: [shown["effects"][0]["usual"]["energy_error"], shown["beside"][0]["energy_error"]],
    "advise": lambda shown: [shown["h"], shown["error"]],
    "stability": lambda shown: shown["said"]["step-limit"],
    "work-precision": lambda shown: [shown["best"], shown["failed"]],
    "modes": lambda shown: [*shown["frequencies"], shown["steps"]["rattle"]],
    "generate": lambda shown: shown["error"],
    "certify": lambda shown: shown["problems"][0]["numbers"]["orders"]["components"]["q"]["order"],
}
"""What commands print as JSON that a wrong choice changes; animate prints none."""


COARSE = {"certify": 0.01, "generate": 0.01}
"""Commands whose runs have other numbers of steps; numbers of the others agree but for rounding."""


def alike(found, expected, rel):
    """Return whether numbers and words in lists or mappings are the same."""
    if isinstance(expected, dict):
        return found.keys() == expected.keys() and alike(list(found.values()), list(expected.values()), rel)
    if isinstance(expected, list):
        return len(found) == len(expected) and all(alike(a, b, rel) for a, b in zip(found, expected, strict=True))
    return found == expected if isinstance(expected, str | None) else found == pytest.approx(expected, rel=rel, abs=1e-12)

"""Claims of the report on Poisson systems about orbits, defects and Casimir functions, tested before they are printed."""

from types import SimpleNamespace
from typing import Any

import pandas as pd

from daebench.diagnostics.drift import LAWS
from daebench.pages.report.claims import require
from daebench.reports.poisson.casimirs import BLOW_UP
from daebench.reports.poisson.defects import slopes
from daebench.reports.poisson.numbers import Numbers
from daebench.reports.poisson.orbits import CASES, METHODS, PRINTED, Orbits
from daebench.reports.poisson.runs import ROUND_OFF
from daebench.reports.poisson.system_claims import check_body, check_lattice, check_methods

VISIBLE = 1e-8
"""A larger defect at the largest step is not round-off."""

BAND = 0.15
"""Tolerance for the agreement of a fitted power of h with a whole number."""

TREND = 0.5
"""A fitted line accounts for more than this part of the largest change where the change is said to be a trend."""

DEFECT_POWERS = {"midpoint": 3, "rk4": 5}
"""Powers of h: one more than the order of the method."""

KEEP_BOTH, LOSE_BOTH = ("rattle", "symplectic_euler"), ("seproj", "implicit_euler", "local:midpoint", "local:rk4")
POISSON_METHODS = ("strang", "strang/suzuki4", "darboux:verlet")


def check(numbers: Numbers) -> SimpleNamespace:
    """Return the numbers of the text; the first sentence that does not hold raises ClaimRefuted."""
    return SimpleNamespace(
        orbits=check_orbits(numbers.orbits),
        defects=check_defects(slopes(numbers.defects).set_index("method")),
        lemma=check_lemma(numbers.lemma),
        casimirs=check_casimirs(numbers.casimirs, numbers.break_off),
        lattice=check_lattice(numbers),
        body=check_body(numbers.body, numbers.trajectories),
        closing=check_methods(numbers.methods),
    )


def check_orbits(orbits: Orbits) -> SimpleNamespace:
    """Test that the printed form leaves the domain, that two methods close their orbits, and that midpoint does not."""
    rows = {(row["case"], row["method"]): row for row in orbits.table.to_dict("records")}
    inner, outer = (rows[case, PRINTED] for case in CASES)
    for case, row in zip(CASES, (inner, outer), strict=True):
        require(
            "left the domain" in row["failure"], f"the printed form leaves the domain from ({case})", row["failure"] or "a complete run"
        )
        require(min(row["u_next"], row["v_next"]) <= 0, "its next step is beyond the axis", (row["u_next"], row["v_next"]))
    require(outer["steps"] == 0, "from (6,2) it does so in its first step", f"{outer['steps']} steps")
    require(inner["steps"] > 0, "from (4,2) it does so later", f"{inner['steps']} steps")
    for (case, name), row in rows.items():
        if name in METHODS:
            require(row["failure"] == "", f"{name} takes every step from ({case})", row["failure"])
        if name in ("symplectic_euler_adjoint", "verlet"):
            both = {row["kind"], row["orbit"]}
            require(both == {"bounded"}, f"{name} bounds the energy and closes the orbit from ({case})", both)
        if name == "midpoint":
            lost, inwards = -row["slope"] * row["t"] / row["most"], -row["wander"] / row["spread"]
            require(row["kind"] in LAWS and lost > TREND, "midpoint loses energy for good", (row["kind"], lost))
            require(row["orbit"] in LAWS and inwards > TREND, "its orbit spirals inwards", (row["orbit"], inwards))
            require(row["left"] < 0.95, "midpoint loses over 5 % of the energy above the equilibrium", row["left"])
    chosen: dict[str, Any] = {name: SimpleNamespace(**{case[0]: rows[case, name] for case in CASES}) for name in METHODS}
    least = min(row["revolutions"] for (_, name), row in rows.items() if name in METHODS)
    return SimpleNamespace(inner=inner, outer=outer, least_revolutions=least, row={key: vars(value) for key, value in chosen.items()})


def check_defects(fits: pd.DataFrame) -> SimpleNamespace:
    """Test which methods are Poisson maps to round-off, and the power of h in the defects of the others."""
    round_off_defects = []
    for name, row in fits.iterrows():
        if name not in DEFECT_POWERS:
            require(row["round_off"], f"{name} is a Poisson map to round-off", f"a defect of {row['most']:.2e}")
            round_off_defects.append(row["most"])
            continue
        power = DEFECT_POWERS[str(name)]
        require(row["most"] > VISIBLE, f"{name} is not a Poisson map", f"a defect of {row['most']:.2e}")
        require(abs(row["slope"] - power) <= BAND, f"the defect of {name} is O(h^{power})", f"{row['slope']:.3f}")
    return SimpleNamespace(kept=max(round_off_defects), row=fits.to_dict("index"))


def check_lemma(frame: pd.DataFrame) -> SimpleNamespace:
    """Test Lemma 4.9: both defects are round-off, or both fall with the same power of h."""
    symplectic, poisson = (slopes(frame, column).set_index("method") for column in ("symplectic", "poisson"))
    for name in KEEP_BOTH:
        both = symplectic["round_off"][name] and poisson["round_off"][name]
        require(both, f"{name} keeps both structures", (symplectic["most"][name], poisson["most"][name]))
    apart = []
    for name in LOSE_BOTH:
        neither = not symplectic["round_off"][name] and not poisson["round_off"][name]
        require(neither, f"{name} keeps neither", (symplectic["most"][name], poisson["most"][name]))
        apart.append(abs(symplectic["slope"][name] - poisson["slope"][name]))
        require(apart[-1] <= 2 * BAND, f"both defects of {name} fall with the same power of h", f"powers {apart[-1]:.3f} apart")
    most = max(float(table["most"][list(KEEP_BOTH)].max()) for table in (symplectic, poisson))
    return SimpleNamespace(kept=most, apart=max(apart), symplectic=symplectic["slope"].to_dict(), poisson=poisson["slope"].to_dict())


def check_casimirs(frame: pd.DataFrame, break_off: pd.DataFrame) -> SimpleNamespace:
    """Test that Poisson integrators keep all Casimir functions, midpoint the quadratic ones, and rk4 none."""
    rows = {(row["problem"], row["method"]): row for row in frame.to_dict("records")}
    casimir_errors = []
    for (problem, name), row in rows.items():
        if name in POISSON_METHODS:
            good = row["casimir"] <= ROUND_OFF and row["defect"] <= ROUND_OFF
            require(good, f"{name} keeps the Casimir functions of {problem}", (row["casimir"], row["defect"]))
            casimir_errors.append(row["casimir"])
        else:
            require(row["defect"] > 100 * ROUND_OFF, f"{name} is not a Poisson map on {problem}", row["defect"])
    for problem in ("free_rigid_body", "heavy_top_lie_poisson"):
        row, other = rows[problem, "midpoint"], rows[problem, "rk4"]
        require(row["casimir"] <= ROUND_OFF, f"midpoint keeps the quadratic Casimir functions of {problem}", row["casimir"])
        require(row["defect"] > VISIBLE, f"midpoint is nevertheless not a Poisson map on {problem}", row["defect"])
        require(other["casimir_kind"] == "linear", f"rk4 loses Casimir functions of {problem} linearly", other["casimir_kind"])
    species = {name: rows["lotka_volterra_3d", name] for name in ("midpoint", "rk4")}
    for name, row in species.items():
        require(row["casimir"] > VISIBLE, f"{name} loses the Casimir function of the three species", row["casimir"])
    require((break_off["failure"] != "").all(), "every method breaks off", break_off["failure"].tolist())
    off = float((break_off["t"] - BLOW_UP).abs().max())
    require(off < 0.02, "it does so within 0.02 of the blow-up", off)
    return SimpleNamespace(kept=max(casimir_errors), species=species, rows=rows, first=break_off["t"].min(), last=break_off["t"].max())

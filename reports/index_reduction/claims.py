"""Claims of the report on index reduction, tested on the numbers before they are printed."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pandas as pd

from daebench.diagnostics.energy import energy_drift
from daebench.pages.report.claims import require
from daebench.reports.index_reduction.ida import TOLERANCES
from daebench.reports.index_reduction.numbers import DEFECT_STEPS, FAST, OTHER_FAST, SLOW, Numbers

ROUND_OFF = 1e-13
"""A defect, or a residual of a constraint, up to this is round-off."""

VISIBLE = 1e-9
"""A larger defect shows that a map is not symplectic."""

ORDER_BAND = 0.05


def check(numbers: Numbers, ida: pd.DataFrame) -> SimpleNamespace:
    """Return the numbers of the text; the first sentence that does not hold raises ClaimRefuted."""
    table = numbers.table.set_index("method")
    check_symplecticity(numbers, table)
    check_table(table)
    return SimpleNamespace(drift=check_drift(numbers, table), swing=check_swing(numbers), ida=check_ida(ida), **texts(numbers, table))


def check_symplecticity(numbers: Numbers, table: pd.DataFrame) -> None:
    """Test that symplectic schemes keep the two-form, that ``se`` keeps it in its first step only, and that the others do not keep it."""
    for name, claim in table["claimed_symplectic"].items():
        defects = numbers.defects[name].to_numpy()
        if claim:
            require(defects.max() <= ROUND_OFF, f"{name} is symplectic to round-off", f"a defect of {defects.max():.2e}")
            continue
        later = defects[1:] if name == "se" else defects
        require(later.min() >= VISIBLE, f"{name} is not symplectic", f"a defect of {later.min():.2e}")
    first, ten = numbers.defects["se"][0], numbers.defects["se"][DEFECT_STEPS - 1]
    require(not table["claimed_symplectic"]["se"], "se does not claim to be symplectic", "a claim")
    require(first <= ROUND_OFF, "the first step of se is symplectic to round-off", f"a defect of {first:.2e}")
    projected = table["symplecticity"]["seproj"]
    require(projected > ten, "after ten steps seproj is further from symplectic than se", f"{projected:.2e} against {ten:.2e}")


def check_table(table: pd.DataFrame) -> None:
    """Test the claims of all schemes: order, symmetry, constraints."""
    for name, row in table.iterrows():
        require(row["failure"] is None, f"{name} takes every step", row["failure"])
        for x in ("q", "p"):
            order = row[f"order_{x}"]
            require(abs(order - row["claimed_order"]) <= ORDER_BAND, f"{name} has order {row['claimed_order']} in {x}", f"{order:.3f}")
        limits = {"reversibility": "claimed_symmetric", "g": "claimed_keeps_g"}
        for quantity, claim in limits.items():
            holds = row[quantity] <= ROUND_OFF if row[claim] else row[quantity] >= VISIBLE
            require(holds, f"{quantity} of {name} is {'' if row[claim] else 'not '}round-off", f"{row[quantity]:.2e}")
        if row["claimed_keeps_Gv"]:
            require(row["Gv"] <= ROUND_OFF, f"G H_p of {name} is round-off", f"{row['Gv']:.2e}")
        if row["claimed_symplectic"]:
            require(
                row["kind"] == "bounded" and row["L3"] <= ROUND_OFF, f"{name} bounds the energy and keeps L3", row[["kind", "L3"]].to_dict()
            )
    turning = table["reversibility_at_start"]["shake"]
    require(turning <= ROUND_OFF and table["reversibility"]["shake"] >= VISIBLE, "symmetry hides the defect of shake at the start", turning)
    require(table["Gv"]["shake"] >= VISIBLE, "shake leaves G H_p = 0", f"{table['Gv']['shake']:.2e}")


def check_drift(numbers: Numbers, table: pd.DataFrame) -> SimpleNamespace:
    """Return the numbers of Fig. 1.1: the energy error is linear with ``se`` and ``seproj``, and bounded with the constrained schemes."""
    se, seproj = numbers.drift_fit["se"], table.loc["seproj"]
    away = energy_drift(numbers.drift["se"]["t"], numbers.drift["se"]["distance"])
    require(se.law == "linear", "the energy of se drifts linearly", f"{se.brief}, exponent {se.exponent:.3f}")
    require(away.law == "linear", "se leaves the manifold linearly", f"{away.brief}, exponent {away.exponent:.3f}")
    require(seproj["kind"] == "linear", "the energy of seproj drifts linearly", f"{seproj['kind']}, exponent {seproj['growth']:.3f}")
    ratio = numbers.facts["se_slope_same_h"] / seproj["slope"]
    require(ratio >= 10, "the projection improves the slope at least tenfold", f"a factor of {ratio:.3g}")
    doubtful = abs(seproj["growth_short"] - 1) > 0.25 or seproj["growth_short_error"] > 0.25
    for name in ("L3", "Gv"):
        require(table[name]["se"] <= ROUND_OFF, f"se keeps {name}", f"{table[name]['se']:.2e}")
    require(table["L3"]["seproj"] >= VISIBLE, "the projection changes L3", f"{table['L3']['seproj']:.2e}")
    for name in ("seproj", "symplectic_euler", "rattle"):
        most = numbers.drift[name]["distance"].max()
        require(most <= ROUND_OFF, f"{name} stays on the manifold", f"a distance of {most:.2e}")
    for name in ("symplectic_euler", "rattle"):
        fit = numbers.drift_fit[name]
        require(fit.verdict == "bounded", f"the energy of {name} is bounded", fit.brief)
        most = numbers.drift[name]["energy_error"].abs().max()
        require(fit.change_bound < most, f"the mean of {name} changes by less than its energy error", f"{fit.change_bound:.2e}")
    bounds = {name: numbers.drift_fit[name].change_bound for name in ("symplectic_euler", "rattle")}
    return SimpleNamespace(
        bounds=bounds, se=se, away=away, ratio=ratio, doubtful=doubtful, distance=numbers.drift["se"]["distance"].iloc[-1]
    )


def check_swing(numbers: Numbers) -> SimpleNamespace:
    """Return the numbers of Fig. 1.2, from both tangent starts: one motion stays regular, the other decays."""
    swings = (numbers.swing, numbers.facts["other_swing"])
    first, other = (swing_numbers(swing, numbers.facts["periods"][case]) for swing, case in zip(swings, (FAST, OTHER_FAST), strict=True))
    for case, summary in ((FAST, first), ("fig1.2b", other)):
        require(summary.kind == "bounded", f"symplectic Euler bounds the energy on {case}", summary.kind)
        require(summary.regular < 0.05, f"its swings on {case} are equally high to 5 %", f"{summary.regular:.3g}")
        require(summary.falling, f"implicit Euler loses energy in every step on {case}", "a gain")
        require(
            summary.lost_at_once > 0.01,
            f"implicit Euler loses over 1 % of its energy in one period on {case}",
            f"{summary.lost_at_once:.2%}",
        )
        require(summary.lost_at_once > 5 * summary.wobble, f"that is more than symplectic Euler's error on {case}", f"{summary.wobble:.2%}")
    require(numbers.facts["se_stops"], "se has no solution on fig1.2", "a complete run")
    return SimpleNamespace(first=first, other=other, stops_at=numbers.facts["se_stops_at"])


def swing_numbers(swing: pd.DataFrame, period: float) -> SimpleNamespace:
    """Return regularity and losses of a pair of runs; energies are counted from the lowest point and relative to the start.

    The period is that of the exact motion.
    """
    t, q3 = swing["t"].to_numpy(), swing["q3_symplectic_euler"].to_numpy()
    tops = np.flatnonzero((q3[1:-1] > q3[:-2]) & (q3[1:-1] >= q3[2:])) + 1
    good, bad = (
        (swing[f"energy_{name}"].to_numpy() + 1) / (swing[f"energy_{name}"][0] + 1) for name in ("symplectic_euler", "implicit_euler")
    )
    return SimpleNamespace(
        period=period,
        periods=float(t[-1]) / period,
        regular=float(np.ptp(q3[tops]) / np.ptp(q3)),
        kind=energy_drift(t, good - 1).verdict,
        wobble=float(np.max(np.abs(good - 1))),
        falling=bool(np.all(np.diff(bad) < 0)),
        lost_at_once=float(1 - np.interp(period, t, bad)),
        lost=float(1 - bad[-1]),
    )


def check_ida(ida: pd.DataFrame) -> SimpleNamespace:
    """Return the numbers about IDA: how far its accuracy falls short of the tolerance, and the most accurate formulation."""
    done = ida[ida["failure"] == ""]
    tightest = done[done["tol"] == min(TOLERANCES)]
    ratio = tightest["error"] / tightest["tol"]
    require(len(tightest) and ratio.min() > 10, "at the tightest tolerance every error is over ten times what was asked", ratio.min())
    facts = SimpleNamespace(
        runs=len(ida), failed=len(ida) - len(done), beyond=int(np.sum(done["error"] > done["tol"])), tightest=min(TOLERANCES)
    )
    facts.useless = done[(done["error"] > 1) & (done["case"] == FAST)]
    for case, name in ((SLOW, "slow"), (FAST, "fast")):
        rows = tightest[tightest["case"] == case].sort_values("error")
        setattr(facts, name, SimpleNamespace(best=rows.iloc[0], worst=rows.iloc[-1]))
    off = tightest[tightest["case"] == FAST].set_index("formulation")
    require(off["g"]["index1"] > 100 * off["g"]["index3"], "index 1 drifts off g = 0 while index 3 holds it", off["g"].to_dict())
    require(off["error"]["index3"] > off["error"]["index1"], "index 3 is less accurate than index 1 nevertheless", off["error"].to_dict())
    facts.fast_g = off["g"]
    return facts


def texts(numbers: Numbers, table: pd.DataFrame) -> dict[str, Any]:
    """Return numbers that the text needs and that no claim tests."""
    symplectic_names = [name for name, claim in table["claimed_symplectic"].items() if claim]
    return {
        "row": {str(name): row for name, row in table.iterrows()},
        "first_step": {name: numbers.defects[name][0] for name in table.index},
        "second_step": numbers.defects["se"][1],
        "kept": symplectic_names,
        "kept_most": float(numbers.defects[symplectic_names].max().max()),
    }

"""Claims of the report on methods, tested on the numbers before they are printed."""

from types import SimpleNamespace

import numpy as np
import pandas as pd

from daebench.diagnostics.drift import BOUNDED, DRIFTS
from daebench.diagnostics.drift import KEPT as ROUNDING
from daebench.pages.report.claims import require
from daebench.reports.methods.families import left_out, method
from daebench.reports.methods.guide import ROUND_OFF, guide
from daebench.reports.methods.matrix import HIDDEN, LOST, check_claims, keeping, matrix
from daebench.reports.methods.numbers import Numbers
from daebench.reports.methods.reverse import reverse
from daebench.reports.methods.series import KEEPING, LONG, powers
from daebench.reports.methods.sweep import PENDULUM, TORUS
from daebench.studies.claims.bench import OK

STEEP = 0.25
"""Tolerance by which a power of h may fall short of the theoretical minimum."""

NO_DEFECT = 1e-11
"""A defect of ten steps up to this is round-off; SHAKE has more round-off than others, because its momenta are difference quotients."""

SOFTENED = ("stiff", "soft")
"""The forms that replace the constraint by a spring, whose error no step size removes."""

ON_MANIFOLD = 1e-11
"""A distance from the manifold over a long run up to this is round-off."""


def check(numbers: Numbers) -> SimpleNamespace:
    """Return the numbers of the text; the first sentence that does not hold raises ClaimRefuted."""
    check_claims(numbers.claims)
    table = matrix(numbers.claims)
    return SimpleNamespace(
        table=table,
        tally=tally(numbers.claims, table),
        orders=orders(numbers.orders, table),
        defects=defects(powers(numbers.defects)),
        long=long(numbers.drift, table),
        reverse=reverse(numbers.reverse),
        work=work(numbers.work),
        guide=guide(numbers, table),
    )


def tally(claims: pd.DataFrame, table: pd.DataFrame) -> SimpleNamespace:
    """Return the counts of claims and methods."""
    asked = claims[claims["property"] != "refused"]
    ode = table[table["family"].isin(["ode", "projected"])]
    untouched = ode.loc[ode["symplectic"] != LOST, "method"].tolist()
    require(not untouched, "no method of (1.18), projected or not, is symplectic", untouched)
    for key in ("symplectic", "g", "Gv", "H"):
        exceptions = table[(table["family"] == "ode") & (table[key] != LOST)]
        require(exceptions.empty, f"methods for (1.18) lose {key}", list(exceptions["method"]))
    uneven = [name for name in keeping(table, "symplectic") if name not in keeping(table, "symmetric")]
    tilted = list(table.loc[table["family"].isin(["symplectic", "composed"]) & (table["Gv"] == LOST), "method"])
    off = list(table.loc[table["family"].isin(["symplectic", "composed"]) & (table["g"] == LOST), "method"])
    require(not off, "symplectic methods for (1.9) keep the constraint", off)
    everything = keeping(table, "symmetric", "symplectic", "g", "Gv")
    refused = list(table.loc[table["refused"] == TORUS.problem, "method"])
    hidden = {key: list(table.loc[table[key] == HIDDEN, "method"]) for key in ("symmetric", "symplectic", "g", "Gv", "H")}
    return SimpleNamespace(
        methods=len(table),
        held=int((asked["verdict"] == OK).sum()),
        everything=everything,
        schemes=list(dict.fromkeys(method(name).scheme for name in everything)),
        uneven=uneven,
        tilted=tilted,
        symplectic=keeping(table, "symplectic"),
        energy=keeping(table, "H"),
        hidden={key: names for key, names in hidden.items() if names},
        refused=[name for name in refused if not method(name).claims.constraints],
        distances=[name for name in refused if method(name).claims.constraints],
        left_out=left_out(),
        shorter=shorter(claims),
    )


def shorter(claims: pd.DataFrame) -> list[tuple[str, float]]:
    """Return the methods that complete the pendulum's run only with a step size below half of its step size, and these step sizes."""
    pendulum_claims = claims[(claims["problem"] == PENDULUM.problem) & claims["h"].notna()]
    return [(str(name), float(h)) for name, h in pendulum_claims.groupby("method", sort=False)["h"].first().items() if h < PENDULUM.h / 2]


def orders(fits: pd.DataFrame, table: pd.DataFrame) -> SimpleNamespace:
    """Return how far measured orders differ from claimed ones, and the methods whose order could not be measured."""
    measured_orders = table[table["order"].notna()]
    off = (measured_orders["order"] - measured_orders["claimed"]).abs()
    worst = measured_orders.iloc[int(off.argmax())]
    require(off.max() < 0.5, "each measured order rounds to the one that is claimed", f"{worst['method']}: {off.max():.2f}")
    untold = list(table.loc[table["order"].isna(), "method"])
    softened = [name for name in table["method"] if method(name).form in SOFTENED]
    require(untold == softened, "all methods except those of the stiff and the soft form show an order", untold)
    torus = fits[(fits["problem"] == TORUS.problem) & fits["component"].isin(["q", "p"])]
    return SimpleNamespace(
        count=len(measured_orders),
        off=off.max(),
        worst=worst,
        highest=int(measured_orders["claimed"].max()),
        untold=untold,
        torus=sorted(set(torus["method"]), key=list(torus["method"]).index),
        error=measured_orders["order_error"].max(),
    )


def defects(fitted_powers: pd.DataFrame) -> SimpleNamespace:
    """Test that the two-form is kept at every step size, or that its defect falls at least with the order plus one."""
    two_form = fitted_powers[fitted_powers["property"] == "symplectic"].set_index("method")
    symplectic_rows = two_form[two_form.index.isin(KEEPING)]
    lost = two_form[~two_form.index.isin(KEEPING)]
    require(
        symplectic_rows["most"].max() < NO_DEFECT,
        "symplectic methods keep the two-form at every step size",
        f"a defect of {symplectic_rows['most'].max():.1e}",
    )
    for name, row in lost.iterrows():
        least = row["order"] + 1 - STEEP
        require(row["power"] > least, f"the defect of {name} falls at least with h^{row['order'] + 1}", f"a power of {row['power']:.2f}")
    reversal = fitted_powers[fitted_powers["property"] == "symmetric"]
    flat = list(reversal.loc[reversal["most"] < NO_DEFECT, "method"])
    symmetric_methods = [name for name in reversal["method"] if method(name).claims.symmetric]
    require(flat == symmetric_methods, "of these methods the symmetric ones are reversible at every step size, and no others", flat)
    uneven = [name for name in symplectic_rows.index if name not in flat]
    return SimpleNamespace(kept=list(symplectic_rows.index), most=symplectic_rows["most"].max(), lost=lost, flat=flat, uneven=uneven)


def long(drift: pd.DataFrame, table: pd.DataFrame) -> SimpleNamespace:
    """Test that symplectic methods bound the energy over the long run, and that methods on the manifold stay there.

    The energy is tested for all methods that aim at the constrained motion, the distance only for those whose curves are shown.
    """
    run = drift.set_index("method")
    aiming = [name for name in keeping(table, "symplectic") if name in run.index and method(name).form not in SOFTENED]
    for name in aiming:
        good = run["H_long"][name] in (BOUNDED, ROUNDING) and run["failure"][name] == ""
        require(good, f"the energy of {name} is bounded", run.loc[name, ["kind", "failure"]].to_dict())
    run = run.loc[[name for name in LONG if name in run.index]]
    symplectic = [name for name in aiming if name in run.index]
    for name in run.index:
        if name in keeping(table, "g", "Gv"):
            require(run["distance"][name] < ON_MANIFOLD, f"{name} stays on the manifold", f"a distance of {run['distance'][name]:.1e}")
    on = [name for name in run.index if name in keeping(table, "g", "Gv")]
    others = [name for name in run.index if name not in symplectic]
    restless = [name for name in on if run["H_long"][name] == DRIFTS]
    still = [name for name in run.index if name not in on and run["energy"][name] <= ROUND_OFF]
    require(restless and still, "a method on the manifold may lose the energy, and one off it keep it", restless + still)
    return SimpleNamespace(
        row=run,
        symplectic=symplectic,
        others=others,
        on=on,
        most=run["distance"][on].max(),
        all=len(aiming),
        drifting=drifting(drift[~drift["method"].isin(aiming)], table),
    )


def drifting(drift: pd.DataFrame, table: pd.DataFrame) -> SimpleNamespace:
    """Return how many methods of the table there are in these runs, in how many the energy drifts, and how many end early."""
    others = drift[drift["method"].isin(table["method"])]
    ended = int((others["failure"] != "").sum())
    said = others.loc[others["failure"] == "", "H_long"]
    return SimpleNamespace(others=len(others), drifts=int((said == DRIFTS).sum()), ended=ended)


def work(frame: pd.DataFrame) -> SimpleNamespace:
    """Test that every method has a time, and return the extremes."""
    ns = frame.set_index("method")["ns"]
    require(np.isfinite(ns).all() and (ns > 0).all(), "each method has a time", ns[~np.isfinite(ns)].to_dict())
    without = list(frame.loc[frame["newton"] == 0, "method"])
    return SimpleNamespace(
        row=frame.set_index("method"), cheapest=ns.idxmin(), least=ns.min(), dearest=ns.idxmax(), most=ns.max(), without=without
    )

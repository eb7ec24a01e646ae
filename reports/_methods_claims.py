"""What the report on methods asserts: each sentence is tested on the numbers before it is printed."""

from types import SimpleNamespace

import numpy as np
import pandas as pd

from daebench.claims_bench import OK
from daebench.reports._claims import require
from daebench.reports._methods_guide import guide
from daebench.reports._methods_matrix import HIDDEN, LOST, check_claims, keeping, matrix
from daebench.reports._methods_numbers import Numbers
from daebench.reports._methods_series import KEEPING, powers
from daebench.reports._methods_sweep import PENDULUM, TORUS

STEEP = 0.25
"""A power of h may fall short of the least that theory gives by so much."""

ON_MANIFOLD = 1e-11
"""A distance from the manifold over a long run up to this is round-off."""


def check(numbers: Numbers) -> SimpleNamespace:
    """Return the numbers of the text, all sentences tested.

    Raises
    ------
    ClaimRefuted
        If one does not hold.
    """
    check_claims(numbers.claims)
    table = matrix(numbers.claims)
    return SimpleNamespace(
        table=table,
        tally=tally(numbers.claims, table),
        orders=orders(numbers.orders, table),
        defects=defects(powers(numbers.defects)),
        long=long(numbers.drift, table),
        work=work(numbers.work),
        guide=guide(numbers, table),
    )


def tally(claims: pd.DataFrame, table: pd.DataFrame) -> SimpleNamespace:
    """Return what is counted of claims and methods."""
    asked = claims[claims["property"] != "refused"]
    ode = table[table["family"].isin(["ode", "projected"])]
    untouched = ode.loc[ode["symplectic"] != LOST, "method"].tolist()
    require(not untouched, "no method of (1.18), projected or not, is symplectic", untouched)
    hidden = {key: list(table.loc[table[key] == HIDDEN, "method"]) for key in ("symmetric", "symplectic", "g", "Gv", "H")}
    return SimpleNamespace(
        methods=len(table),
        held=int((asked["verdict"] == OK).sum()),
        everything=keeping(table, "symmetric", "symplectic", "g", "Gv"),
        symplectic=keeping(table, "symplectic"),
        energy=keeping(table, "H"),
        hidden={key: names for key, names in hidden.items() if names},
        refused=list(table.loc[table["refused"] == TORUS.problem, "method"]),
        shorter=shorter(claims),
    )


def shorter(claims: pd.DataFrame) -> list[tuple[str, float]]:
    """Return the methods that last on the pendulum with less than half of its step size only, and with which."""
    own = claims[(claims["problem"] == PENDULUM.problem) & claims["h"].notna()]
    return [(str(name), float(h)) for name, h in own.groupby("method", sort=False)["h"].first().items() if h < PENDULUM.h / 2]


def orders(fits: pd.DataFrame, table: pd.DataFrame) -> SimpleNamespace:
    """Return how far measured orders are from those claimed, and what could not be told."""
    told = table[table["order"].notna()]
    off = (told["order"] - told["claimed"]).abs()
    require(
        off.max() < 0.5, "each measured order rounds to the one that is claimed", f"{told.loc[off.idxmax(), 'method']}: {off.max():.2f}"
    )
    torus = fits[(fits["problem"] == TORUS.problem) & fits["component"].isin(["q", "p"])]
    return SimpleNamespace(
        count=len(told),
        off=off.max(),
        worst=told.loc[off.idxmax()],
        highest=int(told["claimed"].max()),
        untold=list(table.loc[table["order"].isna(), "method"]),
        torus=sorted(set(torus["method"]), key=list(torus["method"]).index),
        error=told["order_error"].max(),
    )


def defects(found: pd.DataFrame) -> SimpleNamespace:
    """Test that the two-form is kept at every step size, or its defect falls with the order plus one at least."""
    two_form = found[found["property"] == "symplectic"].set_index("method")
    kept = two_form[two_form.index.isin(KEEPING)]
    lost = two_form[~two_form.index.isin(KEEPING)]
    require(kept["most"].max() < 1e-11, "symplectic methods keep the two-form at every step size", f"a defect of {kept['most'].max():.1e}")
    for name, row in lost.iterrows():
        least = row["order"] + 1 - STEEP
        require(row["power"] > least, f"the defect of {name} falls at least with h^{row['order'] + 1}", f"a power of {row['power']:.2f}")
    reversal = found[found["property"] == "symmetric"].set_index("method")
    return SimpleNamespace(
        table=found,
        kept=list(kept.index),
        most=kept["most"].max(),
        lost=lost,
        reversal=reversal,
        flat=list(reversal.index[reversal["power"].isna()]),
    )


def long(drift: pd.DataFrame, table: pd.DataFrame) -> SimpleNamespace:
    """Test that symplectic methods bound the energy over the long run, and that those on the manifold stay there."""
    run = drift.set_index("method")
    symplectic = [name for name in run.index if name in keeping(table, "symplectic")]
    for name in symplectic:
        good = run["kind"][name] == "bounded" and run["failure"][name] == ""
        require(good, f"the energy of {name} is bounded", run.loc[name, ["kind", "failure"]].to_dict())
    for name in run.index:
        if name in keeping(table, "g", "Gv"):
            require(run["distance"][name] < ON_MANIFOLD, f"{name} stays on the manifold", f"a distance of {run['distance'][name]:.1e}")
    on = [name for name in run.index if name in keeping(table, "g", "Gv")]
    others = [name for name in run.index if name not in symplectic]
    return SimpleNamespace(row=run, symplectic=symplectic, others=others, on=on, most=run["distance"][on].max())


def work(frame: pd.DataFrame) -> SimpleNamespace:
    """Test that all times are there, and return the extremes."""
    ns = frame.set_index("method")["ns"]
    require(np.isfinite(ns).all() and (ns > 0).all(), "each method has a time", ns[~np.isfinite(ns)].to_dict())
    without = list(frame.loc[frame["newton"] == 0, "method"])
    return SimpleNamespace(
        row=frame.set_index("method"), cheapest=ns.idxmin(), least=ns.min(), dearest=ns.idxmax(), most=ns.max(), without=without
    )

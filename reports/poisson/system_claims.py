"""Claims of the report on Poisson systems about the lattice, the rigid body and all methods, tested on the numbers."""

from types import SimpleNamespace
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd

from daebench.pages.report.claims import require
from daebench.reports.poisson.body import ORDERS
from daebench.reports.poisson.lattice import FINE, QUANTITIES, H
from daebench.reports.poisson.runs import ROUND_OFF

if TYPE_CHECKING:
    from daebench.reports.poisson.numbers import Numbers

VISIBLE = 1e-7
ENERGY_RANGE = (1 / 0.6 - 1) / 2
"""Range of the energy on the unit sphere, for the moments 0.6, 0.8 and 1."""


def check_lattice(numbers: "Numbers") -> SimpleNamespace:
    """Test which errors drift or are bounded on the lattice, and how inaccurate a splitting of second order is."""
    rows = {row["method"]: row for row in numbers.lattice[numbers.lattice["h"] == H].to_dict("records")}
    fine = numbers.lattice[numbers.lattice["h"] == FINE].iloc[0]
    for quantity in QUANTITIES:
        kind = rows["rk4"][f"{quantity}_kind"]
        require(kind == "linear", f"rk4 loses {quantity} linearly", kind)
    unbounded = []
    for name in ("strang", "strang/suzuki4", "darboux:verlet"):
        for quantity in ("energy", "norm", "coupling"):
            kind = rows[name][f"{quantity}_kind"]
            require(kind in ("bounded", "undetermined"), f"{quantity} does not drift with {name}", kind)
            unbounded += [(name, quantity)] if kind == "undetermined" else []
    require(not [name for name, _ in unbounded if name == "darboux:verlet"], "darboux:verlet bounds energy, norm and coupling", unbounded)
    middle = rows["midpoint"]
    for quantity in ("coupling", "momentum"):
        require(middle[quantity] <= ROUND_OFF, f"midpoint keeps {quantity}, which is quadratic", middle[quantity])
    require(middle["norm_kind"] == "bounded" and middle["norm"] > ROUND_OFF, "it bounds the norm", (middle["norm_kind"], middle["norm"]))
    share = rows["strang"]["norm"] / numbers.sizes["norm"]
    require(share > 0.5, "the error of strang in the norm is over half of the norm", f"{share:.2f}")
    ratio = rows["strang"]["norm"] / rows["darboux:verlet"]["norm"]
    require(ratio > 1000, "darboux:verlet is a thousand times more accurate", f"a factor of {ratio:.3g}")
    cure = rows["strang"]["norm"] / rows["strang/suzuki4"]["norm"]
    require(cure > 1e5, "order four is a hundred thousand times more accurate", f"a factor of {cure:.3g}")
    gain = rows["strang"]["norm"] / fine["norm"]
    require(gain > 10, "an eighth of the step makes strang ten times more accurate", f"a factor of {gain:.3g}")
    fast = numbers.speeds["part"] / numbers.speeds["all"]
    require(fast > 5, "a part alone moves the lattice over five times as fast as all parts together", f"{fast:.3g} times")
    return SimpleNamespace(row=rows, unbounded=unbounded, fine=fine, share=share, ratio=ratio, fast=fast, cost=numbers.cost)


def check_body(frame: pd.DataFrame, trajectories: pd.DataFrame) -> SimpleNamespace:
    """Test which methods stay on the sphere, keep the energy, and are Poisson maps; lifted RATTLE has all three properties."""
    rows: dict[Any, Any] = {row["method"]: row for row in frame.to_dict("records")}
    for name, row in rows.items():
        if row["claimed_poisson"]:
            good = row["C"] <= ROUND_OFF and row["defect"] <= ROUND_OFF
            require(good, f"{name} stays on the sphere as a Poisson map", (row["C"], row["defect"]))
    for name in (*ORDERS, "strang@top", "darboux:verlet"):
        require(rows[name]["energy_kind"] == "bounded", f"{name} bounds the energy", rows[name]["energy_kind"])
    for name in ("midpoint", "lifted:rattle"):
        both = max(rows[name]["energy"], rows[name]["C"])
        require(both <= ROUND_OFF, f"{name} keeps energy and Casimir function", both)
    require(rows["midpoint"]["defect"] > VISIBLE, "midpoint is not a Poisson map", rows["midpoint"]["defect"])
    require(rows["lifted:rattle"]["claimed_poisson"], "RATTLE on the constrained system claims to be a Poisson map", "no claim")
    for quantity in ("energy", "C"):
        require(rows["rk4"][f"{quantity}_kind"] == "linear", f"rk4 loses {quantity} linearly", rows["rk4"][f"{quantity}_kind"])
    energies = {name: rows[name]["energy"] for name in ORDERS}
    best, worst = min(energies, key=energies.__getitem__), max(energies, key=energies.__getitem__)
    factor = energies[worst] / energies[best]
    require(factor > 3, "the order of the factors changes the energy error over threefold", f"a factor of {factor:.3g}")
    require(
        rows["strang@top"]["energy"] < energies[best], "the symmetric top is more accurate than every order", rows["strang@top"]["energy"]
    )
    return SimpleNamespace(row=rows, best=best, worst=worst, factor=factor, **check_picture(trajectories))


def check_picture(trajectories: pd.DataFrame) -> dict[str, float]:
    """Test that with the large step of the picture only rk4 leaves the sphere."""
    length = np.sqrt((trajectories[["y1", "y2", "y3"]] ** 2).sum(axis=1))
    rk4_mask = trajectories["method"] == "rk4"
    off = float((length[~rk4_mask] - 1).abs().max())
    require(off <= ROUND_OFF, "all methods of the picture but rk4 stay on the sphere", f"a distance of {off:.2e}")
    last = trajectories["t"] == trajectories["t"].max()
    require(length[rk4_mask & last].max() < 0.95, "rk4 ends over 5 % below the sphere from every start", length[rk4_mask & last].tolist())
    energy = {str(name): float(rows["energy"].abs().max()) for name, rows in trajectories.groupby("method")}
    require(energy["midpoint"] <= ROUND_OFF, "midpoint is on the energy curves", f"{energy['midpoint']:.2e}")
    shifted, tilted = energy["strang@top"] / ENERGY_RANGE, energy["strang@123"] / ENERGY_RANGE
    require(shifted < 0.15, "the energy error of strang@top is below 15 % of the range on the sphere", f"{shifted:.3g}")
    require(tilted > 0.5, "the energy error of strang@123 is over half of the range on the sphere", f"{tilted:.3g}")
    lengths = {"off": off, "shortest": float(length[rk4_mask & last].min()), "longest": float(length[rk4_mask & last].max())}
    return lengths | {"tilted": energy["strang@123"], "shifted": energy["strang@top"]}


def check_methods(frame: pd.DataFrame) -> SimpleNamespace:
    """Test claims against measurements, method by method."""
    for row in frame.to_dict("records"):
        name = row["method"]
        good = row["defect"] <= ROUND_OFF if row["claimed"] else row["defect"] > VISIBLE
        require(good, f"{name} is {'' if row['claimed'] else 'not '}a Poisson map", row["defect"])
        if row["claimed"]:
            require(row["kind"] in ("bounded", "kept"), f"the energy of {name} is bounded", row["kind"])
        else:
            require(row["kind"] != "bounded", f"the energy of {name} is not bounded", row["kind"])
    lost = frame.set_index("method").loc["rk4"]
    require(
        min(lost["casimir_lotka_volterra_3d"], lost["casimir_free_rigid_body"]) > VISIBLE, "rk4 keeps no Casimir function", lost.to_dict()
    )
    worst = float(frame["defect"][frame["claimed"]].max())
    return SimpleNamespace(poisson=int(frame["claimed"].sum()), defect=worst, ns=frame.set_index("method")["ns"].to_dict())

"""The guide of the report on methods: which method to use, each recommendation with the numbers that support it, tested."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pandas as pd

from daebench.diagnostics.drift import LAWS
from daebench.pages.report.claims import require
from daebench.reports.methods.long_runs import ROUND_OFF, T_LONG
from daebench.reports.methods.matrix import HIDDEN, keeping
from daebench.reports.methods.measured import Numbers
from daebench.reports.methods.sweep import EVALUATIONS, PENDULUM, TOL

COARSE, FINE = 1e-3, 1e-10
"""Two target errors of the position, m."""

SAME = 1e-3
"""Relative tolerance for the errors of two methods with the same positions."""


TREND = 0.5
"""A fitted line accounts for more than this part of the largest energy error where the energy is said to fall."""


def guide(numbers: Numbers, table: pd.DataFrame) -> SimpleNamespace:
    """Return the numbers of the guide; the first sentence that does not hold raises ClaimRefuted."""
    everything = [name for name in keeping(table, "symmetric", "symplectic", "g", "Gv") if not refused(table, name)]
    return SimpleNamespace(
        everything=everything,
        first=first(numbers, everything),
        strang=strang(numbers),
        accuracy=accuracy(numbers, everything),
        shake=shake(numbers, table),
        projection=projection(numbers, table),
        energy=energy(numbers, table),
        radau=radau(numbers),
        ida=ida(numbers),
    )


def refused(table: pd.DataFrame, name: str) -> bool:
    """Return whether a method refuses one of the motions."""
    return bool(table.set_index("method").loc[name, "refused"])


def first(numbers: Numbers, everything: list[str]) -> SimpleNamespace:
    """Test that RATTLE has the cheapest step of all methods that keep reversal, two-form and constraints on any problem."""
    ns = numbers.work.set_index("method")["ns"]
    rest = [name for name in everything if name != "rattle"]
    require("rattle" in everything, "rattle keeps reversal, the two-form and both constraints", everything)
    require(ns["rattle"] <= ns[rest].min(), "a step of rattle is the cheapest", f"{ns['rattle']:.0f} against {ns[rest].min():.0f} ns")
    return SimpleNamespace(ns=ns["rattle"], next=ns[rest].idxmin(), ratio=ns[rest].min() / ns["rattle"])


def strang(numbers: Numbers) -> SimpleNamespace:
    """Test that splitting needs no iteration, and is more accurate than RATTLE at the same step size."""
    work, errors = numbers.work.set_index("method"), errors_of(numbers.points)
    require(work["newton"]["strang"] == 0, "strang needs no iteration", work["newton"]["strang"])
    both = pd.concat([errors["rattle"], errors["strang"]], axis=1, keys=["rattle", "strang"]).dropna().sort_index().iloc[-1]
    require(both["strang"] < both["rattle"], "strang is more accurate than rattle", both.to_dict())
    return SimpleNamespace(ratio=both["rattle"] / both["strang"], sweeps=work["newton"]["rattle"])


def errors_of(points: pd.DataFrame) -> dict[str, "pd.Series[float]"]:
    """Return the errors of the position on the pendulum down to round-off, by method, indexed by the number of steps, few steps first."""
    position_errors = points[
        (points["problem"] == PENDULUM.problem) & (points["component"] == "q") & (points["reason"] != "round-off")
    ].dropna(subset=["error"])
    return {str(name): runs.set_index("steps")["error"].sort_index() for name, runs in position_errors.groupby("method", sort=False)}


def accuracy(numbers: Numbers, everything: list[str]) -> SimpleNamespace:
    """Test that, of methods that keep all but energy, one of high order needs the fewest evaluations for a small error."""
    work = numbers.work.set_index("method")
    per_step = work[list(EVALUATIONS)].sum(axis=1)
    errors = errors_of(numbers.points)
    orders = numbers.orders.set_index("method")["claimed"].dropna().groupby(level=0).first()
    best: dict[float, Any] = {}
    for level in (COARSE, FINE):
        cost = pd.Series({name: steps_for(errors[name], level) * per_step[name] for name in everything if name in errors})
        best[level] = SimpleNamespace(method=str(cost.idxmin()), evaluations=cost.min(), ratio=cost["rattle"] / cost.min())
    coarse, fine = best[COARSE], best[FINE]
    what = f"high order pays for an error of {FINE:.0e} and less so for {COARSE:.0e}"
    higher = orders[fine.method] > 4 and fine.ratio > max(10, coarse.ratio)
    require(higher, what, f"{fine.method} by {fine.ratio:.3g}, {coarse.method} by {coarse.ratio:.3g}")
    return SimpleNamespace(coarse=coarse, fine=fine, order=int(orders[fine.method]))


def steps_for(errors: "pd.Series[float]", level: float) -> float:
    """Return the number of steps from which on the error stays below a bound, interpolated or extrapolated along a power of h."""
    x, y = np.log(errors.index.to_numpy(dtype=float)), np.log(errors.to_numpy())
    above = np.flatnonzero(y > np.log(level))
    first = min(int(above[-1]), len(x) - 2) if len(above) else 0
    if not len(above):
        return float(errors.index[0])
    slope = (y[first + 1] - y[first]) / (x[first + 1] - x[first])
    return float(np.exp(x[first] + (np.log(level) - y[first]) / slope))


def shake(numbers: Numbers, table: pd.DataFrame) -> SimpleNamespace:
    """Test that SHAKE has the positions of RATTLE, and momenta that are not tangent."""
    errors = errors_of(numbers.points)
    both = pd.concat([errors["rattle"], errors["shake"]], axis=1, keys=["rattle", "shake"]).dropna()
    apart = float((both["shake"] / both["rattle"] - 1).abs().max())
    require(len(both) >= 3 and apart < SAME, "shake has the positions of rattle", f"errors that differ by {apart:.1e}")
    off = table.set_index("method")["Gv_most"]["shake"]
    require(off > ROUND_OFF, "shake leaves G H_p = 0", f"{off:.1e}")
    return SimpleNamespace(apart=apart, off=off)


def projection(numbers: Numbers, table: pd.DataFrame) -> SimpleNamespace:
    """Test that projected methods stay on the manifold, but are not symplectic, and that the energy of projected rk4 still drifts."""
    projected = table[table["family"] == "projected"]
    symplectic_names = [name for name in projected["method"] if name in keeping(table, "symplectic")]
    hidden = list(projected.loc[projected["symplectic"] == HIDDEN, "method"])
    require(not symplectic_names and not hidden, "no projected method is symplectic", symplectic_names + hidden)
    require(
        (projected["g"] == "kept").all() and (projected["Gv"] == "kept").all(), "all projected ones are on the manifold", projected["g"]
    )
    drift = numbers.drift.set_index("method")
    require(drift["kind"]["rk4+proj"] == "linear", "the energy of rk4+proj drifts linearly", drift["kind"]["rk4+proj"])
    return SimpleNamespace(methods=list(projected["method"]), slope=drift["slope"]["rk4+proj"], most=projected["symplectic_most"].max())


def energy(numbers: Numbers, table: pd.DataFrame) -> SimpleNamespace:
    """Test that the energy-momentum method keeps the energy, but neither the two-form nor tangent momenta."""
    row, run = table.set_index("method").loc["energy_momentum"], numbers.drift.set_index("method").loc["energy_momentum"]
    require(run["energy"] <= ROUND_OFF and row["H"] == "kept", "energy_momentum keeps the energy", f"{run['energy']:.1e}")
    require(row["symplectic"] == row["Gv"] == "lost", "it keeps neither two-form nor G H_p", row[["symplectic", "Gv"]].to_dict())
    return SimpleNamespace(most=run["energy"], defect=row["symplectic_most"], off=row["Gv_most"])


def radau(numbers: Numbers) -> SimpleNamespace:
    """Test that Radau IIA damps: the energy decreases by more than round-off."""
    run = numbers.drift.set_index("method").loc["radau2_ggl"]
    falls = -run["slope"] * T_LONG > TREND * run["energy"] and run["kind"] in LAWS
    require(falls, "the energy of radau2_ggl falls", f"{run['kind']}, slope {run['slope']:.1e}")
    return SimpleNamespace(slope=run["slope"], slope_error=run["slope_error"], energy=run["energy"], kind=run["kind"])


def ida(numbers: Numbers) -> SimpleNamespace:
    """Test that IDA keeps no constraint to round-off in any formulation."""
    least = numbers.ida[["g", "Gv"]].min().min()
    require(least > 1e-12, "IDA keeps no constraint to round-off", f"{least:.1e}")
    best = numbers.ida.set_index("method")["g"]
    return SimpleNamespace(tol=TOL, best=best.idxmin(), least=best.min(), worst=best.idxmax(), most=best.max())

"""The cost of accuracy: errors of many methods against their cost, the cheapest for each accuracy, and for what is to be conserved."""

from collections.abc import Collection, Mapping, Sequence
from typing import Any, Unpack

import numpy as np
from numpy.typing import NDArray

from daebench.diagnostics.drift import BOUNDED, KEPT, UNDETERMINED
from daebench.errors import BadInput
from daebench.methods.initial_value_problem import initial_value_problem
from daebench.methods.names import methods_of
from daebench.reference.solution import certified_for
from daebench.runs.ivp import Array
from daebench.runs.own_start import OwnStart
from daebench.runs.state import CONSTRAINED, POISSON
from daebench.studies.grid.claimed import feasible, installed, usual
from daebench.studies.grid.reference import usual_end
from daebench.studies.grid.rows import by_method
from daebench.studies.grid.run_specification import OUTPUTS
from daebench.studies.grid.study import Study
from daebench.systems.lazily import pandas as pd

ON_MANIFOLD = (
    *("symplectic_euler", "rattle", "rattle/suzuki4", "rattle/kahan_li8", "lobatto3", "lobatto4", "strang/suzuki4"),
    *("rk4", "rk4+proj", "local:gauss3", "radau3_ggl", "generalized_alpha"),
    *(
        "ida:index3",
        "ida:index2",
        "ida:index1",
        "ida:ggl",
        "cvode:adams",
        "scipy:DOP853",
        "scipy:Radau",
        "heyoka:taylor",
        "solve_dae:Radau",
    ),
)
"""One or two methods of each family, by fixed steps and by tolerance."""

ON_POISSON = (
    *("symplectic_euler", "strang", "strang/suzuki4", "strang/kahan_li8", "midpoint", "rk4"),
    *("ida:ode", "cvode:adams", "scipy:DOP853", "heyoka:taylor"),
)
"""The same for Poisson systems."""

METHODS = {CONSTRAINED: ON_MANIFOLD, POISSON: ON_POISSON}

TOLERANCES = tuple(10.0**-k for k in range(3, 14))
"""Tolerances where none are given."""

SAMPLES = 256
"""States of a run that are looked at, about: enough for oscillations of the energy to be told from its drift."""

HALVINGS = 8
"""Step sizes where none are given: from the distance of stored times down, each half of the one before."""

STEPS = 2**20
"""Most steps of a run where step sizes are not given."""

LEVELS = tuple(10.0**-k for k in range(2, 14, 2))
"""Accuracies for which the cheapest method is named."""

REPEAT = 3
"""Runs that are timed, after the one that warms up."""

CALLS = 200_000
"""Calls of the right side or residual after which a tolerance-driven run is given up."""

NOT_COSTS = ("n_steps", "n_newton", "n_solve")
"""Counts that are no evaluations of the problem's functions."""

WHOLE = ("n_rhs", "n_residual", "n_jacobian")
"""Counts of calls that evaluate all functions of the equations at once."""

IN_A_CALL = 4
"""Functions that a call for a constrained problem evaluates: H_p, H_q, G, and g or the second derivatives of (1.18)."""

ROUND_OFF = 1e-12
"""An error of a conserved quantity of the size of one, or a defect, up to this is round-off."""

EPS = float(np.finfo(float).eps)

LEAST = 3
"""Runs of a method that have to agree that it keeps something: a single one may do so by chance."""

CONSERVED = {
    "nothing": "nothing",
    "energy": "energy without drift",
    "constraints": "constraints to round-off",
    "casimirs": "Casimir functions to round-off",
    "two_form": "two-form (symplectic)",
}
"""What may be asked for, and its words."""


def standard(
    problem: str,
    *,
    case: str | None = None,
    methods: Sequence[str] | None = None,
    h: Sequence[float] | None = None,
    tol: Sequence[float] | None = None,
    t_end: float | None = None,
    parameters: Mapping[str, float] | None = None,
    repeat: int = REPEAT,
    beside: bool = False,
    also: Sequence[str] = (),
    anyway: bool = False,
    on_singular: str | None = None,
    **start: Unpack[OwnStart],
) -> tuple[Study, dict[str, str]]:
    """Return the study of a problem, and why methods are not in it: they do not apply, or are not installed; what is not given is chosen.

    ``also`` are metrics besides those that are chosen, ``parameters`` values of the problem's, ``start`` is one's own; ``anyway`` and
    ``on_singular`` are as for :func:`daebench.run`.

    Errors are taken against the certified reference where it is of these parameters and reaches the end, else against a finer run. Step
    sizes are the distance of its times, halved and halved again, so that errors are taken at stored times; those of a finer run are
    the end over :data:`daebench.studies.grid.run_specification.OUTPUTS`. BadInput is raised for values that are of no use.
    """
    ivp = initial_value_problem(problem, case, parameters, on_singular=on_singular, **start)
    if methods is None:
        methods, left_out = feasible(ivp, usual(METHODS, ivp), anyway=anyway)
    else:
        methods, left_out = installed(methods)
    end = usual_end(certified_for(ivp, 0.0)) if t_end is None else t_end
    reference = certified_for(ivp, end)
    spacing = float(reference.t[1]) if reference else end / OUTPUTS
    steps = [spacing / 2**k for k in range(HALVINGS) if end / (spacing / 2**k) <= STEPS]
    names = tuple(dict.fromkeys((*ivp.state.stored, ivp.state.conserved, "phase", "energy", "integrals")))
    solvers = methods_of(ivp, methods, anyway=anyway)
    values = {"h": list(h or steps), "tol": list(tol or TOLERANCES)}
    resolutions = sorted({solver.knob for solver in solvers})
    for resolution, given in (("h", h), ("tol", tol)):
        if given and resolution not in resolutions:
            raise BadInput(f"values of {resolution} are not used by {', '.join(methods)}; leave them out.", "values-unused-by-methods")
    runs: dict[str, Any] = {"problem": problem, "cases": [ivp.case], "methods": list(methods), "t_end": end}
    runs |= {
        "anyway": anyway,
        "on_singular": on_singular or "",
        "values": {resolution: values[resolution] for resolution in resolutions},
        "parameters": {name: [x] for name, x in (parameters or {}).items()},
    }
    measured: dict[str, Any] = {"metrics": [*names, *also], "outputs": SAMPLES}
    return Study(**runs, **measured, repeat=repeat, calls=CALLS, beside=beside), left_out


def with_costs(table: "pd.DataFrame") -> "pd.DataFrame":
    """Return a table with one more column of costs.

    ``evaluations`` are all counted evaluations of functions of the problem and of their derivatives; a call of the whole right side or
    residual of a constrained problem counts as :data:`IN_A_CALL`, as a fixed-step method on the same equations has it.
    """
    counts = [name for name in table.columns if name.startswith("n_") and name not in NOT_COSTS]
    in_a_call = IN_A_CALL if initial_value_problem(str(table["problem"].iloc[0])).on_manifold else 1
    weights = {name: in_a_call if name in WHOLE else 1 for name in counts}
    return table.assign(evaluations=(table[counts] * weights).sum(axis=1, min_count=1))


def bound_of(table: "pd.DataFrame", error: str) -> str:
    """Return the column of the bounds of an error; "" if it has none."""
    bound = error.replace("error_", "bound_")
    return bound if bound != error and bound in table else ""


def at_least(runs: "pd.DataFrame", error: str) -> "pd.Series[float]":
    """Return the moduli of errors of runs, and where one is below the bound of what it is taken against, that bound: less is not known."""
    errors, bound = runs[error].abs(), bound_of(runs, error)
    return errors.where((errors >= runs[bound]) | errors.isna(), runs[bound]) if bound else errors


def front(table: "pd.DataFrame", error: str, cost: str) -> "pd.DataFrame":
    """Return the Pareto front: the runs than which none is both cheaper and as accurate, from the cheapest to the most accurate.

    Errors below their bound count as their bound, so that no run is on the front for digits that nobody knows.
    """
    errors = at_least(table, error)
    good = table.assign(known=errors)[np.isfinite(errors) & (table[cost] > 0)].sort_values([cost, "known"])
    return good[good["known"] < good["known"].cummin().shift(fill_value=np.inf)].drop(columns="known")


def costs_at(table: "pd.DataFrame", error: str, cost: str, level: float) -> dict[str, tuple[float, float]]:
    """Return the cost of an accuracy and the step size or tolerance for it, by method, the cheapest first; see :func:`cheapest`."""
    costs = {name: at for name, runs in by_method(table) if (at := _cost_at(runs, error, cost, level))}
    return dict(sorted(costs.items(), key=lambda entry: entry[1][0]))


def cheapest(table: "pd.DataFrame", error: str, cost: str, levels: Sequence[float]) -> "pd.DataFrame":
    """Return the cheapest method for each accuracy, its cost, and the factor by which the next one is more expensive.

    Between two runs of a method, one above an accuracy and one below it, log cost is taken as linear in log error. Errors below their
    bound are unknown, and count as their bound. Columns are level, method, value, cost, next, ratio; a level that no method reaches has no
    row.
    """
    rows = []
    for level in levels:
        ranked = list(costs_at(table, error, cost, level).items())
        if ranked:
            (method, (price, value)), second = ranked[0], ranked[1] if len(ranked) > 1 else None
            dearer = {"next": second[0], "ratio": second[1][0] / price} if second else {"next": "", "ratio": float("nan")}
            rows.append({"level": level, "method": method, "value": value, cost: price, **dearer})
    return pd.DataFrame(rows, columns=["level", "method", "value", cost, "next", "ratio"])


def _cost_at(runs: "pd.DataFrame", error: str, cost: str, level: float) -> tuple[float, float] | None:
    """Return the cost of an accuracy by one method, and the step size or tolerance that reaches it; None if it is not reached."""
    errors, costs = (np.array(column, dtype=float)[:, None] for column in (at_least(runs, error), runs[cost]))
    (price,), (run,) = interpolated(errors, costs, level) if len(runs) else ([np.inf], [0])
    return (float(price), float(runs["value"].iloc[run])) if np.isfinite(price) else None


def interpolated(errors: Array, costs: Array, level: float) -> tuple[Array, NDArray[np.int64]]:
    """Return the cost of an accuracy in each of n curves, infinite where it is not reached, and the number of the run that reaches it.

    Between two runs, one above the accuracy and one below it, log cost is taken as linear in log error; runs without a finite error or a
    cost are left out.

    Shapes: errors, costs (m, n).
    """
    usable = np.isfinite(errors) & np.isfinite(costs) & (costs > 0)
    order = np.argsort(np.where(usable, costs, np.inf), axis=0, kind="stable")
    error, cost, good = (np.take_along_axis(rows, order, axis=0) for rows in (errors, costs, usable))
    reached: NDArray[np.bool_] = np.logical_and(good, error <= np.float64(level))
    here, curve = np.argmax(reached, axis=0), np.arange(errors.shape[1])
    last = np.maximum(here - 1, 0)
    above, below, less, more = error[last, curve], error[here, curve], cost[last, curve], cost[here, curve]
    with np.errstate(all="ignore"):
        between = less * (more / less) ** (np.log(above / level) / np.log(above / below))
    at = np.where((here > 0) & (above > level) & (level > below) & (below > 0), between, more)
    return np.where(reached.any(axis=0), at, np.inf), order[here, curve]


def with_conserved(table: "pd.DataFrame", defects: Mapping[str, float], claims: Mapping[str, Collection[str]]) -> "pd.DataFrame":
    """Return a table of a work-precision study with columns ``keeps_...``: what each run claims to keep and was measured to keep."""
    done = table["failure"] == ""
    two_form = done & (table["method"].map(defects) <= ROUND_OFF)
    unrefuted = two_form & _claiming(table, claims, "two_form") & (table["energy_verdict"] == UNDETERMINED)
    conserved = {"nothing": done, "energy": done & (table["energy_verdict"].isin((KEPT, BOUNDED)) | unrefuted)}
    if {"g", "Gv"} <= set(table.columns):
        conserved["constraints"] = done & (table[["g", "Gv"]].max(axis=1, skipna=False) <= ROUND_OFF)
    if "casimirs" in table and table["casimirs"].notna().any():
        added_up = (EPS * table["steps"]).clip(lower=ROUND_OFF)  # one rounding a step of a number of the size of one
        conserved["casimirs"] = done & (table["casimirs"] <= added_up)
    for name in set(conserved) - {"nothing"}:
        conserved[name] = _agreed(table, conserved[name])
    conserved["two_form"] = two_form
    claiming = {name: _claiming(table, claims, name) for name in conserved}
    parts = {"claims_energy": claiming["energy"], "measured_energy": conserved["energy"]}
    for name in set(conserved) - {"nothing"}:
        conserved[name] = conserved[name] & claiming[name]
    return table.assign(**parts, **{f"keeps_{name}": conserved[name] for name in CONSERVED if name in conserved})


def _claiming(table: "pd.DataFrame", claims: Mapping[str, Collection[str]], name: str) -> "pd.Series[bool]":
    """Return which runs are of methods that claim to keep something."""
    return table["method"].map({method: name in claims.get(method, ()) for method in set(table["method"])})


def _agreed(table: "pd.DataFrame", flags: "pd.Series[bool]") -> "pd.Series[bool]":
    """Return for which runs something holds, and for all of the same method with smaller values that came to their end."""
    done = table[table["failure"] == ""]
    agreed = pd.Series(False, index=table.index)
    for _, runs in done.sort_values("value").groupby("method"):
        so_far = flags[runs.index].cummin().to_numpy()
        if len(so_far) >= LEAST:
            agreed[runs.index] = so_far & so_far[LEAST - 1]
    return agreed


def recommended(table: "pd.DataFrame", error: str, cost: str, levels: Sequence[float]) -> "pd.DataFrame":
    """Return for each accuracy, and each thing that is to be conserved, the cheapest run that does both, and the next best method.

    The table is that of :func:`with_conserved`; columns are level, conserve, method, knob, value, cost, error, price, next, ratio; one row
    each of level and conserve. Cost and error are those of the run with this value; price is the cost of the accuracy itself, between
    runs, and ratio the factor by which the next method is more expensive there, see
    :func:`daebench.studies.work_precision.study.cheapest`. Where no run does both, method is "" and numbers are NaN.
    """
    nan = float("nan")
    rows = []
    for level in levels:
        for name in (quantity for quantity in CONSERVED if f"keeps_{quantity}" in table):
            keeping = table[table[f"keeps_{name}"]]
            row = {"level": level, "conserve": name, "method": "", "knob": "", "value": nan, "cost": nan, "error": nan}
            row |= {"price": nan, "next": "", "ratio": nan}
            for best in cheapest(keeping, error, cost, [level]).to_dict("records"):
                run = keeping[(keeping["method"] == best["method"]) & (keeping["value"] == best["value"])].iloc[0]
                row |= {"method": best["method"], "knob": run["knob"], "value": best["value"], "cost": run[cost], "error": run[error]}
                row |= {"price": best[cost], "next": best["next"], "ratio": best["ratio"]}
            rows.append(row)
    return pd.DataFrame(rows)

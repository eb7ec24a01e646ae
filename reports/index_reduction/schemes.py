"""Measurements of the report on index reduction with fixed steps; no judgement here, and no text."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from daebench.diagnostics.drift import Drift
from daebench.diagnostics.energy import energy_drift
from daebench.diagnostics.energy_verdict import energy_error
from daebench.diagnostics.integrals import integral_errors
from daebench.diagnostics.manifold import distance
from daebench.diagnostics.order import fit_order
from daebench.diagnostics.reversibility import reversibility_defect
from daebench.diagnostics.symplecticity import symplecticity_defect, tangent_basis
from daebench.draw.figures import QUIET, grid_of_axes, save
from daebench.draw.methods import stroke_of
from daebench.methods.fixed_step.constrained import FixedStep
from daebench.methods.initial_value_problem import initial_value_problem
from daebench.methods.names import parse
from daebench.pages.report import Progress, number, with_error
from daebench.pages.report.claims import require
from daebench.pages.report.exact_motion import exact_motion, swing_period
from daebench.pages.report.tables import Columns, Of, code, tiny
from daebench.pages.report.two_processes import Job, computed
from daebench.runs.ivp import Array, ConstrainedIvp
from daebench.runs.make_ivp import constrained
from daebench.runs.request import Request
from daebench.runs.trajectory import Trajectory

PROBLEM, SLOW, FAST, OTHER_FAST = "spherical_pendulum", "fig1.1", "fig1.2", "fig1.2b"
SCHEMES = ("se", "seproj", "symplectic_euler", "symplectic_euler_adjoint", "implicit_euler", "shake", "rattle")
H, H_SE, H_FAST = 0.03, 0.003, 0.01
T_END, T_LONG, T_FAST, T_ORDER = 100.0, 300.0, 10.0, 1.0
DRIFT_RUNS = {"se": H_SE, "seproj": H, "symplectic_euler": H, "rattle": H}
MOST_STEPS, DEFECT_STEPS = 30, 10
ORDER_STEPS = (40, 80, 160, 320, 640, 1280)
TIMED_STEPS, TIMED_RUNS = 20000, 7
SHOWN = 2500
FORMULATIONS = ("index3", "index2", "index1", "ggl")
COMPILED = 0.6
"""Fraction of the work that is done when everything is compiled."""


@dataclass(frozen=True)
class Numbers:
    """Everything that is measured with fixed steps."""

    drift: Mapping[str, pd.DataFrame]
    """Fig. 1.1: for each run t, energy_error and distance (to the manifold)."""
    drift_fit: Mapping[str, Drift]
    """Drift of the energy in these runs."""
    swing: pd.DataFrame
    """Fig. 1.2: t, and q3 and energy of both methods."""
    defects: pd.DataFrame
    """Symplecticity defect after n steps, one column per scheme."""
    errors: pd.DataFrame
    """Errors of q and p against the closed form, by scheme and h."""
    table: pd.DataFrame
    """One row per scheme: claims, defects, orders, drifts, cost."""
    facts: Mapping[str, Any]
    """Single numbers that the text needs."""


def measure(tell: Progress) -> Numbers:
    """Return the numbers; ``tell`` receives the fraction done and a description of the current work."""
    slow, fast = constrained(initial_value_problem(PROBLEM, SLOW)), constrained(initial_value_problem(PROBLEM, FAST))
    rows, errors, defects = [], [], {}
    kernels: list[Job] = [(compile_ida, FORMULATIONS), *((compile_scheme, (name,)) for name in ("rk4", *SCHEMES))]
    for _ in computed(kernels, lambda fraction, doing: tell(COMPILED * fraction, doing), "compiled"):
        pass
    q, p = exact_motion(slow.source, SLOW, [T_ORDER])
    for name in SCHEMES:
        tell(COMPILED, f"{name}: orders and drifts")
        errors += [order_errors(slow, name, 1.0 / n, p[0], q[0]) for n in ORDER_STEPS]
        rows.append(claims(name) | conservation(slow, name))
    drift = {name: drift_run(slow, name, h) for name, h in DRIFT_RUNS.items()}
    for k, (name, row) in enumerate(zip(SCHEMES, rows, strict=True)):
        tell(COMPILED + (1 - COMPILED) * k / len(SCHEMES), f"{name}: defects and cost")
        defects[name] = symplecticity(slow, name)
        row |= orders([row for row in errors if row["method"] == name]) | cost(slow, name)
        row |= {"symplecticity": defects[name][DEFECT_STEPS - 1], "reversibility": reversibility(slow, name, p[0], q[0])}
        row["reversibility_at_start"] = reversibility(slow, name, slow.p0, slow.q0)
    return Numbers(
        drift={name: frame for name, (frame, _) in drift.items()},
        drift_fit={name: fit for name, (_, fit) in drift.items()},
        swing=swing(fast),
        defects=pd.DataFrame({"n": np.arange(1, MOST_STEPS + 1), **defects}),
        errors=pd.DataFrame(errors),
        table=pd.DataFrame(rows),
        facts=facts(slow, fast),
    )


def compile_scheme(name: str) -> None:
    """Have the kernels of a scheme made, in real and in complex numbers, by steps of no consequence."""
    ivp = constrained(initial_value_problem(PROBLEM, SLOW))
    FixedStep(name).solve(ivp, Request(value=H_FAST, steps=1, watch=()))
    FixedStep(name).flow(ivp, H_FAST, 1)(tuple(ivp.p0), tuple(ivp.q0))


def compile_ida(*formulations: str) -> None:
    """Have the callbacks of IDA for some formulations compiled, by runs of no consequence."""
    ivp = constrained(initial_value_problem(PROBLEM, SLOW))
    for formulation in formulations:
        parse(f"ida:{formulation}").solve(ivp, Request(value=1e-4, t_end=H, points=2, watch=("manifold",)))


def fixed_step(ivp: ConstrainedIvp, name: str, h: float, t_end: float, every: int = 1) -> Trajectory:
    """Return a run. One kernel per scheme serves all runs: states are stored and monitored afterwards, so that less is compiled."""
    return FixedStep(name).solve(ivp, Request(value=h, t_end=t_end, every=every, watch=()))


def claims(name: str) -> dict[str, Any]:
    """Return the claims of a scheme."""
    scheme_claims = FixedStep(name).claims
    names = ("order", "symmetric", "symplectic", "keeps_g", "keeps_Gv")
    return {"method": name, "system": scheme_claims.system} | {f"claimed_{claim}": getattr(scheme_claims, claim) for claim in names}


def symplecticity(ivp: ConstrainedIvp, name: str) -> list[float]:
    """Return the symplecticity defects after 1, 2, ... steps from the start."""
    X = tangent_basis(ivp, ivp.p0, ivp.q0)
    return [symplecticity_defect(FixedStep(name).flow(ivp, H, n), ivp.p0, ivp.q0, X) for n in range(1, MOST_STEPS + 1)]


def reversibility(ivp: ConstrainedIvp, name: str, p: Array, q: Array) -> float:
    """Return the reversibility defect of one step."""
    return reversibility_defect(FixedStep(name).flow(ivp, H, 1), p, q)


def orders(errors: list[dict[str, Any]]) -> dict[str, Any]:
    """Return the fitted orders of q and p with their standard errors."""
    fits = {x: fit_order([row["h"] for row in errors], [row[f"error_{x}"] for row in errors]) for x in ("q", "p")}
    return {f"order_{x}": fit.slope for x, fit in fits.items()} | {f"order_{x}_error": fit.slope_error for x, fit in fits.items()}


def order_errors(ivp: ConstrainedIvp, name: str, h: float, p: Array, q: Array) -> dict[str, Any]:
    """Return the error at t = 1 against the closed form."""
    run = fixed_step(ivp, name, h, T_ORDER, every=0)
    return {"method": name, "h": h, "error_q": np.linalg.norm(run.q[-1] - q), "error_p": np.linalg.norm(run.p[-1] - p)}


def conservation(ivp: ConstrainedIvp, name: str) -> dict[str, Any]:
    """Return the errors of the energy, the constraints and L3 to t = 100, and the growth exponent to t = 300.

    The shorter run is the beginning of the longer one.
    """
    run = fixed_step(ivp, name, H, T_LONG)
    energy = energy_error(ivp, run)
    shown = run.t <= T_END
    short, long = energy_drift(run.t[shown], energy[shown]), energy_drift(run.t, energy)
    return {
        "energy_error": np.max(np.abs(energy[shown])),
        "slope": short.slope,
        "slope_error": short.slope_error,
        "growth_short": short.exponent,
        "growth_short_error": short.exponent_error,
        "growth": long.exponent,
        "growth_error": long.exponent_error,
        "kind": long.brief,
        "g": np.max(np.abs(ivp.along("g", run.q[shown]))),
        "Gv": np.max(np.abs(ivp.along("Gv", run.p[shown], run.q[shown]))),
        "L3": np.max(np.abs(integral_errors(ivp, run)["L3"][shown])),
    }


def cost(ivp: ConstrainedIvp, name: str) -> dict[str, Any]:
    """Return the work of a step by kind of evaluation, and its time, best of several runs."""
    request = Request(value=H, steps=TIMED_STEPS, every=0, watch=())
    runs = [FixedStep(name).solve(ivp, request) for _ in range(TIMED_RUNS)]
    work = {f"work_{kind}": times / runs[0].steps for kind, times in runs[0].work.items()}
    return work | {"ns_per_step": 1e9 * min(run.seconds / run.steps for run in runs), "failure": runs[0].failure}


def drift_run(ivp: ConstrainedIvp, name: str, h: float) -> tuple[pd.DataFrame, Drift]:
    """Return a run of Fig. 1.1, thinned out to be drawn, and the drift of its energy over all steps."""
    run = fixed_step(ivp, name, h, T_END).complete()
    energy = energy_error(ivp, run)
    stride = slice(None, None, max(1, round(len(run.t) / SHOWN)))
    away = distance(ivp, run.p[stride], run.q[stride])
    return pd.DataFrame({"t": run.t[stride], "energy_error": energy[stride], "distance": away}), energy_drift(run.t, energy)


def swing(ivp: ConstrainedIvp) -> pd.DataFrame:
    """Return Fig. 1.2: height and energy of both Euler methods."""
    columns: dict[str, Any] = {}
    for name in ("symplectic_euler", "implicit_euler"):
        run = fixed_step(ivp, name, H_FAST, T_FAST).complete()
        columns |= {"t": run.t, f"q3_{name}": run.q[:, 2], f"energy_{name}": ivp.along("H", run.p, run.q)}
    return pd.DataFrame(columns)


def facts(slow: ConstrainedIvp, fast: ConstrainedIvp) -> dict[str, Any]:
    """Return single numbers for the text."""
    broken = fixed_step(fast, "se", H_FAST, T_FAST)
    turned = constrained(initial_value_problem(PROBLEM, OTHER_FAST))
    other = swing(turned)
    coarse = fixed_step(slow, "se", H, T_END).complete()
    return {
        "se_stops": broken.failure is not None,
        "se_stops_at": float(broken.t[-1]),
        "other_swing": other,
        "periods": {ivp.case: period(ivp) for ivp in (fast, turned)},
        "se_slope_same_h": energy_drift(coarse.t, energy_error(slow, coarse)).slope,
    }


def period(ivp: ConstrainedIvp) -> float:
    """Return the exact time of one swing from an initial value problem's start."""
    p, q = ivp.p0, ivp.q0
    return swing_period(float(p @ p / 2 + q[2]), float(q[0] * p[1] - q[1] * p[0]))


ROUND_OFF = 1e-13
"""A defect, or a residual of a constraint, up to this is round-off."""


VISIBLE = 1e-9
"""A larger defect shows that a map is not symplectic."""


ORDER_BAND = 0.05


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


NAMES = {
    "se": "symplectic Euler on (1.18), se",
    "seproj": "se with projection, seproj",
    "symplectic_euler": "constrained symplectic Euler",
    "symplectic_euler_adjoint": "adjoint of constrained symplectic Euler",
    "implicit_euler": "constrained implicit Euler",
    "shake": "SHAKE",
    "rattle": "RATTLE",
}


STROKE = {name: stroke_of(name) for name in NAMES}


def draw_defects(defects: pd.DataFrame, folder: Path) -> Path:
    """Draw the symplecticity defect against the number of steps."""
    figure, axes = grid_of_axes(1, 1, 3.7)
    ax = axes[0, 0]
    ax.axhspan(1e-17, 1e-14, color="#eeeeee", zorder=0)
    ax.text(31, 1.3e-14, "round-off", ha="right", va="bottom", color=QUIET, fontsize=8)
    for name in sorted(SCHEMES, key=lambda name: -defects[name].iloc[-1]):
        ax.plot(defects["n"], defects[name].clip(lower=2e-17), label=NAMES[name], markevery=(0, 2), **STROKE[name].points())
    ax.annotate(
        "the first step of se\nis symplectic",
        (1, defects["se"][0]),
        (2.6, 3e-12),
        arrowprops={"arrowstyle": "->", "color": STROKE["se"].color, "shrinkB": 5},
        color=STROKE["se"].color,
    )
    ax.set(yscale="log", ylim=(1e-17, 1), xlim=(0, 31.5), xlabel="number of steps $n$", ylabel="symplecticity defect")
    figure.legend(loc="outside lower center", ncols=2)
    return save(figure, folder, "symplecticity", defects)


def yes_or_no(claim: bool) -> str:
    """Return a claim in a word."""
    return "yes" if claim else "no"


STRUCTURE: Columns = {
    "method": (code, "scheme"),
    "system": (lambda system: "(1.18)" if system == "ode" else "(1.9)", "applied to"),
    "claimed_order": "order<small>claimed</small>",
    "order_q": (Of(with_error, "order_q", "order_q_error"), "order in <i>q</i><small>measured</small>"),
    "claimed_symplectic": (yes_or_no, "symplectic<small>claimed</small>"),
    "symplecticity": (tiny, f"defect<small>{DEFECT_STEPS} steps</small>"),
    "claimed_symmetric": (yes_or_no, "symmetric<small>claimed</small>"),
    "reversibility": (tiny, "defect<small>1 step</small>"),
}
"""Order, two-form and symmetry of each scheme, claimed and measured."""

three = partial(number, digits=3)

COST: Columns = {
    "method": (code, "scheme"),
    "work_newton": (three, "Newton<small>iterations</small>"),
    "work_H_p": (three, "<i>H<sub>p</sub></i>"),
    "work_H_q": (three, "<i>H<sub>q</sub></i>"),
    "work_g": (three, "<i>g</i>"),
    "work_G": (three, "<i>G</i>"),
    "work_second": (three, "second<small>derivatives</small>"),
    "work_solve": (three, "linear<small>solves</small>"),
    "ns_per_step": (three, "time<small>ns</small>"),
}
"""The work of a step and its time."""

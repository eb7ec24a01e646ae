"""The motions of the report and its methods: long runs, and their errors of the energy, of the driver's energy and of the constraint."""

from typing import Any

import numpy as np
import pandas as pd

from daebench.diagnostics.energy import energy_drift
from daebench.diagnostics.energy_verdict import energy_error, energy_scales, energy_verdict, kinetic_energy
from daebench.diagnostics.integrals import integral_errors
from daebench.methods.initial_value_problem import initial_value_problem
from daebench.methods.names import parse
from daebench.runs.ivp import ConstrainedIvp
from daebench.runs.make_ivp import constrained
from daebench.runs.request import Request
from daebench.runs.trajectory import Trajectory

CONTACT, TRANSMISSION = "contact_oscillator", "variable_transmission"
INTEGRABLE, PERTURBED = "reversible, integrable", "reversible, not integrable"
IRREVERSIBLE, NEITHER = "integrable, not reversible", "neither"
SHIFTED = "shifted"
MOTIONS = {
    (CONTACT, "integrable"): INTEGRABLE,
    (CONTACT, "perturbed"): PERTURBED,
    (CONTACT, SHIFTED): IRREVERSIBLE,
    (TRANSMISSION, "swinging"): INTEGRABLE,
    (TRANSMISSION, "even"): INTEGRABLE,
    (TRANSMISSION, "coupled"): PERTURBED,
    (TRANSMISSION, "uneven"): IRREVERSIBLE,
    (TRANSMISSION, "uneven_coupled"): NEITHER,
}
"""Problems and cases, with the class of each."""

SYMMETRIC = ("dla", "nonholonomic_leapfrog", "spark_lobatto3")
"""Symmetric schemes that are made for constraints on velocities, without the one by Newmark's method."""

PAIR = "nonholonomic_newmark_pair"
SCHEMES = (*SYMMETRIC, PAIR, "gni", "nonholonomic_newmark", "gauss2+proj", "rk4+proj")
SOLVERS = ("ida:index2", "ida:index1")
METHODS = (*SCHEMES, *SOLVERS)

H, TOL, T_END, T_SOLVER, APART = 0.2, 1e-8, 1e5, 4e3, 0.4
"""Step, tolerance of IDA, ends of long runs of schemes and of IDA, and time between two states of them."""

SHOWN, BEGINNING = 160, 1000
"""Times that are drawn, and outputs over which the kinetic energy that errors are divided by is averaged."""
DRIVER, EPS = "driver", float(np.finfo(float).eps)


def ivp_of(problem: str, case: str) -> ConstrainedIvp:
    """Return the initial value problem of a motion."""
    shifted = ("integrable", {"momenta": 2}) if case == SHIFTED else (case,)
    return constrained(initial_value_problem(problem, *shifted))


def solved(ivp: ConstrainedIvp, method: str, value: float, t_end: float, apart: float = APART) -> Trajectory:
    """Return a run with a step or a tolerance, with states so far apart."""
    if method in SOLVERS:
        request = Request(value=value, t_end=t_end, points=round(t_end / apart) + 1, watch=())
    else:
        request = Request(value=value, t_end=t_end, every=max(1, round(apart / value)), watch=())
    run: Trajectory = parse(method).solve(ivp, request)
    return run


def long_run(problem: str, case: str, method: str) -> tuple[dict[str, Any], pd.DataFrame]:
    """Return the verdicts on a long run, and the largest energy error up to each of some times, over the kinetic energy."""
    ivp = ivp_of(problem, case)
    row: dict[str, Any] = {"problem": problem, "case": case, "class": MOTIONS[problem, case], "method": method}
    if refusal := parse(method).refusal(ivp):
        none = dict.fromkeys(("value", "size", "driver_size", "lost", "Gv", "steps", "seconds"), float("nan"))
        return row | none | {"verdict": "", "law": "", "driver": "", "failure": str(refusal)}, pd.DataFrame()
    value, t_end = (TOL, T_SOLVER) if method in SOLVERS else (H, T_END)
    run = solved(ivp, method, value, t_end)
    verdict, scales, error = energy_verdict(ivp, run), energy_scales(ivp, run), energy_error(ivp, run)
    # At the beginning, because some methods take all energy out or go to infinity.
    kinetic = float(np.mean(np.asarray(kinetic_energy(ivp, *(x[:BEGINNING] for x in run.vectors)))))
    driver = integral_errors(ivp, run)[DRIVER]
    resolution = float(scales.resolution(ivp.value("H", *ivp.start), EPS))
    of_driver = energy_drift(run.t, driver, resolution=resolution, scale=scales.most, steps=run.steps, eps=EPS, failure=run.failure or "")
    row |= {"value": value, "verdict": verdict.verdict, "law": verdict.law, "size": float(np.max(np.abs(error)) / kinetic)}
    row |= {"driver": of_driver.verdict, "driver_size": float(np.max(np.abs(driver)) / kinetic)}
    row |= {"lost": -float(error[-1] - driver[-1]) / driven(ivp), "Gv": float(np.max(np.abs(ivp.along("Gv", *run.vectors))))}
    row |= {"steps": run.steps, "seconds": run.seconds, "failure": run.failure or ""}
    chosen = np.unique(np.geomspace(1, len(run.t) - 1, SHOWN).astype(int))
    so_far = np.maximum.accumulate(np.abs(error)) / kinetic
    frame = pd.DataFrame({"problem": problem, "case": case, "method": method, "t": run.t[chosen], "size": so_far[chosen]})
    return row, frame


def driven(ivp: ConstrainedIvp) -> float:
    """Return the energy of x and z at the start, H without that of the driver, counted from their rest."""
    x, z = ivp.q0[0], ivp.q0[2]
    v = np.asarray(ivp.value("H_p", ivp.p0, ivp.q0), dtype=float)
    together = ivp.parameters.get("perturbation", ivp.parameters.get("coupling", 0.0))
    return float(v[0] ** 2 + v[2] ** 2 + x**2 + z**2 + together * (x * z) ** 2) / 2

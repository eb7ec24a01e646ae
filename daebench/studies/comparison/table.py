"""Several methods on one initial value problem, side by side in one table."""

from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd

from daebench.diagnostics.drift import Drift
from daebench.diagnostics.energy_verdict import energy_scales, size
from daebench.methods.initial_value_problem import initial_value_problem
from daebench.methods.names import Code, methods_of
from daebench.methods.solvers.drive import not_installed
from daebench.runs.ivp import Ivp
from daebench.runs.request import Request, resolution_value
from daebench.runs.trajectory import Outcome
from daebench.studies.comparison.position_error import position_errors
from daebench.studies.held_verdict import held_verdict

if TYPE_CHECKING:
    from daebench.systems.constrained import ConstrainedHamiltonian
    from daebench.systems.poisson import PoissonSystem

TOLERANCE = 1e-8
"""Default tolerance of tolerance-driven methods."""

MOST_STATES = 20000
"""States kept by a fixed-step method in a comparison, about."""


def compare(
    problem: "str | ConstrainedHamiltonian | PoissonSystem",
    *,
    methods: Sequence[Code],
    h: float | None = None,
    t_end: float,
    case: str | None = None,
    tol: float = TOLERANCE,
    parameters: Mapping[str, float] | None = None,
    options: Mapping[str, float] | None = None,
    project: bool = False,
    anyway: bool = False,
    on_singular: str | None = None,
) -> pd.DataFrame:
    """Return one row per method: errors of position, energy and conserved quantities, work and time, on one initial value problem.

    Parameters
    ----------
    problem : str, ConstrainedHamiltonian or PoissonSystem
        Name in the catalogue, the path of a problem file, which is executed, or a definition.
    methods : sequence of str or callable
        Names in the grammar of :mod:`daebench.methods.names`, or code from outside.
    h : float, optional
        Step size of the fixed-step methods, s.
    t_end : float
        End time, s.
    case : str, optional
        Named initial values; by default the problem's first.
    tol : float
        Tolerance of the tolerance-driven methods.
    parameters : mapping of str to float, optional
        Values of the problem's parameters.
    options : mapping of str to float, optional
        Free numbers of the methods; each is passed to the methods that have it.
    project : bool
        Whether the initial values of a constrained problem are first projected onto the manifold.
    anyway : bool
        Whether schemes may be run on a Poisson system outside of the class for which they are Poisson integrators.
    on_singular : str, optional
        What to do where G loses rank: one of :data:`daebench.runs.request.ON_SINGULAR`; by default what the case declares.

    Returns
    -------
    DataFrame
        Columns method, h or tol, steps, t_reached (s), energy_error (largest modulus over all steps), energy_size (the same
        over the mean kinetic energy; above 1 the motion is lost), energy_verdict, energy_law, energy_reason and energy_change_bound (see
        :class:`daebench.diagnostics.drift.Drift`), slope (per s); g and Gv, the largest distances from g = 0 and G H_p = 0, or the Casimir
        functions by name; seconds (CPU time of stepping), us_per_step (microseconds), counts of work n_H_p, n_H_q, ...; t_end, as
        requested; position_error, the largest error of a coordinate of q, or of y, at about 64 outputs; position_bound, the error bound of
        its reference; position_reference, its description: the certified reference if it fits, otherwise a closed form or a finer run;
        failure. A method that stopped early has a row with the reason in ``failure``.

    Raises
    ------
    BadInput
        If the request cannot be met.

    Examples
    --------
    >>> import daebench
    >>> table = daebench.compare("spherical_pendulum", case="fig1.1", methods=["seproj", "rattle"], h=0.03, t_end=10)
    >>> table[["method", "energy_error"]].round(6).values.tolist()
    [['seproj', 5.7e-05], ['rattle', 1e-06]]
    """
    ivp = initial_value_problem(problem, case, parameters, project=project, on_singular=on_singular)
    chosen = methods_of(ivp, methods, options, anyway=anyway)
    return table_of(ivp, chosen, trajectories(ivp, chosen, h=h, tol=tol, t_end=t_end), t_end)


def table_of(ivp: Ivp, methods: Sequence[Any], runs: Sequence[Any], t_end: float) -> pd.DataFrame:
    """Return one row a run of a comparison to ``t_end``, see :func:`compare`; where it was ended, there are fewer runs than methods."""
    begun = methods[: len(runs)]
    errors = position_errors(ivp, begun, runs)
    asked = (_request(ivp, method, run.value, run.value, t_end) for method, run in zip(begun, runs, strict=True))
    drifts = [held_verdict(ivp, method, request, run) for method, request, run in zip(begun, asked, runs, strict=True)]
    return pd.DataFrame(
        [
            {
                **{name: value for name, value in columns.items() if name != "failure"},
                "t_end": t_end,
                "position_error": error.value,
                "position_bound": error.bound,
                "position_reference": error.reference,
                "failure": columns["failure"],
            }
            for columns, error in ((row(ivp, run, drift), error) for run, drift, error in zip(runs, drifts, errors, strict=True))
        ]
    )


def trajectories(
    ivp: Ivp,
    methods: Sequence[Any],
    *,
    h: float | None,
    tol: float = TOLERANCE,
    t_end: float,
    began: Callable[[str], None] | None = None,
) -> list[Any]:
    """Return one trajectory a method, in order; all requests are checked before the first run, and an interruption ends all.

    The trajectory of a method whose package is not installed ends at the start.
    """
    missing = {method.name: sentence for method in methods if (sentence := not_installed(method.name))}
    for method in methods:
        resolution_value(method, h=h if method.knob == "h" else None, tol=tol if method.knob == "tol" else None)
        if method.name not in missing:
            method.check(ivp, _request(ivp, method, h, tol, t_end))
    runs: list[Any] = []
    for method in methods:
        if began:
            began(method.name)
        request = _request(ivp, method, h, tol, t_end)
        runs.append(_not_begun(ivp, method, request, missing[method.name]) if method.name in missing else method.solve(ivp, request))
        if runs[-1].interrupted:
            break
    return runs


def _not_begun(ivp: Ivp, method: Any, request: Request, failure: str) -> Any:
    """Return a run that has not begun, with its initial state and no numbers."""
    about: dict[str, Any] = {"problem": ivp.problem, "case": ivp.case, "parameters": dict(ivp.parameters), "failure": failure}
    about |= {"method": method.name, "knob": method.knob, "value": request.value, "t": np.zeros(1), "steps": 0, "seconds": float("nan")}
    about["maxima"] = {"energy": float("nan")}
    states = ivp.trajectory.parts(np.concatenate(ivp.start)[None])
    return ivp.trajectory(**states, ivp=ivp, **about)


def _request(ivp: Ivp, method: Any, h: float | None, tol: float, t_end: float) -> Request:
    watch = ivp.state.monitors
    if method.knob == "tol" or h is None:
        return Request(value=tol, t_end=t_end, watch=watch, keep_interrupted=True)
    every = max(1, int(t_end / h / MOST_STATES)) if h > 0 and np.isfinite(t_end / h) else 1
    return Request(value=h, t_end=t_end, every=every, watch=watch, keep_interrupted=True)


def row(ivp: Ivp, trajectory: Outcome, drift: Drift) -> dict[str, Any]:
    """Return the columns of a comparison for one run and the verdict on its energy.

    ``energy_error`` is the largest modulus, ``energy_size`` the same over the mean kinetic energy, the other columns of the energy and
    ``slope`` are those of :func:`daebench.studies.held_verdict.held_verdict`, ``g`` and ``Gv``, or the Casimir
    functions, and the first integrals are maxima, ``seconds`` is CPU time of stepping and ``us_per_step`` the same for one step, in
    microseconds.
    """
    maxima = dict(trajectory.maxima)
    error = maxima.pop("energy")
    return {
        "method": trajectory.method,
        trajectory.knob: trajectory.value,
        "steps": trajectory.steps,
        "t_reached": float(trajectory.t[-1]),
        "energy_error": error,
        "energy_size": size(error, energy_scales(ivp, trajectory)),
        "energy_verdict": drift.verdict,
        "energy_law": drift.words,
        "energy_reason": drift.reason,
        "energy_change_bound": drift.change_bound,
        "slope": drift.slope,
        **maxima,
        "seconds": trajectory.seconds,
        "us_per_step": 1e6 * trajectory.seconds / trajectory.steps if trajectory.steps else float("nan"),
        **{f"n_{kind}": count for kind, count in trajectory.work.items()},
        "failure": trajectory.failure,
    }

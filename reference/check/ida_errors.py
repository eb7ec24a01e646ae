"""Errors of IDA on a certified motion, for several tolerances, with its own error estimates."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from itertools import pairwise
from typing import Any

import numpy as np

from daebench.reference.check.recomputation import ida_names, solved
from daebench.reference.keep.record import EPS
from daebench.reference.make.certify import LOST, NotCertified
from daebench.runs.ivp import Array, Ivp
from daebench.runs.request import Request, WorkLimit

EXPONENTS = (10, 11, 12, 13, 14)
"""Tolerances 1e-10 ... 1e-14; the error estimate of each run uses the next one too."""

WORK_LIMIT = WorkLimit(calls=3_000_000, slow_calls=100_000, slow_part=1000)
"""Limit at which a run is given up, as its status then says."""

MARKS = (1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0)
"""Times, s, up to which errors are given besides the end."""

TIGHT, UNTIL, ESTIMATES = 2, 10.0, 3.0
"""Times, s, up to which IDA has to agree with the reference within three of its own estimates, at one of the tolerances from 1e-12 on."""

ROUNDINGS = 4.0
"""Error that rounding alone may cause over a time too short for a step, in units of the rounding of the largest position."""

Keep = Callable[[str, Callable[[], dict[str, Any]]], dict[str, Any]]


def ida_errors(ivp: Ivp, t: Array, reference: Mapping[str, Array], keep: Keep, until: float = np.inf) -> list[dict[str, Any]]:
    """Return one record for each formulation and tolerance: largest errors, own estimate |S(tol) - S(tol/10)|, work and status.

    The estimate is null if the run at a tenth of the tolerance stopped early; ``lost`` is the time at which the motion is lost,
    or null if it is not lost.

    Shapes: t (n,).
    """
    clear = int(np.searchsorted(t, min(until, UNTIL), "right"))
    return [record for name in ida_names(ivp) for record in _records(ivp, name, t, reference, keep, clear)]


def _records(ivp: Ivp, name: str, t: Array, reference: Mapping[str, Array], keep: Keep, clear: int) -> list[dict[str, Any]]:
    runs, lead = [], next(iter(reference))
    for exponent in (*EXPONENTS, EXPONENTS[-1] + 1):
        tol = float(f"1e-{exponent}")
        runs.append(keep(f"{name.replace(':', '-')}-{exponent}", lambda tol=tol: _run(ivp, name, tol, t)))  # type: ignore[misc]
    _require_agreement(ivp, runs[TIGHT:], t[:clear], reference, lead)
    return [_record(run, finer, t, reference, lead) for run, finer in pairwise(runs)]


def _require_agreement(ivp: Ivp, runs: Sequence[dict[str, Any]], t: Array, exact: Mapping[str, Array], lead: str) -> None:
    """Require that one of the tight runs agrees with the reference within its own estimate, or within rounding, for some time."""
    n, discrepancies, rounding = len(t), [], ROUNDINGS * EPS * float(np.abs(exact[lead]).max())
    for run, finer in pairwise(runs):
        error, estimate = (float(_distances(run, other, exact)[lead][:n].max()) for other in (exact, finer))
        discrepancies.append(f"{error:.1e} at tol = {run['tol']:g}, where it estimates {estimate:.1e}")
        if error <= ESTIMATES * estimate + rounding:
            return
    raise NotCertified(
        f"{ivp.problem}-{ivp.case} was not certified: up to t = {t[-1]:g} {runs[0]['method']} differs from the reference in {lead} by "
        f"{', '.join(discrepancies)}; find out which of the two is wrong.",
        "reference-disagrees-with-ida",
    )


def _record(run: dict[str, Any], finer: dict[str, Any], t: Array, exact: Mapping[str, Array], lead: str) -> dict[str, Any]:
    error, difference = _distances(run, exact, exact), _distances(run, finer, exact)
    whole = len(difference[lead]) == len(t)  # otherwise the finer run stopped, and there is no estimate
    lost = np.flatnonzero(error[lead] > LOST * np.abs(exact[lead]).max())
    return {
        "method": run["method"],
        "tol": run["tol"],
        "t_end": float(t[-1]),
        "t_reached": run["t_reached"],
        "error": {part: _short(values) for part, values in error.items()},
        "estimate": {part: _short(values) for part, values in difference.items()} if whole else None,
        f"error_{lead}_until": [[mark, _short(error[lead][t[: len(error[lead])] <= mark])] for mark in MARKS if mark <= run["t_reached"]],
        "lost": float(t[lost[0]]) if lost.size else None,
        "steps": run["steps"],
        "residuals": run["residuals"],
        "jacobians": run["jacobians"],
        "status": run["status"],
    }


def _run(ivp: Ivp, name: str, tol: float, t: Array) -> dict[str, Any]:
    run = solved(ivp, name, Request(value=tol, t_end=float(t[-1]), points=len(t), watch=(), work_limit=WORK_LIMIT))
    on_grid = int(np.sum(np.isin(run.t, t)))
    return {
        "method": run.method,
        "tol": tol,
        "t_reached": float(run.t[-1]),
        **{part: rows[:on_grid].tolist() for part, rows in run.states.items()},
        "steps": run.steps,
        "residuals": run.work["residual"],
        "jacobians": run.work["jacobian"],
        "status": run.failure or "reached the end",
    }


def _distances(one: Mapping[str, Any], other: Mapping[str, Any], parts: Iterable[str]) -> dict[str, Array]:
    """Return the largest modulus of the differences at each time that both runs reached, by part."""
    distances = {}
    for part in parts:
        a, b = np.array(one[part]), np.array(other[part])
        n = min(len(a), len(b))
        distances[part] = np.max(np.abs(a[:n] - b[:n]), axis=1)
    return distances


def _short(values: Array) -> float:
    return float(f"{values.max():.2g}")

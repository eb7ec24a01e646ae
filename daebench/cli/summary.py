"""Summary of a run: one mapping for text and for JSON, the same for both kinds of problems except for their states."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from daebench.cli.console import print_table, printable
from daebench.runs.ivp import Ivp
from daebench.runs.result import Table
from daebench.runs.state import CONSTRAINED
from daebench.runs.trajectory import PoissonTrajectory, Trajectory

MOST_NUMBERS = 12
"""Largest number of components of a state in a table; JSON and files have all."""


def summary_of(ivp: Ivp, trajectory: Trajectory | PoissonTrajectory, *, compensated: bool) -> dict[str, Any]:
    """Return the summary of a run; q, p and lam, or y, are those at its end.

    For a time-dependent system the energy is H, and its error the defect of the balance H - H0 = energy received.
    """
    state = _state(trajectory)
    energy, start = (float(ivp.value("H", *point)) for point in (state, ivp.start))
    maxima = dict(trajectory.maxima)
    energy_error = maxima.pop("energy", None)
    return {
        "problem": trajectory.problem,
        "case": trajectory.case,
        "parameters": dict(trajectory.parameters),
        "method": trajectory.method,
        "compensated": compensated or None,
        "h": trajectory.value if trajectory.knob == "h" else None,
        "tol": trajectory.value if trajectory.knob == "tol" else None,
        "steps": trajectory.steps,
        "t": float(trajectory.t[-1]),
        **(_mechanical(ivp, *state) if ivp.on_manifold else {"y": state[0]}),
        "sensitivities": {name: _by(ivp, name, by) for name, by in trajectory.sensitivities.items()} or None,
        "energy": energy - (float(state[0][-1]) if ivp.facts.KIND == "constrained" and ivp.facts.EXTENDED else 0.0),
        "energy_error": energy - start,
        "max_energy_error": energy_error,
        **_kept(ivp, maxima),
        "maxima_over": trajectory.maxima_over,
        "work": dict(trajectory.work),
        "seconds": trajectory.seconds,
        "compile_seconds": trajectory.compile_seconds,
        "callback_seconds": trajectory.callback_seconds,
        "callbacks": trajectory.callbacks,
        "failure": trajectory.failure,
    }


def _mechanical(ivp: Ivp, p: Any, q: Any) -> dict[str, Any]:
    """Return positions and momenta, for a time-dependent system the energy received, which is not an error, and lam if it is determined."""
    lam = ivp.value("lam", p, q)
    multipliers = {"lam": lam if np.isfinite(lam).all() else None}
    if not ivp.facts.EXTENDED:
        return {"q": q, "p": p} | multipliers
    return {"q": q[:-1], "p": p[:-1], "energy_received": float(-p[-1])} | multipliers


def _by(ivp: Ivp, name: str, by: Mapping[str, Any]) -> dict[str, Any]:
    """Return derivatives at the end by a parameter or an initial value; of a system in time without those of and by the time.

    The last momentum of such a system is what energy it has received, with the other sign, and its derivative is called so.
    """
    last = {part: rows[-1] for part, rows in by.items()}
    if ivp.facts.KIND != "constrained" or not ivp.facts.EXTENDED:
        return last
    q, p = (last[part][:, :-1] if name in CONSTRAINED.starts else last[part] for part in ("q", "p"))
    return {"q": q[:-1], "p": p[:-1], "energy_received": -p[-1:]}


def _state(trajectory: Trajectory | PoissonTrajectory) -> tuple[Any, ...]:
    """Return the state at the end as arguments of the problem's functions: (y,), or (p, q)."""
    return tuple(vector[-1] for vector in trajectory.vectors)


def _kept(ivp: Ivp, maxima: Mapping[str, float]) -> dict[str, Any]:
    """Return the largest errors of the quantities that the problem's structure conserves, and of its first integrals."""
    integrals = {name: maxima[name] for name in ivp.integrals if name in maxima}
    if not ivp.on_manifold:
        return {"casimirs": {name: maxima[name] for name in ivp.casimirs if name in maxima}, "integrals": integrals}
    return {"g": maxima.get("g"), "Gv": maxima.get("Gv"), "integrals": integrals}


def print_summary(summary: Mapping[str, Any]) -> None:
    """Print a summary as a table, without missing or empty entries, and below it the warnings."""
    shown = {name: value for name, value in summary.items() if name not in ("warnings", "sensitivities")}
    shown |= _derivatives(summary.get("sensitivities") or {})
    print_table(["", ""], [[name, text] for name, value in shown.items() if value is not None and (text := _text(value))])
    for warning in summary.get("warnings", ()):
        print(f"Warning: {warning}")


def _derivatives(sensitivities: Mapping[str, Mapping[str, Any]]) -> dict[str, Any]:
    """Return derivatives with respect to single numbers, for example dq/dgravity and dq/dq0_1."""
    shown: dict[str, Any] = {}
    for name, by in sensitivities.items():
        for part, values in by.items():
            columns = {name: values} if values.ndim == 1 else {f"{name}_{j + 1}": values[:, j] for j in range(values.shape[1])}
            shown |= {f"d{part}/d{number}": column for number, column in columns.items()}
    return shown


def _text(value: Any) -> str:
    if isinstance(value, dict):
        return ", ".join(f"{name} {_text(item)}" for name, item in value.items())
    if hasattr(value, "tolist"):
        shown = ", ".join(f"{x:.15g}" for x in value[:MOST_NUMBERS].tolist())
        return shown if len(value) <= MOST_NUMBERS else f"{shown}, ... ({len(value)} numbers; --json and --out have all)"
    return f"{value:.9g}" if isinstance(value, float) else str(value)


def print_part(part: str | Table | Mapping[str, Any]) -> None:
    """Print a part of a result: a sentence, a table, or a mapping, of which each name is a line."""
    if isinstance(part, Table):
        print_table(part.columns, part.rows, part.title, width=part.width)
    elif isinstance(part, str):
        print(printable(part))
    else:
        print_summary(part)

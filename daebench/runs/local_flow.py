"""Maps into and out of the coordinates of a chart, (eta, xi) or canonical, and flows and the structure matrix B(y) in them."""

import types
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from daebench.errors import BadInput
from daebench.runs.ivp import ConstrainedIvp

State = tuple[Any, Any]
Map = Callable[[Any, Any], State]


def functions(ivp: ConstrainedIvp, form: str = "local") -> types.ModuleType:
    """Return the module of ``chart``, ``inverse_chart`` and, of the form local, ``two_form``, uncompiled, as functions of tuples."""
    if not ivp.facts.CHART:
        raise BadInput(f"{ivp.problem} declares no chart of its manifold; add one to its definition.", "problem-without-chart")

    roots = ("chart", "inverse_chart", *["two_form"] * (form == "local"))
    return ivp.source.linked("chart", f"Chart of {ivp.problem}.", roots, form=form, compiled=False)


def enter(ivp: ConstrainedIvp, form: str = "local") -> Map:
    """Return the map (p, q) -> (eta, xi), or (P, xi), of an initial value problem; :class:`BadInput` if the chart is singular."""
    inverse, par = functions(ivp, form).inverse_chart, _numbers(ivp.par)

    def into(p: Any, q: Any) -> State:
        try:
            with np.errstate(all="ignore"):
                eta, xi = inverse(_numbers(p), _numbers(q), par)
        # Integers and Python's own numbers raise where NumPy's give infinity.
        except ZeroDivisionError:
            eta, xi = (np.nan,), (np.nan,)
        if not np.all(np.isfinite([*eta, *xi])):
            raise BadInput(
                f"the chart of {ivp.problem} is singular at q = {np.real(q).tolist()}; start elsewhere, or leave out {form}:.",
                "chart-singular-at-start",
            )
        return eta, xi

    return into


def leave(ivp: ConstrainedIvp, form: str = "local") -> Map:
    """Return the map chi: (eta, xi) -> (p, q), or (P, xi) -> (p, q), of an initial value problem."""
    chi, par = functions(ivp, form).chart, _numbers(ivp.par)
    return lambda eta, xi: chi(_numbers(eta), _numbers(xi), par)


def _numbers(x: Any) -> tuple[Any, ...]:
    return tuple(np.complex128(a) if np.iscomplexobj(a) else np.float64(a) for a in x)


def local_flow(flow: Map, ivp: ConstrainedIvp) -> Callable[[NDArray[Any]], NDArray[Any]]:
    """Return a map of states, such as ``FixedStep.flow``, as a map y -> y, shape(2 (d - m),), exact to first order in imaginary parts."""
    into, out = enter(ivp), leave(ivp)

    def phi(y: NDArray[Any]) -> NDArray[Any]:
        eta, xi = np.split(np.asarray(y), 2)
        return np.concatenate([np.asarray(part) for part in into(*flow(*out(eta, xi)))])

    return phi


def structure_matrix(ivp: ConstrainedIvp) -> Callable[[NDArray[np.float64]], NDArray[np.float64]]:
    """Return y -> B(y) = (X^T J X)^-1 with X = chi'(y), HLW (2.21)."""
    form, par = functions(ivp).two_form, tuple(map(np.float64, ivp.par))

    def B(y: NDArray[np.float64]) -> NDArray[np.float64]:
        eta, xi = np.split(np.asarray(y), 2)
        # Inverted, because B itself is asked for; flows solve with the two-form instead.
        return np.linalg.inv(np.array(form(_numbers(eta), _numbers(xi), par), dtype=float))

    return B

"""Numerical checks of the declarations of a problem against its equations: integrals, closed form, kinetic flow, chart.

Each check is made at the start and at points of the manifold around it, see ``nearby``, and returns a sentence on what is wrong, or "".
"""

from collections.abc import Callable
from typing import Any

import numpy as np

from daebench.diagnostics.nearby import (
    differs,
    exact_start,
    field,
    flat,
    numeric,
    off_manifold,
    points,
    rates,
    slow_time,
    text,
    without_potential,
)
from daebench.errors import BadInput, in_words
from daebench.runs.ivp import Array, ConstrainedIvp, Ivp
from daebench.systems.files.execute import telling_exits
from daebench.systems.lazily import mpmath as mp
from daebench.systems.lazily import sympy as sp

CLOSE = 1e-7
"""Largest relative difference that rounding may make."""

ROUGH = 1e-5
"""Largest relative error of a numerical derivative in double precision."""


def integrals(ivp: ConstrainedIvp) -> str:
    """Hold I_p p' + I_q q' = 0 along (1.18) against each first integral."""
    problem = ivp.source.derivation.problem
    x = [*problem.p, *problem.q]
    slopes = numeric(ivp, [[sp.sympify(integral).diff(symbol) for symbol in x] for integral in problem.integrals.values()])
    seen = 0
    for p, q in points(ivp):
        seen += 1
        rate = np.concatenate(rates(ivp, p, q))
        for name, slope in zip(problem.integrals, np.array(slopes(p, q), dtype=float), strict=True):
            # Relative to the moduli of its terms, so that the rounding of terms that cancel is no violation.
            change, scale = float(slope @ rate), float(np.abs(slope) @ np.abs(rate))
            if not abs(change) <= CLOSE * scale:
                where = f"its derivative along the motion is {change:.3g} at q = {text(q)}, p = {text(p)}, and not 0"
                return f"{ivp.problem}: {name} is not a first integral: {where}; correct it, or leave it out."
    return "" if seen else _nowhere(ivp, "first integrals")


def closed_form(ivp: Ivp) -> str:
    """Hold the closed form against the initial values at time 0, and against the equations of motion there and 1 s later."""
    where = f"{ivp.problem}, case {ivp.case!r}: closed_form"
    # 40 digits: the difference below loses half of them, and what is left is more than double precision.
    with mp.workdps(40):
        start, values = exact_start(ivp)
        given = ivp.source.derivation.problem.closed_form
        form = _guarded(where, lambda t: [mp.mpf(x) for x in flat(ivp, given(t, *start, values))])
        begin, first = flat(ivp, start), form(mp.mpf(0))
        if len(first) != ivp.size:
            return f"{where} returns {len(first)} numbers, and a state has {ivp.size}; correct it."
        off = max(abs(a - b) for a, b in zip(first, begin, strict=True))
        if not off <= mp.mpf("1e-25") * (max(map(abs, begin)) or 1):
            return f"{where} is off the initial values at t = 0 by {mp.nstr(off, 3)}; correct it."
        for t in (mp.mpf(0), mp.mpf(1)):
            miss = differs(_rate(form, t), field(ivp, np.array([float(x) for x in form(t)])))
            if not miss <= CLOSE:
                return f"{where} misses the equations of motion by {miss:.3g} of their size at t = {float(t):g} s; correct it."
    return ""


def _rate(form: Callable[[Any], list[Any]], t: Any) -> Array:
    """Return the derivative of a motion, by a difference that loses half of mpmath's digits."""
    step = mp.mpf("1e-12")
    return np.array([float((b - a) / (2 * step)) for a, b in zip(form(t - step), form(t + step), strict=True)])


def kinetic_flow(ivp: ConstrainedIvp) -> str:
    """Hold the kinetic flow against the identity at time 0, the equations of motion without U, and the manifold."""
    flow = ivp.source.derivation.problem.kinetic_flow
    if ivp.source.derivation.problem.M is None:
        return f"{ivp.problem}: a kinetic flow needs M and U in place of H; give them, or leave it out."
    after = numeric(ivp, [list(flow.p), list(flow.q)], flow.t)
    seen = 0
    for p, q in points(ivp):
        seen += 1
        if fault := _flow(ivp, after, p, q):
            return f"{ivp.problem}: the kinetic flow {fault}; correct it."
    return "" if seen else _nowhere(ivp, "kinetic flow")


def _flow(ivp: ConstrainedIvp, after: Callable[..., Any], p: Array, q: Array) -> str:
    """Return the error of a flow from a state, or ""."""

    def at(time: float, x: Array) -> Array:
        return np.concatenate(np.array(after(x[: ivp.d], x[ivp.d :], time), dtype=float))

    x, t = np.concatenate([p, q]), slow_time(p, q, *rates(ivp, p, q))
    if not (off := differs(at(0.0, x), x)) <= CLOSE:
        return f"over time 0 moves the state by {off:.3g} of its size"
    h = t / 100
    # Fourth order, so that a step of a hundredth is accurate to 1e-8 without the rounding of a smaller one.
    rate = (8 * (at(h, x) - at(-h, x)) - (at(2 * h, x) - at(-2 * h, x))) / (12 * h)
    if not (off := without_potential(ivp, p, q, rate)) <= ROUGH:
        return f"misses p' = -T_q - G^T lam, q' = H_p by {off:.3g} of their size"
    end = at(t, x)
    if not (off := off_manifold(ivp, end[: ivp.d], end[ivp.d :])) <= CLOSE:
        return f"leaves the manifold, by {off:.3g} of the motion"
    # A flow has to be a group: this finds a formula that is right to first order in t only.
    if not (off := differs(at(t, end), at(2 * t, x))) <= CLOSE:
        return f"over a time twice is not that over twice the time, by {off:.3g} of the state's size"
    return ""


def chart(ivp: ConstrainedIvp) -> str:
    """Hold chi(y) = x against the state x, where y are the local coordinates of x."""
    declared_chart = ivp.source.derivation.problem.chart
    back = numeric(ivp, [*declared_chart.inverse_eta, *declared_chart.inverse_xi])
    forth = numeric(ivp, [list(declared_chart.p), list(declared_chart.q)], *declared_chart.eta, *declared_chart.xi)
    seen = 0
    for p, q in points(ivp):
        x = np.array(forth(p, q, *np.array(back(p, q), dtype=float)), dtype=float)
        # Charts may be singular at single states; the others decide.
        if not np.all(np.isfinite(x)):
            continue
        seen += 1
        if not (off := differs(x.ravel(), np.concatenate([p, q]))) <= CLOSE:
            where = f"there and back misses q = {text(q)}, p = {text(p)} by {off:.3g} of the state's size"
            return f"{ivp.problem}: the chart and its inverse do not undo each other: {where}; correct one of them."
    return "" if seen else f"{ivp.problem}: the chart has no finite values around the start of case {ivp.case!r}; correct it."


def _nowhere(ivp: ConstrainedIvp, what: str) -> str:
    """Return the sentence for a declaration of which nothing can be said."""
    why = f"the {what} cannot be checked around the start of case {ivp.case!r}, where no state is consistent and has finite rates"
    return f"{ivp.problem}: {why}; correct the case."


def _guarded(where: str, form: Callable[[Any], list[Any]]) -> Callable[[Any], list[Any]]:
    """Return a function of the problem's own whose exceptions are sentences."""

    def call(t: Any) -> list[Any]:
        try:
            with telling_exits():
                return form(t)
        except (Exception, SystemExit) as error:
            raise BadInput(f"{where} raises {in_words(error)}; correct it, or leave it out.", "declared-function-raises") from error

    return call

"""Extended phase space: a system that depends on time, or has forces without a potential, as a system of constant energy.

The time becomes the last position and its conjugate, p_t, the last momentum::

    K = H(p, q, t) + p_t       t' = K_{p_t} = 1       p_t' = -H_t - g_t^T lam - F.v       g(q, t) = 0,     G v + g_t = 0

K is constant along every motion: -p_t is the energy that the time in H, the drivers g(q, t) and the forces F have added to the system
since the start, where it is 0. Without F the extended system is Hamiltonian, and a symplectic scheme is symplectic on it. H
equals K - p_t. The error of K is the defect of the balance H - H0 = work, for any F.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any

import sympy as sp

from daebench.systems.constrained import Chart, ConstrainedHamiltonian, KineticFlow


def extended(problem: ConstrainedHamiltonian) -> ConstrainedHamiltonian:
    """Return a problem in time as a record with t and p_t among its coordinates, shape(d + 1,), without its forces.

    M has a 1 in the row of the time, which has no mass; :mod:`daebench.compiler.constrained.extended` takes account of
    this. A problem whose forces do not depend on time also gets a time.
    """
    t, p_t = time_symbols(problem)
    return replace(
        problem,
        q=(*problem.q, t),
        p=(*problem.p, p_t),
        H=None if problem.H is None else sp.sympify(problem.H) + p_t,
        # A 1 and not 0, so that M stays regular wherever it is inverted.
        M=None if problem.M is None else sp.diag(problem.M, 1),
        t=None,
        force=None,
        **_velocities(problem),
        cases={name: replace(case, q=(*case.q, 0), p=(*case.p, 0)) for name, case in problem.cases.items()},
        closed_form=None if problem.closed_form is None else _closed_form(problem),
        kinetic_flow=None if problem.kinetic_flow is None else _kinetic_flow(problem.kinetic_flow, t, p_t),
        chart=None if problem.chart is None else _chart(problem.chart, t, p_t),
    )


def _velocities(problem: ConstrainedHamiltonian) -> dict[str, Any]:
    """Return the constraints on velocities with their terms a(q, t) as factors of the rate of the time, which is 1."""
    if not problem.velocity:
        return {"v": None}
    rate = sp.Dummy("rate_of_time", real=True)
    rows = [row + a * (rate - 1) for row, a in zip(problem.velocity, problem.prescribed, strict=True)]
    return {"v": (*(problem.v or ()), rate), "velocity": rows}


def time_symbols(problem: ConstrainedHamiltonian) -> tuple[sp.Symbol, sp.Symbol]:
    """Return the symbols of the time and of its conjugate, with names that are not in use."""
    taken = {str(symbol) for symbol in [*problem.q, *problem.p, *(problem.v or ()), *problem.parameters]}
    names = [next(name for name in (stem, f"{stem}_", f"{stem}__") if name not in taken) for stem in ("t", "p_t")]
    return (problem.t or sp.Symbol(names[0], real=True)), sp.Symbol(names[1], real=True)


def force(problem: ConstrainedHamiltonian, p: Sequence[sp.Expr], velocity: Sequence[sp.Expr]) -> sp.Matrix:
    """Return (F, -F.v) at given momenta and velocities, shape(d + 1,): the terms of p' and p_t' besides derivatives of H."""
    values = dict(zip([*problem.p, *(problem.v or ())], [*p[: problem.d], *velocity[: problem.d if problem.v else 0]], strict=True))
    F = [sp.sympify(entry).xreplace(values) for entry in problem.force or [0] * problem.d]
    return sp.Matrix([*F, -sp.Add(*(F[k] * velocity[k] for k in range(problem.d)))])


def _closed_form(problem: ConstrainedHamiltonian) -> Callable[..., Any]:
    """Return the closed form with the time after the positions, and with the p_t of constant K after the momenta."""
    given, d = problem.closed_form, problem.d
    assert given is not None

    def closed_form(t: Any, q0: Sequence[Any], p0: Sequence[Any], parameters: Mapping[str, Any]) -> tuple[list[Any], list[Any]]:
        q, p = given(t, q0[:d], p0[:d], parameters)
        H = energy(problem)
        values = list(parameters.values())
        # p_t follows from the energy: K = H + p_t is constant, whatever the forces.
        received = H(*q, *p, q0[d] + t, *values) - H(*q0[:d], *p0[:d], q0[d], *values)
        return [*q, q0[d] + t], [*p, p0[d] - received]

    return closed_form


def energy(problem: ConstrainedHamiltonian) -> Callable[..., Any]:
    """Return H as a function of q, p, t and the parameters, one number each, in mpmath's arithmetic."""
    t, _ = time_symbols(problem)
    function: Callable[..., Any] = sp.lambdify([*problem.q, *problem.p, t, *problem.parameters], hamiltonian(problem), "mpmath")
    return function


def hamiltonian(problem: ConstrainedHamiltonian) -> sp.Expr:
    """Return H(p, q, t) as an expression, for a declared problem; if M is given it is inverted symbolically."""
    if problem.H is not None:
        return sp.sympify(problem.H)
    p = sp.Matrix(list(problem.p))
    return (p.T * sp.Matrix(problem.M).LUsolve(p))[0] / 2 + sp.sympify(problem.U)


def _kinetic_flow(flow: KineticFlow, t: sp.Symbol, p_t: sp.Symbol) -> KineticFlow:
    """Return the flow of the kinetic energy and of p_t, in which the time advances; g must not depend on time."""
    return replace(flow, p=(*flow.p, p_t), q=(*flow.q, t + flow.t))


def _chart(chart: Chart, t: sp.Symbol, p_t: sp.Symbol) -> Chart:
    """Return the chart with time and p_t among the local coordinates."""
    # Symbols of their own: local coordinates must not be positions or momenta of the problem.
    tau, p_tau = sp.Symbol(f"{t}_local", real=True), sp.Symbol(f"{p_t}_local", real=True)
    at_tau = {t: tau}
    return Chart(
        eta=(*chart.eta, p_tau),
        xi=(*chart.xi, tau),
        p=(*(sp.sympify(x).subs(at_tau) for x in chart.p), p_tau),
        q=(*(sp.sympify(x).subs(at_tau) for x in chart.q), tau),
        inverse_eta=(*chart.inverse_eta, p_t),
        inverse_xi=(*chart.inverse_xi, t),
    )

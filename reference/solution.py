"""The reference solution that errors are measured against, the closed form, otherwise two runs of DOP853; or a certified reference."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from daebench.diagnostics.energy_verdict import kinetic_energy
from daebench.errors import BadInput, DaebenchError, RunFailed, in_words
from daebench.methods.formulations.constrained import Dae, Posed
from daebench.methods.formulations.poisson import pose_poisson
from daebench.methods.initial_value_problem import initial_value_problem
from daebench.methods.solvers.least_squares import reduced
from daebench.reference.keep import store
from daebench.reference.keep.record import Reference
from daebench.runs.ivp import Array, ConstrainedIvp, InitialValueProblem, Ivp
from daebench.runs.scales import constrained_scales, poisson_scales
from daebench.systems.files.execute import telling_exits
from daebench.systems.lazily import mpmath, scipy

DIGITS = 20
"""Decimal digits of the closed form; double precision needs 16."""

TIGHT, LOOSE = 2.5e-14, 1e-13
"""Tolerances, relative and absolute in units of the motion, of the run that is used, slightly above SciPy's smallest, and of a second run
for the error estimate."""

SAFETY = 10.0
"""Ratio of the bound to the difference between the two runs."""

EPS = float(np.finfo(float).eps)


@dataclass(frozen=True)
class ReferenceSolution:
    """States of the exact motion, with error bounds."""

    kind: str
    """"closed form" or "DOP853"."""
    t: Array
    """Times, s, ascending; shape (n,)."""
    states: Mapping[str, Array]
    """"q", "p" and the multipliers "lam"(p, q) of HLW (1.12), or "y" of a Poisson system; shape (n, components)."""
    bound: Mapping[str, float]
    """Bound of the Euclidean norm of the error of each of them at any of the times."""


def reference_solution(ivp: InitialValueProblem, times: ArrayLike, calls: float = np.inf) -> ReferenceSolution:
    """Return the motion from the problem's own initial values, rounded as every method gets them.

    A closed form is evaluated in mpmath numbers and rounded once; its bound is the rounding of the largest state. Without one, or where it
    has no values for these parameters, the index-reduced ODE, HLW (1.18), or a Poisson system itself, is integrated by SciPy's DOP853 at
    2.5e-14 from time to time, without interpolation; multipliers of redundant constraints are those of least norm where the case says so.
    The bound is then 10 times the difference from a run at 1e-13, or that rounding if it is larger.

    Shapes: times (n,).
    """
    known = _by_closed_form(ivp, times) if ivp.facts.CLOSED_FORM else None
    return integrated(ivp, times, calls) if known is None else known


def _by_closed_form(ivp: InitialValueProblem, times: ArrayLike) -> ReferenceSolution | None:
    """Return the motion by the closed form; None where it has no values, as with a gravity of 0 in whose units it computes."""
    try:
        with telling_exits():
            solution = _evaluated_once(ivp, times)
    except (ArithmeticError, ValueError, TypeError):
        return None
    except DaebenchError:
        raise
    except (Exception, SystemExit) as error:
        raise BadInput(
            f"{ivp.problem}: closed_form raises {in_words(error)}; correct it, or leave it out.", "closed-form-raises"
        ) from error
    return solution if all(np.isfinite(rows).all() for rows in solution.states.values()) else None


def _evaluated_once(ivp: Any, times: ArrayLike) -> ReferenceSolution:
    closed_form, states = ivp.source.derivation.problem.closed_form, {}
    if ivp.on_manifold:
        q, p = evaluated(closed_form, times, ivp.q0, ivp.p0, ivp.parameters)
        states = {"q": q, "p": p, **_multipliers(ivp, p, q)}
    else:
        rows = exactly(closed_form, times, ivp.start, ivp.parameters)
        states = {"y": np.array([[float(x) for x in row] for row in rows])}
    return ReferenceSolution("closed form", np.asarray(times, dtype=float), states, {name: rounding(rows) for name, rows in states.items()})


def evaluated(
    closed_form: Callable[..., Any], times: ArrayLike, q0: Array | Sequence[Any], p0: Array | Sequence[Any], parameters: Mapping[str, Any]
) -> tuple[Array, Array]:
    """Return q and p of a closed form at these times, shape(n, d), evaluated with 20 digits and rounded once at the end."""
    states = exactly(closed_form, times, (q0, p0), parameters)
    q, p = (np.array([[float(x) for x in state[k]] for state in states]) for k in (0, 1))
    return q, p


def exactly(
    closed_form: Callable[..., Any], times: ArrayLike, start: Sequence[Array | Sequence[Any]], parameters: Mapping[str, Any]
) -> list[Any]:
    """Return the values of a closed form at these times in mpmath numbers of 20 digits, from vectors ``start`` taken as exact."""
    with mpmath.workdps(DIGITS):
        initial = [[mpmath.mpmathify(x) for x in np.asarray(part).tolist()] for part in start]
        values = {name: mpmath.mpmathify(value) for name, value in parameters.items()}
        return [closed_form(mpmath.mpf(float(t)), *initial, values) for t in np.asarray(times, dtype=float)]


def integrated(ivp: InitialValueProblem, times: ArrayLike, calls: float = np.inf) -> ReferenceSolution:
    """Return the motion by two runs of DOP853, see :func:`reference_solution`.

    Shapes: times (n,).
    """
    posed, t = _ode(ivp), np.asarray(times, dtype=float)
    tight, loose = (_states(posed, advanced(posed, times, tol, calls)) for tol in (TIGHT, LOOSE))
    for time, y in zip(t, tight.get("y", ()), strict=False):
        if left := posed.outside(y):
            where = f"the reference solution of {ivp.problem}, case {ivp.case}, has left {left} at t = {time:.9g}"
            raise RunFailed(f"{where}; choose a shorter end time.", "reference-leaves-domain")
    return ReferenceSolution("DOP853", t, tight, {name: bound_of(tight[name], loose[name]) for name in tight})


def _ode(ivp: Any) -> Posed:
    """Return the ODE of a problem: the index-reduced one, HLW (1.18), or a Poisson system itself; a long chain has none."""
    if ivp.on_manifold and ivp.arrays:
        raise RunFailed(
            f"the index-reduced equation of {ivp.problem} is not available for so many nodes; take fewer nodes, or finer runs of a method.",
            "index-reduced-unavailable",
        )
    return reduced(ivp) if ivp.on_manifold else pose_poisson(ivp, "ode")


def bound_of(tight: Array, loose: Array) -> float:
    """Return an error bound of states, from two runs, each shape(n, k)."""
    return max(SAFETY * float(np.max(np.linalg.norm(tight - loose, axis=1))), rounding(tight))


def multipliers_between(ivp: ConstrainedIvp, known: ReferenceSolution, times: ArrayLike) -> tuple[Array, float]:
    """Return lam(p, q) at the start, at known times and between them, shape(n, m), with a bound of its error.

    Times in between are reached by DOP853 from the last known state before them.
    """
    wanted, starts = np.asarray(times, dtype=float), np.concatenate([[0.0], known.t])
    p, q = (np.concatenate([[x0], known.states[name]]) for x0, name in ((ivp.p0, "p"), (ivp.q0, "q")))
    last = np.searchsorted(starts, wanted, side="right") - 1
    lam, bound = _multipliers(ivp, p, q)["lam"][last], known.bound["lam"]
    between = wanted > starts[last]
    for k in np.unique(last[between]):
        here = between & (last == k)
        after, places = np.unique(wanted[here] - starts[k], return_inverse=True)
        solution = integrated(replace(ivp, p0=p[k], q0=q[k]), after)
        lam[here] = solution.states["lam"][places]
        bound = max(bound, solution.bound["lam"])
    return lam, bound


def reach(ivp: InitialValueProblem, steps: int) -> float:
    """Return the time that DOP853 at 1e-13 reaches in this many steps, or at which it stops: a scale for the length of a run."""
    solver = _solver(_ode(ivp), 0.0, np.inf, LOOSE)
    with np.errstate(all="ignore"):
        for _ in range(steps):
            if solver.status != "running" or solver.step() is not None:
                break
    return float(solver.t)


def _states(posed: Posed, rows: Array) -> dict[str, Array]:
    """Return q, p and lam, or y, from rows of unknowns of an ODE."""
    if not isinstance(posed, Dae):
        return {"y": rows}
    q, v = posed.unpack(rows)
    p = posed.momenta(q, v)
    return {"q": q, "p": p, **_multipliers(posed.ivp, p, q)}


def advanced(posed: Posed, times: ArrayLike, tol: float, calls: float = np.inf) -> Array:
    """Return the unknowns of an ODE by DOP853, shape(len(times), n), at times in the order they are reached, each the end of a step."""
    Y, t = [posed.y0], 0.0
    # DOP853's interpolation is of a lower order than its steps, so that each output ends a step.
    for t_next in np.asarray(times, dtype=float):
        y, steps = _advanced(posed, t, float(t_next), Y[-1], tol, calls)
        Y.append(y)
        t, calls = float(t_next), calls - steps
    return np.array(Y[1:])


def _advanced(dae: Posed, t: float, t_end: float, y: Array, tol: float, calls: float) -> tuple[Array, int]:
    """Return the unknowns at the end, and the number of calls of the right side."""
    if t_end == t:
        return y, 0
    solver = _solver(dae, t, t_end, tol, y)
    with np.errstate(all="ignore"):
        while solver.status == "running":
            message = solver.step()
            if solver.nfev > calls:
                where = f"{dae.ivp.problem}, case {dae.ivp.case}, at t = {solver.t:.9g} of {t_end:g}"
                raise RunFailed(
                    f"the reference solution of {where} has used up its calls of the right side; choose a shorter end time.",
                    "reference-calls-used-up",
                )
    if solver.status == "failed" or not np.all(np.isfinite(solver.y)):
        where = f"the reference solution of {dae.ivp.problem}, case {dae.ivp.case}, stopped at t = {solver.t:.9g} of {t_end:g}"
        why = str(message or "a value is no longer finite").rstrip(".")
        raise RunFailed(f"{where} (DOP853, tolerance {tol:g}): {why}; choose a shorter end time.", "reference-solution-stopped")
    return np.asarray(solver.y, dtype=float), solver.nfev


def _solver(dae: Posed, t: float, t_end: float, tol: float, y: Array | None = None) -> Any:

    def right_side(_: float, y: Array) -> Array:
        out = np.empty(dae.n)
        dae.rhs(0.0, np.array(y), out, dae.par)
        return out

    with np.errstate(all="ignore"):
        return scipy.integrate.DOP853(right_side, t, dae.y0 if y is None else y, t_end, rtol=tol, atol=tol * _sizes(dae))  # type: ignore[arg-type]


def _sizes(dae: Posed) -> Array:
    """Return the sizes that absolute tolerances of the unknowns are relative to, shape(n,).

    These are the length of the problem and its speed, or its momentum |H_q| T if momenta are the unknowns; or the largest y.
    """
    ivp = dae.ivp
    sizes = np.ones(dae.n)
    if not ivp.on_manifold:
        sizes[:] = poisson_scales(ivp, 0.0)[0]
    elif isinstance(dae, Dae):
        length, rate = constrained_scales(ivp, 0.0, rated=True)
        impulse = float(np.max(np.abs(ivp.value("H_q", ivp.p0, ivp.q0)))) / rate if rate > 0 else 0.0
        momentum = max(float(np.max(np.abs(ivp.p0))), impulse)
        sizes = np.repeat([length, length * rate if dae.mechanical else momentum], dae.n // 2)
    return np.where(sizes > 0, sizes, 1.0)


def _multipliers(ivp: ConstrainedIvp, p: Array, q: Array) -> dict[str, Array]:
    """Return the multipliers by name, none where there are no constraints."""
    if not ivp.m:
        return {}
    lam = ivp.along("lam", p, q)
    if not np.all(np.isfinite(lam)):
        raise RunFailed(
            f"the multiplier of {ivp.problem}, case {ivp.case}, is not finite along the motion, so that it has no reference; "
            "choose a shorter end time or another case.",
            "reference-multiplier-infinite",
        )
    return {"lam": lam}


def rounding(rows: Array) -> float:
    """Return the rounding of the largest of some states, shape(n, k), in the Euclidean norm."""
    return EPS * float(np.max(np.linalg.norm(rows, axis=1)))


CALLS = 400_000
"""Largest number of calls of the right side in each of the two runs of DOP853: some seconds."""

CONSERVED = 1e-6
"""Energy error of a finer run, as a fraction of its largest energy, above which it has missed an event such as a collision."""


@dataclass(frozen=True)
class OwnRun:
    """A run that is finer than the runs compared with it, and is not certified."""

    words: str
    """Description of the run."""
    t: Array
    """Times, s; shape (n,)."""
    states: Mapping[str, Array]
    """"q", "p" and "lam", or "y"; shape (n, components)."""
    bound: Mapping[str, Array]
    """Largest error of each number, of the same shapes."""


def certified_for(ivp: Ivp, end: float) -> Reference | None:
    """Return the certified reference with this definition, case, start and parameters, up to this time; None if there is none."""
    try:
        reference = store.find(ivp.problem, ivp.case)
        catalogue_ivp = initial_value_problem(ivp.problem, ivp.case)
    except BadInput:
        return None
    return reference if _same(ivp, catalogue_ivp) and reference.parameters == dict(ivp.parameters) and end <= reference.horizon else None


def _same(ivp: Ivp, other: Ivp) -> bool:
    """Return whether two initial value problems have the same equations, parameters and start, exactly."""
    starts = len(ivp.start) == len(other.start) and all(map(np.array_equal, ivp.start, other.start))
    return ivp.source.key == other.source.key and ivp.par == other.par and starts


def own_run(ivp: Ivp, times: ArrayLike, calls: float = CALLS) -> OwnRun:
    """Return the motion at these times, with its error bound, see :func:`daebench.reference.solution.reference_solution`.

    Shapes: times (n,).
    """
    t = np.asarray(times, dtype=float)
    exact = reference_solution(ivp, t, calls)
    kind, states, bound = exact.kind, exact.states, exact.bound
    vectors = [states[name] for name in ivp.state.vectors]
    energy = ivp.along("H", *vectors)
    start = float(ivp.value("H", *ivp.start))
    if not np.max(np.abs(energy - start)) <= CONSERVED * _energy_size(ivp, vectors, start):
        raise RunFailed(
            f"a finer run of {ivp.problem}, case {ivp.case}, does not conserve the energy; choose a shorter end time.",
            "finer-run-loses-energy",
        )
    words = kind if kind == "closed form" else f"own finer run ({kind}, tol {TIGHT:g})"
    return OwnRun(words, t, states, {part: np.full(rows.shape, bound[part]) for part, rows in states.items()})


def _energy_size(ivp: Ivp, vectors: Sequence[Array], start: float) -> float:
    """Return the size that energy errors are compared with: |H| at the start, or the largest |p^T H_p| if that is more."""
    T = kinetic_energy(ivp, *vectors)
    return max(abs(start), 0.0 if T is None else float(np.max(2 * np.abs(T))), float(np.finfo(float).tiny))

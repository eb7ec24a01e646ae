"""Points of the manifold around a problem's start, and the equations of motion there, in numbers and independent of any method."""

from collections.abc import Callable, Iterator, Sequence
from typing import Any

import numpy as np

from daebench.diagnostics.consistency import project
from daebench.diagnostics.inverse_mass import mass
from daebench.diagnostics.manifold import residual_scales
from daebench.errors import BadInput
from daebench.runs.ivp import Array, ConstrainedIvp, Ivp
from daebench.systems.lazily import mpmath as mp
from daebench.systems.lazily import sympy as sp

State = tuple[Array, Array]

POINTS = 4
"""Points around the start."""

PIECES = 8
"""Number of pieces of the path to a point; each ends on the manifold."""

NEARER = 1 / 3
"""A path is left out if it comes nearer than this part of its start to a loss of rank of G, because it may continue on another branch."""

REGULAR = 1e-9
"""Least singular value of G at the start, relative to the largest, with which paths are held off a loss of rank."""

SLOWLY = 1e-3
"""Speed in sizes of q in a second below which a state is at rest: residuals of velocities are not measured against less."""


def points(ivp: ConstrainedIvp) -> Iterator[State]:
    """Yield the start and points around it, all on the manifold and with finite rates; fewer where projections do not converge.

    Where the manifold has branches that cross, G loses rank at the crossing, and points beyond it are left out.
    """
    # A fixed seed: a file is refused everywhere or nowhere.
    draw = np.random.default_rng(1)
    size = float(np.max(np.abs(ivp.q0))) or 1.0
    inertia = mass(ivp, ivp.p0, ivp.q0)
    first = _singular_values(ivp, ivp.q0) if ivp.m else np.ones(1)
    # A start at a loss of rank has no distance to keep from it: every path is then accepted.
    least = NEARER * first[-1] if first[-1] > REGULAR * first[0] else -1.0
    for k in range(POINTS + 1):
        dq, v = (0.1 * k / POINTS * size * draw.standard_normal(ivp.d) for _ in range(2))
        try:
            p, q = _reached(ivp, ivp.p0 + inertia @ v, dq, least)
        except (BadInput, np.linalg.LinAlgError):
            continue
        if np.all(np.isfinite(rates(ivp, p, q))):
            yield p, q


def _reached(ivp: ConstrainedIvp, p: Array, dq: Array, least: float) -> State:
    """Return the state with momenta p at the end of a path dq; raise :class:`BadInput` if a singular value of G falls below the least."""
    if not ivp.m:
        return p, ivp.q0 + dq
    q = ivp.q0
    for _ in range(PIECES):
        # In pieces: a projection from far away may end on another branch, without a message.
        p1, q, *_ = project(ivp, p, q + dq / PIECES)
        if not _singular_values(ivp, q)[-1] >= least:
            raise BadInput(f"{ivp.problem} comes near a place where G loses rank, on the way to {q}.", "rank-loss-nearby")
    return p1, q


def _singular_values(ivp: ConstrainedIvp, q: Array) -> Array:
    """Return the singular values of G, the largest first."""
    return np.linalg.svd(np.asarray(ivp.value("G", tuple(q)), dtype=float), compute_uv=False)


def rates(ivp: ConstrainedIvp, p: Array, q: Array) -> State:
    """Return p' = -H_q - G^T lam and q' = H_p of (1.18)."""
    state = tuple(p), tuple(q)
    G = ivp.value("G", state[1])
    return -ivp.value("H_q", *state) - G.T @ ivp.value("lam", *state), ivp.value("H_p", *state)


def without_potential(ivp: ConstrainedIvp, p: Array, q: Array, rate: Array) -> float:
    """Return the error of a rate (p', q') of the motion without U, relative to its size, for the lam that fits best."""
    derivation, d = ivp.source.derivation, ivp.d
    v, G = ivp.value("H_p", tuple(p), tuple(q)), ivp.value("G", tuple(q))
    slopes = [[entry.diff(symbol) for entry in sp.flatten(derivation.M)] for symbol in derivation.problem.q]
    M_q = np.array(numeric(ivp, slopes)(p, q), dtype=float).reshape(d, d, d)
    force = rate[:d] - np.einsum("kij,i,j->k", M_q, v, v) / 2
    rest = force - G.T @ np.linalg.lstsq(G.T, force, rcond=None)[0]
    scale = max(float(np.max(np.abs(force))), float(np.max(np.abs(p))), 1e-300)
    return max(float(np.max(np.abs(rest))) / scale, differs(rate[d:], v))


def off_manifold(ivp: ConstrainedIvp, p: Array, q: Array) -> float:
    """Return the largest of |g| and |G H_p|, relative to its change under a relative change of one in p and q."""
    state, slow = (tuple(p), tuple(q)), SLOWLY * mass(ivp, p, q) @ np.abs(q)
    sizes = (float(np.max(np.abs(ivp.value(name, *x)), initial=0.0)) for name, x in (("g", state[1:]), ("Gv", state)))
    # A state that passes rest has no momentum, and a residual would be measured against nothing.
    scales = residual_scales(ivp, np.abs(p) + np.abs(slow), q)
    return max(size / (scale or 1.0) for size, scale in zip(sizes, scales, strict=True))


def slow_time(p: Array, q: Array, dp: Array, dq: Array) -> float:
    """Return a time over which a state changes by about a tenth of its size."""
    changes = [float(np.max(np.abs(rate))) / (float(np.max(np.abs(x))) or 1.0) for x, rate in ((p, dp), (q, dq))]
    return 0.1 / (max(changes) or 1.0)


def field(ivp: Ivp, x: Array) -> Array:
    """Return (q', p') at x = (q, p) on one line, or y' at x = y."""
    if not ivp.on_manifold:
        return np.asarray(ivp.value("field", tuple(x)), dtype=float)
    dp, dq = rates(ivp, x[ivp.d :], x[: ivp.d])
    return np.concatenate([dq, dp])


def flat(ivp: Ivp, state: Sequence[Any]) -> list[Any]:
    """Return q then p as one list, or y."""
    return list(state) if not ivp.on_manifold and not hasattr(state[0], "__len__") else [x for part in state for x in part]


def exact_start(ivp: Ivp) -> tuple[list[list[Any]], dict[str, Any]]:
    """Return the initial values and the parameters of a problem as mpmath numbers of the working precision."""
    problem = ivp.source.derivation.problem
    # The decimal number that was written, and not the binary one that stands for it.
    exact = {symbol: sp.Rational(repr(ivp.parameters[str(symbol)])) for symbol in problem.parameters}
    case, parts = problem.cases.get(ivp.case), ivp.state.columns
    if case is None:  # a start of one's own, whose numbers are meant as they are
        start = [[mp.mpf(float(x)) for x in getattr(ivp, f"{part}0")] for part in parts]
        return start, {str(symbol): mp.mpf(value.p) / value.q for symbol, value in exact.items()}
    # Five guard digits, so that only the conversion to the working precision rounds.
    start = [[sp.N(sp.sympify(x).subs(exact), mp.mp.dps + 5)._to_mpmath(mp.mp.prec) for x in getattr(case, part)] for part in parts]
    return start, {str(symbol): mp.mpf(value.p) / value.q for symbol, value in exact.items()}


def numeric(ivp: ConstrainedIvp, expressions: Sequence[Any], *more: Any) -> Callable[..., Any]:
    """Return expressions in p, q, the parameters and further symbols as a function of p, q and values of these symbols."""
    problem = ivp.source.derivation.problem
    call = sp.lambdify([list(problem.p), list(problem.q), list(problem.parameters), *more], expressions, "numpy", cse=True)

    def function(p: Array, q: Array, *rest: float) -> Any:
        with np.errstate(all="ignore"):
            return call(p, q, ivp.par, *rest)

    return function


def differs(a: Array, b: Array) -> float:
    """Return the largest difference relative to the largest modulus; infinity if a value is not finite."""
    off = float(np.max(np.abs(a - b))) / max(float(np.max(np.abs(b))), 1e-300)
    return off if np.isfinite(off) else float("inf")


def text(x: Array) -> str:
    """Return numbers as a tuple of four digits each."""
    return f"({', '.join(f'{value:.4g}' for value in x)})"

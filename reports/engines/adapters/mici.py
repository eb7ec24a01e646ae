"""Mici: U, g, their derivatives and M are handed to its constrained leapfrog as NumPy functions."""

from typing import Any

import numpy as np

from daebench.compiler.printed import printed
from daebench.reports.engines.contender import Array, Contender, States, halved, mass_matrix, stepped
from daebench.runs.ivp import ConstrainedIvp
from daebench.systems.lazily import mici

PACKAGE = "mici"

TIGHT = {"constraint_tol": 1e-12, "position_tol": 1e-10}
"""Tolerances of its Newton iteration, which is quadratic; 1e-9 and 1e-8 if left out."""


REVERSE = 2e-8
"""Tolerance of its check of reversibility, as it is if nothing is said."""


def system(ivp: ConstrainedIvp) -> Any:
    """Return the constrained system, with the density on the manifold itself, so that H has no term of the Gram matrix."""
    M = mass_matrix(ivp)
    diagonal = np.array_equal(M, np.diag(np.diag(M)))
    functions = chain(ivp) if ivp.problem == "pendulum_chain" else written_out(ivp)
    return mici.systems.DenseConstrainedEuclideanMetricSystem(**functions, metric=np.diag(M) if diagonal else M, dens_wrt_hausdorff=True)


def written_out(ivp: ConstrainedIvp) -> dict[str, Any]:
    """Return U, g and their derivatives as ``daebench show PROBLEM --as python`` prints them."""
    module: dict[str, Any] = {}
    exec(printed("python", ivp.problem, ivp.source.derivation), module)
    par, potential = ivp.par, (np.zeros(ivp.d),) if "U" not in module else ()
    U, U_q = (module["H"], module["H_q"]) if potential else (module["U"], module["U_q"])
    return {
        "neg_log_dens": lambda q: U(par, *potential, q),
        "grad_neg_log_dens": lambda q: U_q(par, *potential, q),
        "constr": lambda q: module["g"](par, q),
        "jacob_constr": lambda q: module["G"](par, q),
    }


def chain(ivp: ConstrainedIvp) -> dict[str, Any]:
    """Return the functions of a chain with arrays in the place of its links."""
    m, length, gravity = (ivp.parameters[name] for name in ("mass", "length", "gravity"))
    k, weight = np.arange(ivp.m), np.tile([0.0, m * gravity], ivp.m)

    def rods(q: Array) -> Array:
        return np.diff(q.reshape(-1, 2), axis=0, prepend=0.0)

    def G(q: Array) -> Array:
        rows = np.zeros((ivp.m, ivp.m, 2))
        rows[k, k] = 2 * rods(q)
        rows[k[1:], k[:-1]] = -2 * rods(q)[1:]
        return rows.reshape(ivp.m, ivp.d)

    return {
        "neg_log_dens": lambda q: weight @ q,
        "grad_neg_log_dens": lambda q: weight,
        "constr": lambda q: np.sum(rods(q) ** 2, axis=1) - length**2,
        "jacob_constr": G,
    }


def begun(ivp: ConstrainedIvp, h: float, p: Array, q: Array, reverse: float = REVERSE) -> tuple[Any, Any, Any]:
    """Return the system, the constrained leapfrog with Newton's iteration to round-off, and a state."""
    posed = system(ivp)
    integrator = mici.integrators.ConstrainedLeapfrogIntegrator(
        posed, step_size=h, reverse_check_tol=reverse, projection_solver_kwargs=TIGHT
    )
    return posed, integrator, mici.states.ChainState(pos=np.array(q), mom=np.array(p), dir=1)


def steps(ivp: ConstrainedIvp, p: Array, q: Array, h: float, count: int) -> tuple[Array, Array]:
    """Return p and q after so many steps, without the check, so that they may start beside the manifold."""
    _, integrator, state = begun(ivp, h, p, q, np.inf)
    for _ in range(count):
        state = integrator.step(state)
    return state.mom, state.pos


def run(ivp: ConstrainedIvp, h: float, times: Array) -> States:
    """Run the constrained leapfrog."""
    posed, integrator, start = begun(ivp, h, ivp.p0, ivp.q0)
    state = [start]

    def advance(count: int) -> None:
        for _ in range(count):
            state[0] = integrator.step(state[0])

    def read() -> tuple[Array, Array, float]:
        return state[0].mom.copy(), state[0].pos.copy(), float(posed.h(state[0]))

    return stepped(advance, read, h, times)


def contenders() -> list[Contender]:
    """Return the constrained leapfrog on every motion that it can express."""
    steps = {
        "pendulum": halved(1 / 16, 7),
        "double": halved(1 / 32, 7),
        "slider": halved(1 / 32, 6),
        "fourbar": halved(1 / 8, 6),
        "iftomm": halved(1 / 16, 6),
        "chain10": halved(1 / 16, 6),
        "chain100": halved(1 / 16, 4),
        "butane": halved(1 / 16, 6),
        "top": halved(1 / 256, 5),
    }
    return [Contender("Mici", "constrained leapfrog", motion, "h", values, run) for motion, values in steps.items()]

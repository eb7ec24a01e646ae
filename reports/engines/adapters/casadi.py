"""CasADi: the index-3 DAE is reduced by its own index reduction, with and without Baumgarte's correction, and integrated by IDAS."""

import time
from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
import sympy as sp

from daebench.compiler.printed import functions
from daebench.reports.engines.contender import Array, Contender, States, mass_matrix
from daebench.runs.ivp import ConstrainedIvp
from daebench.systems.lazily import casadi as ca

PACKAGE = "casadi"

TOLERANCES = (1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9, 1e-10, 1e-11, 1e-12)
"""Relative and absolute tolerances; 1e-6 and 1e-8 if left out."""

POLES = {"no correction": 0.0, "Baumgarte pole -1": -1.0}
"""Poles of the correction, 1/s: none, which is the default, and that of its example of the pendulum."""

Pose = Callable[[ConstrainedIvp, float], tuple[dict[str, Any], Any]]
"""From a problem and a pole to a DAE of index 1, and the function from its unknowns to q and v."""

STEPS = 1_000_000
"""Most steps from output to output; 10 000 if left out."""


def dae(ivp: ConstrainedIvp) -> Any:
    """Return q' = v, M v' = -U_q - G^T lam, 0 = g in CasADi's symbols."""
    d, m, M = ivp.d, ivp.m, mass_matrix(ivp)
    vectors = {name: [ca.SX.sym(f"{name}_{k}") for k in range(d)] for name in ("q", "v", "dq", "dv")}
    lam = [ca.SX.sym(f"lam_{k}") for k in range(m)]
    U_q, g, G = expressions(ivp, vectors["q"])
    column = {name: ca.vertcat(*symbols) for name, symbols in vectors.items()}
    force = ca.DM(M) @ column["dv"] + ca.vertcat(*U_q) + G.T @ ca.vertcat(*lam)
    equations = ca.vertcat(column["dq"] - column["v"], force, ca.vertcat(*g))
    states, rates = ca.vertcat(column["q"], column["v"]), ca.vertcat(column["dq"], column["dv"])
    return {"x_impl": states, "dx_impl": rates, "z": ca.vertcat(*lam), "alg": equations}


def expressions(ivp: ConstrainedIvp, q: list[Any]) -> tuple[list[Any], list[Any], Any]:
    """Return U_q, g and G of the problem's definition in CasADi's symbols; CasADi differentiates g itself."""
    words = [{"cos": ca.cos, "sin": ca.sin, "sqrt": ca.sqrt}]
    if ivp.problem == "pendulum_chain":
        m, length, gravity = (ivp.parameters[name] for name in ("mass", "length", "gravity"))
        rods = [(q[k] - (q[k - 2] if k > 1 else 0), q[k + 1] - (q[k - 1] if k > 1 else 0)) for k in range(0, ivp.d, 2)]
        U_q, g = [0, m * gravity] * ivp.m, [x**2 + y**2 - length**2 for x, y in rods]
    else:
        derivation = ivp.source.derivation
        parts = {function.name: function.flat for function in functions(derivation)}
        numbers = dict(zip(derivation.definition.parameters, ivp.par, strict=True))
        rest = dict.fromkeys(derivation.p, 0)
        flat = [sp.sympify(x).xreplace(numbers | rest) for x in [*parts.get("U_q", parts.get("H_q", [])), *parts["g"]]]
        values = sp.lambdify(list(derivation.q), flat, modules=words)(*q)
        U_q, g = values[: ivp.d], values[ivp.d :]
    return U_q, g, ca.jacobian(ca.vertcat(*g), ca.vertcat(*q))


def reduced(ivp: ConstrainedIvp, pole: float) -> tuple[dict[str, Any], Any]:
    """Return the DAE of index 1 by ``dae_reduce_index``, and the function from its unknowns to the original ones."""
    posed = dae(ivp)
    of_index_1, _ = ca.dae_reduce_index(posed, {"baumgarte_pole": pole})
    explicit, to_original, _ = ca.dae_map_semi_expl(posed, of_index_1)
    return explicit, to_original


def by_hand(ivp: ConstrainedIvp, pole: float) -> tuple[dict[str, Any], Any]:
    """Return q' = v, v' = a, 0 = g'' - 2 pole g' + pole^2 g with a = -M^-1 (U_q + G^T lam), where ``dae_reduce_index`` does not succeed."""
    q, v, lam = ([ca.SX.sym(f"{name}_{k}") for k in range(n)] for name, n in (("q", ivp.d), ("v", ivp.d), ("lam", ivp.m)))
    U_q, g, G = expressions(ivp, q)
    position, velocity, multiplier, g = ca.vertcat(*q), ca.vertcat(*v), ca.vertcat(*lam), ca.vertcat(*g)
    a = -ca.DM(np.linalg.inv(mass_matrix(ivp))) @ (ca.vertcat(*U_q) + G.T @ multiplier)
    rate = G @ velocity
    second = ca.jtimes(rate, position, velocity) + G @ a
    states = ca.vertcat(position, velocity)
    explicit = {"x": states, "z": multiplier, "ode": ca.vertcat(velocity, a), "alg": second - 2 * pole * rate + pole**2 * g}
    return explicit, ca.Function("original", [states, multiplier], [states], ["xf", "zf"], ["x_impl"])


def run(pose: Pose, pole: float, ivp: ConstrainedIvp, tol: float, times: Array) -> States:
    """Run IDAS at a tolerance over the DAE of index 1, from the consistent start."""
    explicit, to_original = pose(ivp, pole)
    M = mass_matrix(ivp)
    v0 = np.linalg.solve(M, ivp.p0)
    lam0 = ivp.value("lam", ivp.p0, ivp.q0)
    a0 = -np.linalg.solve(M, ivp.value("H_q", ivp.p0, ivp.q0) + jacobian(ivp).T @ lam0)
    known = {"q": ivp.q0, "v": v0, "dq": v0, "dv": a0, "ddq": a0, "lam": lam0}
    start = {key: [_value(known, str(symbol)) for symbol in ca.vertsplit(explicit[name])] for key, name in (("x0", "x"), ("z0", "z"))}
    options = {"reltol": tol, "abstol": tol, "max_num_steps": STEPS}
    integrator = ca.integrator("run", "idas", explicit, 0, times.tolist(), options)
    began = time.process_time()
    end = integrator(**start)
    seconds = time.process_time() - began
    original = np.array(to_original(xf=end["xf"], zf=end["zf"])["x_impl"]).T
    q, v = original[:, : ivp.d], original[:, ivp.d :]
    return States(v @ M, q, seconds, np.full(len(times), np.nan))


def jacobian(ivp: ConstrainedIvp) -> Array:
    """Return G at the start, shape(m, d), row by row as its products with unit vectors."""
    q = [ca.SX.sym(f"q_{k}") for k in range(ivp.d)]
    G = ca.Function("G", [ca.vertcat(*q)], [expressions(ivp, q)[2]])
    return np.array(G(ivp.q0))


def _value(known: dict[str, Array], symbol: str) -> float:
    name, _, k = symbol.rpartition("_")
    return float(known[name][int(k)])


def contenders() -> list[Contender]:
    """Return IDAS with and without the correction on every motion that it can express."""
    poses = {"pendulum": reduced, "double": reduced, "slider": reduced}
    poses |= dict.fromkeys(("fourbar", "iftomm", "chain10", "chain100", "butane", "top"), by_hand)
    return [
        Contender("CasADi", f"IDAS, {words}", motion, "tol", TOLERANCES, partial(run, pose, pole))
        for motion, pose in poses.items()
        for words, pole in POLES.items()
    ]

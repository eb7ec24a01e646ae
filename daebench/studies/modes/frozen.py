"""A problem in time or under forces, held as it is at t = 0: its forces at rest by their potential, and its dampers apart."""

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from daebench.compiler.definition import Source
from daebench.errors import BadInput
from daebench.runs.ivp import Array, ConstrainedIvp
from daebench.runs.make_ivp import constrained, make_ivp
from daebench.runs.own_start import base
from daebench.systems.lazily import sympy as sp

if TYPE_CHECKING:
    from daebench.systems.constrained import ConstrainedHamiltonian


def frozen(ivp: ConstrainedIvp) -> ConstrainedIvp:
    """Return a problem without its time and with the potential of its forces at rest."""
    problem: Any = ivp.source.define()
    U = _potential(ivp.problem, problem)

    def define() -> Any:
        parts = {name: _held(problem, getattr(problem, name)) for name in ("H", "M", "U")}
        name = "U" if problem.H is None else "H"
        held = {**parts, name: parts[name] + U, "g": [_held(problem, g) for g in problem.g]}
        return replace(problem, **held, t=None, force=None, v=None, integrals={}, chart=None, closed_form=None, kinetic_flow=None)

    source = Source(ivp.problem, f"{ivp.source.key} held at rest", define, ivp.source.defaults)
    still = make_ivp(source, base(ivp.case), ivp.parameters, q0=ivp.q0[:-1].tolist(), p0=[0.0] * problem.d)
    return replace(constrained(still, "which has no equilibrium"), on_singular=ivp.on_singular)


def damping_at(ivp: ConstrainedIvp, q: Array) -> Array:
    """Return -dF/dv at rest at a position, shape(d, d); 0 without forces."""
    if not ivp.facts.EXTENDED:
        return np.zeros((len(q), len(q)))
    problem: Any = ivp.source.define()
    force = sp.Matrix([_held(problem, x) for x in _force(problem)])
    C = -force.jacobian(list(problem.v)) if problem.v else sp.zeros(len(q), len(q))
    at = {**dict.fromkeys(problem.v or (), 0), **dict(zip(problem.q, q, strict=True))}
    return np.array(C.subs(at).subs({x: ivp.parameters[str(x)] for x in problem.parameters}), dtype=float)


def _held(problem: "ConstrainedHamiltonian", x: Any) -> Any:
    return x if x is None or problem.t is None else sp.sympify(x).subs(problem.t, 0)


def _force(problem: "ConstrainedHamiltonian") -> list[Any]:
    """Return F, with v in place of p where M is given."""
    momenta = {} if problem.M is None or not problem.v else dict(zip(problem.p, problem.M * sp.Matrix(problem.v), strict=True))
    return [sp.sympify(x).subs(momenta) for x in problem.force or [0] * problem.d]


def _potential(name: str, problem: "ConstrainedHamiltonian") -> Any:
    """Return the potential of the forces at rest, a polynomial; refuse forces without one."""
    q = list(problem.q)
    F = sp.Matrix([_held(problem, x).subs(dict.fromkeys([*problem.p, *(problem.v or ())], 0)) for x in _force(problem)])
    slopes = F.jacobian(q)
    if not all(x.is_polynomial(*q) for x in F) or (slopes - slopes.T).expand() != sp.zeros(len(q), len(q)):
        raise BadInput(
            f"modes need forces that have a potential at rest, a polynomial, and those of {name} have none.", "modes-need-potential"
        )
    # Along the straight line from the origin; U is known up to a constant.
    s = sp.Dummy()
    return -sp.integrate(sp.expand(F.subs({x: s * x for x in q}, simultaneous=True).dot(q)), (s, 0, 1))

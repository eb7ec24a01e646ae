"""Problem files as their users write them: a constrained problem and a Poisson system."""

RING = '''"""A bead on a ring, free to slide."""

import mpmath as mp
import sympy as sp

from daebench import Case, Chart, ConstrainedHamiltonian, KineticFlow
from daebench.systems.kinetic_flows import sphere


def problem(*, mass: float = 2.0, radius: float = 1.5) -> ConstrainedHamiltonian:
    m, r = sp.symbols("mass radius", positive=True)
    q, p = sp.symbols("q1:3", real=True), sp.symbols("p1:3", real=True)
    eta, xi = sp.symbols("rate angle", real=True)
    turn = q[0] * p[1] - q[1] * p[0]
    e, n = sp.Matrix([sp.cos(xi), sp.sin(xi)]), sp.Matrix([-sp.sin(xi), sp.cos(xi)])
    flow = sphere(q, p, mass=m, length=r)
    return ConstrainedHamiltonian(
        q=q,
        p=p,
        M=m * sp.eye(2),
        U=sp.S.Zero,
        g=[q[0] ** 2 + q[1] ** 2 - r**2],
        parameters={m: mass, r: radius},
        cases={"turning": Case(q=(0, -r), p=(3 * m, 0)), "resting": Case(q=(r, 0), p=(0, 0))},
        integrals={"L": turn},
        closed_form=closed_form,
        kinetic_flow=flow,
        chart=Chart(
            eta=[eta], xi=[xi], p=list(m * r * eta * n), q=list(r * e), inverse_eta=[turn / (m * r**2)], inverse_xi=[sp.atan2(q[1], q[0])]
        ),
    )


def closed_form(t, q0, p0, parameters):
    angle = (q0[0] * p0[1] - q0[1] * p0[0]) / (parameters["mass"] * parameters["radius"] ** 2) * t
    c, s = mp.cos(angle), mp.sin(angle)
    return [c * q0[0] - s * q0[1], s * q0[0] + c * q0[1]], [c * p0[0] - s * p0[1], s * p0[0] + c * p0[1]]
'''

ORBIT = '''"""Two species."""

import sympy as sp

from daebench import PoissonCase, PoissonSystem


def problem(*, rate: float = 2.0) -> PoissonSystem:
    u, v, a = sp.symbols("u v rate", positive=True)
    return PoissonSystem(
        y=(u, v),
        B=sp.Matrix([[0, u * v], [-u * v, 0]]),
        H=u - sp.log(u) + v - a * sp.log(v),
        domain=[u, v],
        parameters={a: rate},
        cases={"even": PoissonCase(y=(1, 3))},
    )
'''

PLAIN = RING[: RING.index("        integrals=")] + "    )\n"
"""The ring without what is checked of a motion."""

HELPED = PLAIN.replace("import sympy as sp\n", "import sympy as sp\n\nimport helper_of_ring\n", 1).replace(
    "(3 * m, 0)", "(helper_of_ring.SPEED * m, 0)"
)

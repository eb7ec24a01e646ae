"""Symplectic Euler on the index-reduced ODE, each step followed by the orthogonal projection onto the manifold, HLW Fig. 1.1."""

from daebench.schemes.kernels.claims import Claims
from daebench.schemes.kernels.manifold import project
from daebench.schemes.kernels.newton import both
from daebench.schemes.kernels.spaces import Number, Step, Vector
from daebench.schemes.se import step as se_step

CLAIMS = Claims(
    order=1, symmetric=False, symplectic=False, keeps_g=True, keeps_Gv=True, system="ode", source="HLW Fig. 1.1 seproj", imposes=True
)


def step(p0: Vector, q0: Vector, h: Number) -> Step:
    """Return p1, q1, no stage multipliers, and a report: a step of ``se``, projected in a metric with the unit of time 1 s."""
    p_free, q_free, _, step_report = se_step(p0, q0, h)
    p1, q1, settled = project(p_free, q_free)
    return p1, q1, (), both(step_report, settled)

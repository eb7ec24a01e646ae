"""The Störmer-Verlet scheme for Poisson systems in halves, HLW Example 4.7: the adjoint symplectic Euler method, then the method itself."""

from dataclasses import replace

from daebench.schemes.kernels.newton import both
from daebench.schemes.kernels.spaces import Number, Report, Vector
from daebench.schemes.poisson.symplectic_euler import CLAIMS as SYMPLECTIC_EULER
from daebench.schemes.poisson.symplectic_euler import step as second
from daebench.schemes.poisson.symplectic_euler_adjoint import step as first

CLAIMS = replace(SYMPLECTIC_EULER, order=2, symmetric=True)


def step(y0: Vector, h: Number) -> tuple[Vector, Report]:
    """Return y1 and a report; v is implicit in the first half of the step, u in the second.

    ::

        y1 = Phi_{h/2} o Phi*_{h/2} (y0)        Phi: symplectic Euler, implicit in u
    """
    # In this order: the other one leaves u, v > 0 from (6, 2), the outer orbit of HLW Fig. 4.1.
    y_half, report = first(y0, h / 2)
    y1, more = second(y_half, h / 2)
    return y1, both(report, more)

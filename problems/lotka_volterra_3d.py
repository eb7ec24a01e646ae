"""Three species, HLW (2.14): a Poisson system of rank two with a Casimir function, whose positive solutions blow up."""

import sympy as sp

from daebench.systems.picture import Picture
from daebench.systems.poisson import DarbouxMap, Part, PoissonCase, PoissonSystem


def problem() -> PoissonSystem:
    """Return the three-dimensional Lotka-Volterra system, HLW (2.14).

    ::

        y1' = y1 (y2 + y3)      y2' = y2 (y1 - y3 + 1)      y3' = y3 (y1 + y2 + 1)      y1, y2, y3 > 0
        B = [[0, y1 y2, y1 y3], [-y1 y2, 0, -y2 y3], [-y1 y3, y2 y3, 0]]
        H = -y1 + y2 + y3 + ln y2 - ln y3      C = -ln y1 - ln y2 + ln y3

    In logarithms B is constant: Q = ln y1, P = ln y2 and C are canonical coordinates, and the parts of H, each a function of one
    coordinate, have exponentials for flows.
    """
    y1, y2, y3 = y = sp.symbols("y1:4", positive=True)
    t, q, p, c = sp.symbols("t Q P c", real=True)
    C = -sp.log(y1) - sp.log(y2) + sp.log(y3)
    first, second, third = -y1, y2 + sp.log(y2), y3 - sp.log(y3)
    return PoissonSystem(
        y=y,
        B=sp.Matrix([[0, y1 * y2, y1 * y3], [-y1 * y2, 0, -y2 * y3], [-y1 * y3, y2 * y3, 0]]),
        H=first + second + third,
        casimirs={"C": C},
        domain=y,
        cases={
            "blow_up": PoissonCase(y=_tenths(1, 5, 2), about="y1 and y3 go to infinity at t = 1.7479"),
            "late": PoissonCase(y=tuple(x / 10 for x in _tenths(1, 5, 2)), about="a tenth of blow_up: to infinity at t = 4.4415"),
        },
        parts={
            "H1": Part(H=first, t=t, y=(y1, y2 * sp.exp(t * y1), y3 * sp.exp(t * y1))),
            "H2": Part(H=second, t=t, y=(y1 * sp.exp(t * (y2 + 1)), y2, y3 * sp.exp(t * (y2 + 1)))),
            "H3": Part(H=third, t=t, y=(y1 * sp.exp(t * (y3 - 1)), y2 * sp.exp(t * (1 - y3)), y3)),
        },
        splittings={"123": ("H1", "H2", "H3")},
        darboux=DarbouxMap(
            q=(q,),
            p=(p,),
            c=(c,),
            Q=(sp.log(y1),),
            P=(sp.log(y2),),
            C=(C,),
            y=(sp.exp(q), sp.exp(p), sp.exp(c + q + p)),
        ),
        picture=Picture(masses=[[sp.log(x) for x in y]], axes=("ln y1", "ln y2", "ln y3")),
    )


def _tenths(*numbers: int) -> tuple[sp.Rational, ...]:
    return tuple(sp.Rational(number, 10) for number in numbers)

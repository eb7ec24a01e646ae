"""The slider crank of SUNDIALS' examples, with a spring, a damper and a load: printed motion, and a printed gradient."""

from collections.abc import Sequence

import sympy as sp

from daebench.problems._charts import moving
from daebench.systems.constrained import Case, Chart, ConstrainedHamiltonian, Picture


def problem(
    *,
    crank: float = 0.5,
    crank_inertia: float = 1.0,
    slider_mass: float = 1.0,
    rod_inertia: float = 2.0,
    k: float = 1.0,
    c: float = 1.0,
    rest_length: float = 1.0,
    load: float = 1.0,
) -> ConstrainedHamiltonian:
    """Return the slider crank of SUNDIALS: q the crank's angle, x the place of the slider, and p the angle of the rod, of length 1.

    ::

        T  = (crank_inertia q'^2 + slider_mass x'^2 + rod_inertia p'^2) / 2
        U  = k/2 (l - rest_length)^2 - load (x + cos p)      F = -c l' (l_q, l_x, l_p)
        g1 = x - cos p - crank cos q                         g2 = -sin p - crank sin q

    A spring and a damper are between the midpoints of crank and rod, at the distance l from each other. The damper's force has no
    potential; the load along the slider's line has one. The examples are ``idaSlCrank_dns``, which prints five digits of the motion, and
    ``idasSlCrank_FSA``, which prints the integral over time of T up to t = 10 and its derivatives with respect to k and c.

    Parameters
    ----------
    crank : float
        Length of the crank, less than the rod's, m.
    crank_inertia, rod_inertia : float
        Moments of inertia that belong to q' and p', kg m^2.
    slider_mass : float
        Mass that belongs to x', kg.
    k : float
        Stiffness of the spring, N/m.
    c : float
        Damping constant, N s/m.
    rest_length : float
        Length of the spring without force, m.
    load : float
        Constant force, N.
    """
    a, J1, m2, J2 = masses = sp.symbols("crank crank_inertia slider_mass rod_inertia", positive=True)
    stiffness, damping, l0, pull = others = sp.symbols("k c rest_length load", real=True)
    q, p, v = (sp.symbols(names, real=True) for names in ("q x p", "p_q p_x p_p", "v_q v_x v_p"))
    length = spring(q, a)
    by_place = sp.Matrix([length]).jacobian(q).T
    M = sp.diag(J1, m2, J2)
    tip, slider = (a * sp.cos(q[0]), a * sp.sin(q[0])), (q[1], sp.S.Zero)
    between = middle((0, 0), tip), middle(tip, slider)
    return ConstrainedHamiltonian(
        q=q,
        p=p,
        v=v,
        M=M,
        # The printed load is a force (0, F, -F sin p): it has this potential, so that only the damper is a force without one.
        U=stiffness / 2 * (length - l0) ** 2 - pull * (q[1] + sp.cos(q[2])),
        force=tuple(-damping * by_place.dot(sp.Matrix(v)) * by_place),
        g=[q[1] - sp.cos(q[2]) - a * sp.cos(q[0]), -sp.sin(q[2]) - a * sp.sin(q[0])],
        parameters=dict(zip([*masses, *others], [crank, crank_inertia, slider_mass, rod_inertia, k, c, rest_length, load], strict=True)),
        cases={
            "ida": Case(q=(sp.pi / 2, sp.sqrt(1 - a**2), -sp.asin(a)), p=(0, 0, 0), about="at rest, the crank upright: SUNDIALS, to t = 10")
        },
        chart=crank_angle(q, p, M, a),
        picture=Picture(
            rods=[[(0, 0), tip], [tip, slider]],
            springs=[between],
            dampers=[between],
            masses=[slider],
            fixed=[(0, 0)],
            points={"O": (0, 0), "A": tip, "B": slider},
        ),
    )


def middle(first: Sequence[sp.Expr], second: Sequence[sp.Expr]) -> tuple[sp.Expr, ...]:
    """Return the point between two points."""
    return tuple((x + y) / sp.S(2) for x, y in zip(first, second, strict=True))


def spring(q: Sequence[sp.Symbol], a: sp.Expr) -> sp.Expr:
    """Return the distance l of the midpoints of the crank and of the rod, which is given by its end at the slider and its angle."""
    across = q[1] - (sp.cos(q[2]) + a * sp.cos(q[0])) / 2, (sp.sin(q[2]) + a * sp.sin(q[0])) / 2
    return sp.sqrt(across[0] ** 2 + across[1] ** 2)


def crank_angle(q: Sequence[sp.Symbol], p: Sequence[sp.Symbol], M: sp.Matrix, a: sp.Expr) -> Chart:
    """Return the chart of the crank's angle and its rate: the rod's angle is -asin(crank sin q), nowhere singular for crank < 1."""
    phi = sp.Symbol("phi", real=True)
    place = (phi, a * sp.cos(phi) + sp.sqrt(1 - (a * sp.sin(phi)) ** 2), -sp.asin(a * sp.sin(phi)))
    return moving(q, p, M, xi=[phi], place=place, inverse=[q[0]])

"""A car axle on two springs whose right wheel rolls over bumps: constraints that depend on time, and a benchmark of DAE codes."""

from collections.abc import Sequence

import sympy as sp

from daebench.systems.constrained import Case, Chart, ConstrainedHamiltonian, Picture


def problem(
    *,
    epsilon: float = 0.01,
    mass: float = 10.0,
    length: float = 1.0,
    rest_length: float = 0.5,
    height: float = 0.1,
    frequency: float = 10.0,
    gravity: float = 1.0,
) -> ConstrainedHamiltonian:
    """Return the car axis, q = (xl, yl, xr, yr): the ends of the axle, above wheels at the origin and at (xb, yb).

    ::

        yb(t) = height sin(frequency t)     xb(t) = sqrt(length^2 - yb^2)     k = mass epsilon^2 / 2
        H  = (pxl^2 + pyl^2 + pxr^2 + pyr^2) / (2 k) + k gravity (yl + yr)
             + (sqrt(xl^2 + yl^2) - rest_length)^2 / 2 + (sqrt((xr - xb)^2 + (yr - yb)^2) - rest_length)^2 / 2
        g1 = xl xb + yl yb                              the left spring stays perpendicular to the line between the wheels
        g2 = (xl - xr)^2 + (yl - yr)^2 - length^2       the axle is rigid

    A problem by S. Schneider in F. Mazzia and C. Magherini, *Test Set for Initial Value Problem Solvers*, release 2.4 (Bari, 2008), whose
    multipliers are minus these. With a small epsilon, and so a small mass, the springs are stiff.

    Parameters
    ----------
    epsilon : float
        Scale of mass and stiffness.
    mass : float
        Mass of the chassis before scaling.
    length : float
        Distance of the wheels and length of the axle.
    rest_length : float
        Length of the springs without force, and their length at the start.
    height, frequency : float
        Amplitude and angular frequency of the bumps; height < length.
    gravity : float
        Gravitational acceleration along -y.
    """
    names = sp.symbols("epsilon mass length rest_length height frequency", positive=True)
    (eps, m, L, L0, r, w), gamma = names, sp.Symbol("gravity", real=True)
    q, p = sp.symbols("xl yl xr yr", real=True), sp.symbols("pxl pyl pxr pyr", real=True)
    t, k = sp.Symbol("t", real=True), m * eps**2 / 2
    xl, yl, xr, yr = q
    xb, yb = wheel = moving_wheel(t, L, r, w)
    left, right = sp.sqrt(xl**2 + yl**2), sp.sqrt((xr - xb) ** 2 + (yr - yb) ** 2)
    # The left spring turns with the wheels' line at the rate r w / L: without this velocity the start would be inconsistent.
    slide = -k * r * w * L0 / L
    return ConstrainedHamiltonian(
        q=q,
        p=p,
        t=t,
        M=k * sp.eye(4),
        U=((left - L0) ** 2 + (right - L0) ** 2) / 2 + k * gamma * (yl + yr),
        # The constraints of the test set, scaled as there, so that multipliers differ in sign only.
        g=[xl * xb + yl * yb, (xl - xr) ** 2 + (yl - yr) ** 2 - L**2],
        parameters=dict(zip([*names, gamma], [epsilon, mass, length, rest_length, height, frequency, gravity], strict=True)),
        cases={"bari": Case(q=(0, L0, L, L0), p=(slide, 0, slide, 0), about="level, its springs at rest: Bari test set, to t = 3")},
        chart=height_and_angle(q, p, t, wheel, k, L),
        picture=Picture(
            rods=[[(xl, yl), (xr, yr)]],
            springs=[((0, 0), (xl, yl)), (wheel, (xr, yr))],
            masses=[(xl, yl), (xr, yr)],
            fixed=[(0, 0)],
            points={"left": (xl, yl), "right": (xr, yr), "wheel": wheel},
        ),
    )


def moving_wheel(t: sp.Symbol, L: sp.Expr, r: sp.Expr, w: sp.Expr) -> tuple[sp.Expr, sp.Expr]:
    """Return the place (xb, yb) of the right wheel, at the distance L from the left one."""
    yb = r * sp.sin(w * t)
    return sp.sqrt(L**2 - yb**2), yb


def height_and_angle(
    q: Sequence[sp.Symbol], p: Sequence[sp.Symbol], t: sp.Symbol, wheel: Sequence[sp.Expr], k: sp.Expr, L: sp.Expr
) -> Chart:
    """Return the chart of the left spring's length s, the axle's angle phi, and their rates, regular wherever both constraints are.

    ::

        (xl, yl) = s (-yb, xb) / length     (xr, yr) = (xl, yl) + length (cos phi, sin phi)     p = k q'
    """
    s, phi, s_rate, phi_rate = sp.symbols("s phi s_rate phi_rate", real=True)
    along = sp.Matrix(wheel) / L
    up = sp.Matrix([-along[1], along[0]])
    axle = L * sp.Matrix([sp.cos(phi), sp.sin(phi)])
    place = sp.Matrix([s * up, s * up + axle])
    # With the derivative by time: the chart moves with the wheel.
    rate = place.jacobian([s, phi]) * sp.Matrix([s_rate, phi_rate]) + place.diff(t)
    x, v = sp.Matrix(q[:2]), sp.Matrix(p) / k
    across = sp.Matrix(q[2:]) - x
    turned = (across[0] * (v[3] - v[1]) - across[1] * (v[2] - v[0])) / L**2
    return Chart(
        eta=(s_rate, phi_rate),
        xi=(s, phi),
        p=tuple(k * rate),
        q=tuple(place),
        inverse_eta=(up.dot(v[:2]) + up.diff(t).dot(x), turned),
        inverse_xi=(up.dot(x), sp.atan2(across[1], across[0])),
    )

"""A rigid body with a fixed point by its rotation matrix: nine positions under six constraints, HLW VII.5."""

from collections.abc import Sequence

import sympy as sp

from daebench.problems._rotations import hat
from daebench.systems.constrained import Case, Chart, ConstrainedHamiltonian, Picture, coordinates

Expressions = Sequence[sp.Expr]


def problem(
    *,
    I1: float = 0.6,
    I2: float = 0.8,
    I3: float = 1.0,
    mass: float = 1.0,
    gravity: float = 0.0,
    r1: float = 0.0,
    r2: float = 1.0,
    r3: float = 0.0,
) -> ConstrainedHamiltonian:
    """Return the motion of the matrix Q that turns the axes of the body into those of space, row by row in q, and its momenta P in p.

    ::

        H = 1/2 tr(P D^-1 P^T) + mass gravity (Q r)_3      P = Q' D      d_k = (I1 + I2 + I3)/2 - I_k
        g = Q^T Q - I, its entries 11, 22, 33, 12, 13, 23

    The body's angular momentum y is given by hat(y) = Q^T P - P^T Q, and L = Q y is the angular momentum in space; under gravity only its
    vertical component is conserved. For particular moments and centres of mass there are more integrals; they are not declared.

    Parameters
    ----------
    I1, I2, I3 : float
        Principal moments of inertia about the fixed point, kg m^2; each less than the sum of the others, as for any body that is not flat.
    mass : float
        Mass of the body, kg.
    gravity : float
        Gravitational acceleration along the third axis of space, downwards, m/s^2.
    r1, r2, r3 : float
        Centre of mass from the fixed point, in the axes of the body, m.
    """
    moments, m = sp.symbols("I1:4", positive=True), sp.Symbol("mass", positive=True)
    gamma, *r = sp.symbols("gravity r1:4", real=True)
    q, p = coordinates(9)
    Q, P = sp.Matrix(3, 3, q), sp.Matrix(3, 3, p)
    orthogonal = Q.T * Q - sp.eye(3)
    return ConstrainedHamiltonian(
        q=q,
        p=p,
        M=sp.diag(*shares(moments), *shares(moments), *shares(moments)),
        U=m * gamma * (Q * sp.Matrix(r))[2],
        g=[orthogonal[i, j] for i, j in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))],
        parameters=dict(zip([*moments, m, gamma, *r], [I1, I2, I3, mass, gravity, r1, r2, r3], strict=True)),
        cases=cases(moments),
        integrals={"L3": (P * Q.T - Q * P.T)[1, 0]},
        chart=angles(Q, P, moments),
        picture=picture(Q, r),
    )


def picture(Q: sp.Matrix, r: Expressions) -> Picture:
    """Return the axes of the body, each of length one, the centre of mass and the fixed point."""
    origin = (0, 0, 0)
    return Picture(rods=[[origin, tuple(Q[:, k])] for k in range(3)], masses=[tuple(Q * sp.Matrix(r))], fixed=[origin])


def shares(moments: Expressions) -> list[sp.Expr]:
    """Return the entries d_k of D, HLW VII.5: the integrals of x_k^2 over the mass of the body."""
    return [sp.Add(*moments) / 2 - moment for moment in moments]


def cases(moments: Expressions) -> dict[str, Case]:
    """Return the free body that the problem ``free_rigid_body`` starts with, and a heavy top."""
    tilt = sp.Rational(11, 10)
    free = [component / moment for component, moment in zip((sp.cos(tilt), 0, sp.sin(tilt)), moments, strict=True)]
    # About the fixed point, 0.234375 + 15 * 1^2: with moments about the centre of mass D would be singular.
    top = {"I1": 15.234375, "I2": 0.46875, "I3": 15.234375, "mass": 15.0, "gravity": 9.81}
    return {
        "free": Case(
            q=tuple(sp.eye(3)), p=turning(free, moments), about="no gravity; HLW's body, from its angular momentum (cos 1.1, 0, sin 1.1)"
        ),
        "heavy_top": Case(
            q=tuple(sp.eye(3)),
            # Decimals as they are printed with the benchmark.
            p=turning((0, 150, -sp.Rational("4.61538")), moments),
            parameters=top,
            about="spinning at 150 rad/s about axis 2, which lies horizontal and precesses",
        ),
    }


def turning(omega: Expressions, moments: Expressions) -> tuple[sp.Expr, ...]:
    """Return P = Q hat(omega) D at Q = 1, row by row, of a body that turns with omega, seen from it."""
    return tuple(hat(omega) * sp.diag(*shares(moments)))


def angles(Q: sp.Matrix, P: sp.Matrix, moments: Expressions) -> Chart:
    """Return the chart of three angles, with the body's angular velocities omega = I^-1 y as their rates.

    ::

        Q = S R3(phi) R1(theta) R2(psi)      P = Q hat(omega) D

    Its poles theta = +-pi/2 are where axis 2 of the body lies along the axis (2, 3, 6)/7 of space, third column of S. This axis is chosen
    so that the free body of the case ``free`` always stays more than 15 degrees away, and the ``heavy_top`` 4.7 degrees until t = 20: with
    poles on the vertical, the axis of that top would pass through a pole at t = 0.37.
    """
    phi, theta, psi, *omega = sp.symbols("phi theta psi omega1:4", real=True)
    S = sp.Matrix([[6, -3, 2], [2, 6, 3], [-3, -2, 6]]) / 7
    turned = S * sp.rot_ccw_axis3(phi) * sp.rot_ccw_axis1(theta) * sp.rot_ccw_axis2(psi)
    body, seen = Q.T * P - P.T * Q, S.T * Q
    y = (body[2, 1], body[0, 2], body[1, 0])
    return Chart(
        eta=tuple(omega),
        xi=(phi, theta, psi),
        p=tuple(turned * hat(omega) * sp.diag(*shares(moments))),
        q=tuple(turned),
        inverse_eta=tuple(component / moment for component, moment in zip(y, moments, strict=True)),
        inverse_xi=(
            sp.atan2(-seen[0, 1], seen[1, 1]),
            sp.atan2(seen[2, 1], sp.sqrt(seen[0, 1] ** 2 + seen[1, 1] ** 2)),
            sp.atan2(-seen[2, 0], seen[2, 2]),
        ),
    )

"""A snakeboard, two steered wheels under a board with a twisting rider: without a push from outside it moves away."""

from collections.abc import Sequence

import sympy as sp

from daebench.systems.constrained import Case, ConstrainedHamiltonian, Picture


def problem(
    *,
    mass: float = 1.0,
    half_length: float = 0.5,
    board: float = 0.1,
    rider: float = 0.3,
    wheel: float = 0.05,
    rider_spring: float = 1.2,
    wheel_spring: float = 0.2,
) -> ConstrainedHamiltonian:
    """Return a snakeboard, q = (x, y, theta, psi, front, back): its wheels, at the ends of the board, roll and do not slip sideways.

    ::

        H = (p_x^2 + p_y^2) / (2 mass) + p_theta^2 / (2 board) + p_psi^2 / (2 rider) + (p_front^2 + p_back^2) / (2 wheel)
            + rider_spring (psi - theta)^2 / 2 + wheel_spring ((front - theta)^2 + (back - theta)^2) / 2
        0 = -sin(front) x' + cos(front) y' + half_length cos(front - theta) theta'
        0 = -sin(back) x'  + cos(back) y'  - half_length cos(back - theta) theta'

    All angles are from the x axis. The model is that of A. Bloch, P. Krishnaprasad, J. Marsden and R. Murray, Arch. Rational Mech.
    Anal. 136 (1996) 21-99; springs take the place of motors. The numbers are made up: rider and wheels swing at the same rate, which drives
    the board best. No momentum survives beside the energy; with wheel_spring = 0 those of the wheels do. G loses rank where both wheels are
    across the board.

    Parameters
    ----------
    mass : float
        Mass, kg.
    half_length : float
        Distance of each wheel from the centre, m.
    board, rider, wheel : float
        Moments of inertia of the board, of the rider and of each wheel about the vertical, kg m^2.
    rider_spring, wheel_spring : float
        Stiffness of the springs that turn the rider and each wheel back to the board, N m.
    """
    m, length, *inertias = sp.symbols("mass half_length board rider wheel", positive=True)
    twist, steer = sp.symbols("rider_spring wheel_spring", real=True)
    symbols = (m, length, *inertias, twist, steer)
    names = ("x", "y", "theta", "psi", "front", "back")
    q, p, v = (sp.symbols([f"{part}{name}" for name in names], real=True) for part in ("", "p_", "v_"))
    x, y, theta, psi, front, back = q
    tenth, ends = sp.Rational(1, 10), {front: length, back: -length}
    middles = {w: (x + end * sp.cos(theta), y + end * sp.sin(theta)) for w, end in ends.items()}
    return ConstrainedHamiltonian(
        q=q,
        p=p,
        v=v,
        M=sp.diag(m, m, *inertias, inertias[-1]),
        U=twist * (psi - theta) ** 2 / 2 + steer * ((front - theta) ** 2 + (back - theta) ** 2) / 2,
        g=[],
        velocity=[-sp.sin(w) * v[0] + sp.cos(w) * v[1] + end * sp.cos(w - theta) * v[2] for w, end in ends.items()],
        parameters=dict(zip(symbols, (mass, half_length, board, rider, wheel, rider_spring, wheel_spring), strict=True)),
        cases={
            "twisted": Case(q=(0, 0, 0, 5 * tenth, 3 * tenth, -3 * tenth), p=(0,) * 6, about="from rest, the rider twisted by 1/2 rad"),
            "gliding": Case(
                q=(0, 0, 0, 0, tenth, -tenth),
                p=(m, 0, inertias[0] * sp.tan(tenth) / length, 0, 0, 0),
                about="1 m/s ahead, into the turn that wheels at 1/10 rad steer",
            ),
        },
        picture=Picture(
            rods=[
                rod((x, y), length, theta),
                rod((x, y), length / 2, psi + sp.pi / 2),
                *(rod(middles[w], length / 4, w) for w in middles),
            ],
            masses=[(x, y)],
        ),
    )


def rod(middle: Sequence[sp.Expr], reach: sp.Expr, angle: sp.Expr) -> list[tuple[sp.Expr, sp.Expr]]:
    """Return the ends of a rod, from its middle, half its length and its angle from the x axis."""
    return [(middle[0] + s * reach * sp.cos(angle), middle[1] + s * reach * sp.sin(angle)) for s in (-1, 1)]

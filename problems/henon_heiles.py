"""Two coupled oscillators after Hénon and Heiles: regular at low energy, chaotic at high energy."""

import sympy as sp

from daebench.systems.constrained import Case, ConstrainedHamiltonian, Picture, coordinates
from daebench.systems.kinetic_flows import free


def problem(*, coupling: float = 1.0) -> ConstrainedHamiltonian:
    """Return the motion of a star in the plane, in the potential of Hénon and Heiles.

    ::

        H = |p|^2 / 2 + |q|^2 / 2 + coupling (q1^2 q2 - q2^3 / 3)      no constraint

    M. Hénon and C. Heiles, Astron. J. 69 (1964) 73; HLW Section I.3. With coupling = 1 motions stay inside the triangle of the three
    saddles, at energy 1/6, as long as theirs is less. Nearly all orbits of energy 1/12 are regular, at 1/8 about half of them, and few at
    1/6. All cases cross q1 = 0 with positive p1, which their energy determines, as in the surfaces of section of the paper.

    Parameters
    ----------
    coupling : float
        Factor of the cubic terms, 1/m: energies of the cases are those that are named if it is 1.
    """
    c = sp.Symbol("coupling", real=True)
    q, p = coordinates(2)
    U = (q[0] ** 2 + q[1] ** 2) / 2 + c * (q[0] ** 2 * q[1] - q[1] ** 3 / 3)
    tenth = sp.Rational(1, 10)
    starts = {
        "regular": (sp.Rational(1, 12), tenth, "energy 1/12: a regular orbit"),
        "mixed": (sp.Rational(1, 8), -tenth, "energy 1/8, where chaotic orbits are beside regular ones"),
        "chaotic": (sp.Rational(1, 6), -tenth, "energy 1/6, that of the saddles: a chaotic orbit"),
    }
    return ConstrainedHamiltonian(
        q=q,
        p=p,
        M=sp.eye(2),
        U=U,
        g=[],
        parameters={c: coupling},
        cases={name: Case(q=(0, y), p=(sp.sqrt(2 * E - y**2 + 2 * y**3 / 3), 0), about=about) for name, (E, y, about) in starts.items()},
        kinetic_flow=free(q, p, mass=1),
        picture=Picture(masses=[q], fixed=[(0, 0)]),
    )

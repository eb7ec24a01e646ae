"""Chaplygin's sleigh, a body on two skids and a blade: it keeps its energy, stops turning, and runs along its blade for ever."""

from collections.abc import Mapping, Sequence
from typing import Any

import mpmath as mp
import sympy as sp

from daebench.systems.constrained import Case, ConstrainedHamiltonian, Picture


def problem(*, mass: float = 1.0, inertia: float = 0.5, offset: float = 0.5) -> ConstrainedHamiltonian:
    """Return Chaplygin's sleigh on a horizontal plane, q = (x, y, phi), the centre of mass at a distance in front of the blade.

    ::

        H = (p_x^2 + p_y^2) / (2 mass) + p_phi^2 / (2 inertia)        0 = cos(phi) y' - sin(phi) x' - offset phi'
        u' = offset omega^2      (inertia + mass offset^2) omega' = -mass offset u omega

    u is the speed of the blade along itself. Motions with omega = 0 are stable for u > 0, and all others tend to them, though the energy
    is constant: no volume is kept. The equations are those of A. M. Bloch, *Nonholonomic Mechanics and Control*, section 1.7.

    Parameters
    ----------
    mass : float
        Mass, kg.
    inertia : float
        Moment of inertia about the centre of mass, kg m^2.
    offset : float
        Distance of the centre of mass from the blade, m; positive in front of it.
    """
    m, J, a = sp.symbols("mass inertia offset", positive=True)
    q, p = sp.symbols("x y phi", real=True), sp.symbols("p_x p_y p_phi", real=True)
    v = sp.symbols("v_x v_y omega", real=True)
    x, y, phi = q
    edge = (sp.cos(phi), sp.sin(phi))
    blade = [(x - (a + s) * edge[0], y - (a + s) * edge[1]) for s in (-a / 2, a / 2)]

    def moving(u: Any, omega: Any) -> tuple[Any, ...]:
        return (m * u, m * a * omega, J * omega)

    return ConstrainedHamiltonian(
        q=q,
        p=p,
        v=v,
        M=sp.diag(m, m, J),
        U=sp.S.Zero,
        g=[],
        velocity=[edge[0] * v[1] - edge[1] * v[0] - a * v[2]],
        parameters={m: mass, J: inertia, a: offset},
        cases={
            "turning": Case(q=(0, 0, 0), p=moving(sp.Rational(1, 2), 2), about="turning at 2 rad/s, which dies out"),
            "backwards": Case(q=(0, 0, 0), p=moving(-1, sp.Rational(1, 10)), about="blade first: unstable, it turns round"),
        },
        closed_form=closed_form,
        picture=Picture(rods=[[*blade, (x, y)]], masses=[(x, y)]),
    )


def closed_form(t: Any, q0: Sequence[Any], p0: Sequence[Any], parameters: Mapping[str, Any]) -> tuple[list[Any], list[Any]]:
    """Return the exact state (q, p) at time t, from any start on the manifold, mpmath numbers correct to mpmath's working precision.

    ::

        u = U tanh(tau)      omega = W / cosh(tau)      tau = tau0 + kappa t      kappa = mass offset U / (inertia + mass offset^2)
        phi = phi0 + beta (s - s0)      sin(s) = tanh(tau)      beta = W / kappa

    The blade is where u (cos(phi), sin(phi)) leads, by quadrature over s. Its integrand tan(s) exp(i beta s) has poles at s = +-pi/2, which
    the motion tends to; A + B sin(s), equal to exp(i beta s) there, is integrated by hand.

    Parameters
    ----------
    t : number
        Time, s; of either sign.
    q0, p0 : sequence of number, shape(3,)
        State at time 0.
    parameters : mapping of str to number
        mass, inertia and offset.
    """
    with mp.workdps(mp.mp.dps + 15):
        (x, y, phi), (p_x, p_y, p_phi), t = map(mp.mpmathify, q0), map(mp.mpmathify, p0), mp.mpmathify(t)
        m, J, a = (mp.mpmathify(parameters[name]) for name in ("mass", "inertia", "offset"))
        u, omega, about = (p_x * mp.cos(phi) + p_y * mp.sin(phi)) / m, p_phi / J, J + m * a**2
        blade = mp.mpc(x, y) - a * mp.expj(phi)
        if omega == 0:
            way, end, rate, turned = u * t, u, omega, mp.mpf(0)
        else:
            U = mp.sqrt(u**2 + about / m * omega**2)
            kappa, beta = m * a * U / about, mp.sign(omega) * mp.sqrt(about / m) / a
            tau = mp.atanh(u / U)
            ends = tau, tau + kappa * t
            end, rate = U * mp.tanh(ends[1]), beta * kappa / mp.cosh(ends[1])
            s0, s1 = (mp.atan(mp.sinh(x)) for x in ends)
            way, turned = U / kappa * mp.expj(-beta * s0) * _along(beta, ends), beta * (s1 - s0)
        place = blade + mp.expj(phi) * way + a * mp.expj(phi + turned)
        momentum = m * mp.expj(phi + turned) * mp.mpc(end, a * rate)
        q, p = [place.real, place.imag, phi + turned], [momentum.real, momentum.imag, J * rate]
    return [+value for value in q], [+value for value in p]


def _along(beta: Any, ends: tuple[Any, Any]) -> Any:
    """Return the integral of tanh(tau) exp(i beta s) over tau, from one tau to another."""
    s0, s1 = (mp.atan(mp.sinh(tau)) for tau in ends)
    A, B = mp.cos(beta * mp.pi / 2), 1j * mp.sin(beta * mp.pi / 2)

    def by_hand(tau: Any) -> Any:
        return A * mp.log(mp.cosh(tau)) + B * (tau - mp.tanh(tau))

    rest = mp.quad(lambda s: mp.tan(s) * (mp.expj(beta * s) - A - B * mp.sin(s)), [s0, s1], method="gauss-legendre")
    return rest + by_hand(ends[1]) - by_hand(ends[0])

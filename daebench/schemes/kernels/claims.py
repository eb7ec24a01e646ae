"""The claims of a scheme; the tests and the reports measure them."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

EXPANDABLE, WATER = "expandable distances", "water"
STRUCTURES = {
    EXPANDABLE: "distances between point masses, coupled so weakly that the inverse of G M^-1 G^T has an expansion",
    WATER: "the three distances of a rigid water molecule",
}
"""Structures of constraints that a scheme may require, with descriptions."""


CHARTED = ("local", "canonical")
"""Forms in which a scheme computes in the coordinates of a chart."""

MAPPED = (*CHARTED, "darboux")
"""Forms in which it computes in other coordinates than the problem's."""


@dataclass(frozen=True, kw_only=True)
class Claims:
    """The claims of a scheme, and what it needs.

    Parameters
    ----------
    order : int
        Order of convergence of q and p.
    symmetric : bool
        Whether rho∘Phi∘rho∘Phi is the identity on the manifold, rho(p, q) = (-p, q); that is symmetry where rho∘Phi_h = Phi_{-h}∘rho, HLW
        Theorem V.1.5.
    symplectic : bool
        Whether the two-form on the tangent space of the manifold is preserved.
    keeps_g, keeps_Gv : bool
        Whether g = 0, and G H_p = 0, hold to round-off after every step.
    system : str
        System that it is applied to: "constrained", HLW (1.9), "ode", the index-reduced (1.18), or a formulation of the table in METHODS.
    source : str
        Where it is defined, with the equation number.
    conserves_energy : bool
        Whether H is the same after every step, to round-off.
    separable_only : bool
        Whether it needs H = 1/2 p^T M^-1 p + U(q) with constant M.
    quadratic_only : bool
        Whether it needs H to be quadratic in p.
    needs_kinetic_flow : bool
        Whether it needs the flow of the kinetic energy on the manifold, which a problem declares.
    any_form : bool
        Whether it needs only the right side f of an ODE, so that it can be run on every form of the system.
    autonomous_only : bool
        Whether it needs a system that is independent of time and has no forces without potential.
    canonical : bool
        Whether it is symplectic for a canonical Hamiltonian ODE, and thus on the penalised system and in canonical coordinates.
    conformal : bool
        Whether the two-form contracts as exp(-c t) under a damping F = -c p, to round-off; it needs such a damping.
    constraints : str
        Required structure of the constraints: "" for any, or one of :data:`STRUCTURES`.
    imposes : bool
        Whether it differs from another scheme only in how it imposes constraints, so that there is no use for it without any.
    volume : bool
        Whether the volume dp dq of a system without constraints is preserved, although the two-form is not.
    charged_only : bool
        Whether it needs H = 1/2 (p - A(q))^T M^-1 (p - A(q)) + phi(q) with constant M, and no constraints.
    nonholonomic : bool
        Whether it is a scheme for constraints on velocities, and needs one.
    """

    order: int
    symmetric: bool
    symplectic: bool
    keeps_g: bool
    keeps_Gv: bool
    system: str
    source: str
    conserves_energy: bool = False
    separable_only: bool = False
    quadratic_only: bool = False
    needs_kinetic_flow: bool = False
    any_form: bool = False
    autonomous_only: bool = False
    canonical: bool = False
    conformal: bool = False
    constraints: str = ""
    imposes: bool = False
    volume: bool = False
    charged_only: bool = False
    nonholonomic: bool = False

    @property
    def on_manifold(self) -> bool:
        """Whether both constraints hold to round-off after every step."""
        return self.keeps_g and self.keeps_Gv


CLASSES = {
    "split": "any B, where parts of H have known flows",
    "constant": "constant B",
    "bilinear": "B(u, v) with one diagonal block: constant, or d_k linear in u_k and in v_k and H a sum of functions of one u_k or v_k",
}
"""The classes of structure matrices for which schemes are Poisson integrators, HLW Def. 4.6."""


@dataclass(frozen=True, kw_only=True)
class PoissonClaims:
    """The claims of a scheme for Poisson systems.

    Parameters
    ----------
    order : int
        Order of convergence.
    symmetric : bool
        Whether Phi_{-h} o Phi_h is the identity.
    poisson : str
        The class of structure matrices, of :data:`CLASSES`, for which it is a Poisson integrator, HLW Def. 4.6: a Poisson map that
        preserves the Casimir functions; "" if there is none.
    source : str
        Where it is defined, with the equation number.
    keeps : str
        First integrals that it conserves for any B: "linear", "quadratic", or "" for none.
    halves : bool
        Whether it treats two halves of the state differently.
    """

    order: int
    symmetric: bool
    poisson: str
    source: str
    keeps: str = ""
    halves: bool = False


def on_form(claims: Claims, form: str) -> Claims:
    """Return the claims of a scheme on a form of the system: "" is (1.18), others are those of ``daebench.methods.fixed_step.forms``."""
    if form in ("baumgarte", "soft"):
        # The feedback acts forwards in time: reversed, it would drive states away from the manifold.
        return replace(claims, symmetric=False, symplectic=False, system=form)
    if form in ("stiff", "canonical"):
        claims = replace(claims, symplectic=claims.canonical, system=form)
    return replace(claims, keeps_g=True, keeps_Gv=True, system=form) if form in CHARTED else claims


def under_forces(claims: Claims) -> Claims:
    """Return the claims of a scheme on a system with forces that have no potential: the flow itself does not preserve the two-form."""
    return replace(claims, symplectic=False)


def without_constraints(claims: Claims) -> Claims:
    """Return the claims of a scheme on a system without constraints, whose ODE (1.18) is Hamiltonian, and whose manifold is the space."""
    return replace(claims, symplectic=claims.symplectic or claims.canonical, keeps_g=True, keeps_Gv=True)


def with_velocities(claims: Claims, holonomic: int) -> Claims:
    """Return the claims on a system with constraints on velocities, of which the flow preserves no two-form, and others on positions."""
    return replace(claims, symplectic=False, keeps_g=claims.keeps_g or not holonomic)


def composed(claims: Claims, order: int) -> Claims:
    """Return the claims of a symmetric composition of this order."""
    return replace(claims, order=order)


def projected(claims: Claims, projection: str) -> Claims:
    """Return the claims of a scheme followed by a projection: "proj", or "symproj", which keeps it symmetric."""
    # Either projection moves states by their distance from the manifold, which changes the two-form and H.
    symmetric = claims.symmetric and projection == "symproj"
    return replace(claims, symmetric=symmetric, symplectic=False, keeps_g=True, keeps_Gv=True, conserves_energy=False)


@dataclass(frozen=True, kw_only=True)
class Member:
    """One scheme of a file: its claims, and the numbers that distinguish it from others in the same file.

    Parameters
    ----------
    claims : Claims
        Its claims.
    stages : int
        Number of stages, which changes the structure of the kernel.
    numbers : callable
        ``numbers(**options)`` returns the nested tuple of floats that the kernel reads as ``DATA``, for example its tableau. These are
        run-time data: other numbers need no compilation.
    options : mapping of str to float
        Free numbers and their defaults.
    multipliers : callable
        Returns the names of the stage multipliers in the order in which a step returns them, each with its node c: it belongs to
        the time t_n + c h.
    vanishing : tuple of str
        Names of stage multipliers that are zero along the exact solution, such as mu of GGL; all others approximate lam.
    simplified : bool
        Whether its iteration omits derivatives, as fixed-point iteration does, so that it may fail where solutions still exist.
    """

    claims: Claims
    stages: int = 1
    numbers: Callable[..., tuple[Any, ...]] = lambda **_: ()
    options: Mapping[str, float] = field(default_factory=dict)
    multipliers: Callable[[], Mapping[str, float]] = dict
    vanishing: tuple[str, ...] = ()
    simplified: bool = False

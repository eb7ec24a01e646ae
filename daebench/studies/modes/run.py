"""``daebench.modes``: small oscillations about an equilibrium in each formulation."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from daebench.errors import BadInput, positive
from daebench.methods.initial_value_problem import initial_value_problem
from daebench.runs.ivp import Array, ConstrainedIvp
from daebench.runs.notebook import Shown
from daebench.studies.modes.equilibrium import Equilibrium, equilibrium
from daebench.studies.modes.spectrum import DEPENDENT, Linear, Spectra, largest_real, natural, spectra, zeros
from daebench.studies.modes.step_limit import Oscillations, require_usable, usable_methods, usable_steps

if TYPE_CHECKING:
    from daebench.runs.ivp import InitialValueProblem
    from daebench.systems.constrained import ConstrainedHamiltonian

BAUMGARTE = 10.0
"""alpha and beta where none are given, 1/s, as of ``ida:baumgarte``."""

STIFFER = 1e4
"""The penalty's stiffness where none is given makes its slowest frequency about a hundred times the fastest natural one."""


@dataclass(frozen=True)
class Modes(Shown):
    """Small oscillations about an equilibrium.

    Parameters
    ----------
    ivp : ConstrainedIvp
        The problem.
    rest : Equilibrium
        The equilibrium.
    squares : ndarray, shape(n,)
        Squares of the natural frequencies, 1/s^2, in ascending order; a negative one grows, and one that is zero is a free direction.
    shapes : ndarray, shape(n, d)
        dq of each, largest entry 1.
    spectra : mapping of str to ndarray
        Eigenvalues of each formulation, 1/s.
    alpha, beta, stiff : float
        Baumgarte's numbers, 1/s, and the stiffness of the penalty.
    steps : mapping of str to float
        Largest step size that can be made and with which no oscillation grows, s, by method.
    left_out : mapping of str to str
        Why there is none of the others that were named.
    """

    drawn_by: ClassVar[str] = "daebench.studies.modes.figure"

    ivp: ConstrainedIvp
    rest: Equilibrium
    squares: Array
    shapes: Array
    spectra: Spectra
    alpha: float
    beta: float
    stiff: float
    steps: Mapping[str, float]
    left_out: Mapping[str, str]

    @property
    def frequencies(self) -> Array:
        """Natural frequencies, rad/s: imaginary parts of the eigenvalues; 0 where the square is not positive."""
        return np.sqrt(np.maximum(self.squares, 0.0))

    def summary(self) -> dict[str, Any]:
        """Return what was found, for JSON."""
        about = {"problem": self.ivp.problem, "case": self.ivp.case, "parameters": dict(self.ivp.parameters)}
        formulations = {
            name: {
                "eigenvalues": [[float(x.real), float(x.imag)] for x in found],
                "zeros": zeros(found),
                "largest_real": largest_real(found),
                "fastest": float(np.max(np.abs(found), initial=0.0)),
            }
            for name, found in self.spectra.items()
        }
        return about | {
            "q": self.rest.q,
            "lam": self.rest.lam,
            "residual": self.rest.residual,
            "frequencies": self.frequencies,
            "squares": self.squares,
            "shapes": self.shapes,
            "formulations": formulations,
            "alpha": self.alpha,
            "beta": self.beta,
            "stiff": self.stiff,
            "steps": {name: None if h == float("inf") else h for name, h in self.steps.items()},
            "left_out": dict(self.left_out),
        }


def modes(
    problem: "str | ConstrainedHamiltonian | InitialValueProblem",
    *,
    case: str | None = None,
    parameters: Mapping[str, float] | None = None,
    alpha: float | None = None,
    beta: float | None = None,
    stiff: float | None = None,
    methods: Sequence[str] | None = None,
    on_singular: str | None = None,
) -> Modes:
    """Return natural frequencies at an equilibrium, the spectrum of each formulation there, and the step limits of schemes.

    The equilibrium is found by a descent of the potential energy on the manifold. The spectrum of index 3 and of GGL has only the natural
    frequencies. Index 2 has m zeros in addition, index 1 and the reduced ODE 2 m: these are the directions in which they drift. Baumgarte's
    stabilisation moves each pair to the roots of s^2 + 2 alpha s + beta^2, and a penalty turns it into fast oscillations::

        >>> import daebench
        >>> found = daebench.modes("planar_pendulum", parameters={"gravity": 4.0}, methods=["rattle"])
        >>> [float(round(x, 9)) for x in found.frequencies], round(float(found.steps["rattle"]), 3)
        ([2.0], 1.0)

    Parameters
    ----------
    problem : str, ConstrainedHamiltonian or InitialValueProblem
        Name in the catalogue, the path of a problem file, which is executed, a definition, or an initial value problem.
    case : str, optional
        Named initial values, from which the search begins; by default the problem's first.
    parameters : mapping of str to float, optional
        Values of the problem's parameters.
    alpha, beta : float, optional
        Of Baumgarte's stabilisation, 1/s; by default both 10, as in ``ida:baumgarte``.
    stiff : float, optional
        Stiffness k of the penalty k |g|^2 / 2; by default one that makes oscillations a hundred times as fast as the fastest natural one.
    methods : sequence of str, optional
        Fixed-step methods whose step limit is computed; by default some that are for the problem.
    on_singular : str, optional
        What to do where G loses rank: "stop", "continue" or "least-squares"; by default what the case declares.

    Returns
    -------
    Modes

    Raises
    ------
    BadInput
        If there is no equilibrium, or the problem depends on time, has forces, is a Poisson system, or has arrays as vectors, or a method
        chooses its steps itself or is not for the problem.
    """
    ivp = initial_value_problem(problem, case, parameters, on_singular=on_singular, consistent=False)
    if not ivp.on_manifold or ivp.arrays or ivp.facts.EXTENDED:
        what = "a Poisson system" if not ivp.on_manifold else "held as arrays" if ivp.arrays else "in time or under forces"
        raise BadInput(f"modes need a constrained problem with constant energy and few positions, and {ivp.problem} is {what}.")
    for name, value in (("alpha", alpha), ("beta", beta), ("stiff", stiff)):
        if value is not None:
            positive(name, value)
    names = usable_methods(ivp) if methods is None else tuple(methods)
    require_usable(ivp, names)
    rest = equilibrium(ivp)
    system = Linear.at(ivp, rest)
    squares, shapes, momenta = natural(system)
    oscillates = squares > 0
    about = Oscillations(ivp, rest.q, np.sqrt(squares[oscillates]), shapes[oscillates], momenta[oscillates])
    fastest = float(np.sqrt(np.max(np.abs(squares), initial=0.0))) or 1.0
    alpha, beta = alpha or BAUMGARTE, beta or BAUMGARTE
    pulls = np.linalg.eigvalsh(system.G @ system.H_pp @ system.G.T)
    stiff = stiff or STIFFER * fastest**2 / float(np.min(pulls[pulls > DEPENDENT * pulls[-1]]))
    found = spectra(system, alpha=alpha, beta=beta, stiff=stiff)
    steps, left_out = usable_steps(about, names)
    return Modes(ivp, rest, squares, shapes, found, alpha, beta, stiff, steps, left_out)

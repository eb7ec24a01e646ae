"""SUNDIALS IDA on every formulation, with treatments of the multipliers, without which its error test fails."""

from collections.abc import Collection, Mapping
from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from daebench.errors import BadInput
from daebench.methods.formulations.chain import pose_banded, refused
from daebench.methods.formulations.constrained import Dae, Posed, pose
from daebench.methods.formulations.table import FORMULATIONS
from daebench.methods.no_constraint import nothing_to
from daebench.methods.solvers import sundials
from daebench.methods.solvers.constrained_run import OnConstrained
from daebench.methods.solvers.drive import Advance, Array
from daebench.methods.solvers.error_test import TreatedMultipliers, of_declared_unknowns
from daebench.methods.solvers.least_squares import reduced
from daebench.methods.solvers.monitor import Monitor
from daebench.methods.solvers.native import run as native
from daebench.runs.directions import require_tuples
from daebench.runs.ivp import ConstrainedIvp
from daebench.runs.request import Request

DEFAULT_TREATMENTS = {"index3": "atol", "index2": "derivative", "index1": "atol", "ggl": "derivative", "baumgarte": "atol", "ode": "none"}


@dataclass(frozen=True)
class Ida(TreatedMultipliers, OnConstrained):
    """IDA, variable-order BDF in double precision, with the analytic Jacobian and a dense linear solver.

    On long chains the linear solver is that of banded matrices, and the Jacobian IDA's own difference quotient, of as many residuals as
    the band is wide: scikit-sundae takes analytic entries of a band in the places of a dense matrix only.

    Derivatives in k directions are k n unknowns more, whose errors are tested as those of the unknowns are; the matrix of Newton's
    iteration, with second derivatives of the equations in it, is factorised as a whole.

    The local error estimate of a multiplier can be hundreds of times that of a velocity: under the plain settings index 3 stops
    at t = 0 at every tolerance, and index 2 and ``ggl`` collapse to order 1. Two treatments, and one to compare with:

    - ``atol``: an absolute tolerance of 1e20 on lam and mu, for index 3 on v too;
    - ``derivative``: the unknown is Lam with Lam' = lam, so that the multiplier enters as a derivative;
    - ``suppress``: the same unknowns are left out of the error test by IDASetSuppressAlg. Newton's iteration still waits for them to
      converge within their tolerances, which rounding does not allow at tight ones: at 1e-12 and less runs stop.
    """

    differentiable: ClassVar = True
    options: Mapping[str, float] | None = field(default=None, hash=False)
    """Free numbers of the formulation, as for :func:`daebench.methods.formulations.constrained.pose`."""
    kind: ClassVar = "formulation"
    formulations: ClassVar = FORMULATIONS
    default_treatments: ClassVar = DEFAULT_TREATMENTS

    @property
    def combines(self) -> bool:
        """Whether it takes combinations of redundant constraints: where multipliers are unknowns, which must be determined."""
        return self.formulation != "ode"

    def refusal(self, ivp: ConstrainedIvp) -> str | None:
        """Return why the formulation cannot be had, as a sentence, or None: on a chain not ``ode``, without constraints only that."""
        if self.formulation == "ode":
            return refused(self.name, ivp)
        if ivp.nonholonomic and (self.formulation == "index3" or (self.formulation == "ggl" and not ivp.holonomic)):
            return f"{self.name} is for constraints on positions, and {ivp.problem} has one on velocities; use ida:index2."
        return nothing_to("impose", self.name, ivp, "use ida:ode")

    def check(self, ivp: ConstrainedIvp, request: Request) -> None:
        """Accept a request that can be met; raise :class:`BadInput` otherwise."""
        super().check(ivp, request)
        self.check_treatment(request)
        if request.sensitivities:
            require_tuples(self.name, ivp)
            if self.formulation == "ode":
                raise BadInput(
                    f"{self.name} has no sensitivities, because it has no equations for lam; use ida:index2.", "ida-without-sensitivities"
                )
        if self.combines and self.least_squares(ivp, request):
            raise BadInput(
                f"{self.name} has the multipliers among its unknowns: it combines constraints that are redundant everywhere, and here "
                f"there are none; for least-squares where G loses rank on the way use ida:ode or a fixed-step method such as rattle.",
                "multipliers-redundant",
            )

    def _posed(self, ivp: ConstrainedIvp) -> Dae:
        if self.formulation == "ode":
            return reduced(ivp)
        posed = pose_banded if ivp.arrays else pose
        return posed(ivp, self.formulation, self.options, multipliers=self.multipliers)

    @property
    def untested(self) -> Collection[str]:
        """Multipliers, and velocities too for ``index3``, where a position's error is divided by the step."""
        return ("lam", "mu", "v") if self.formulation == "index3" else ("lam", "mu")

    @property
    def _advice(self) -> str:
        return self.treatment_advice or "use a larger tol or another formulation, and see whether G keeps its rank"

    def _begin(self, dae: Dae, tol: float, monitor: Monitor) -> Advance:
        rtol, atol = of_declared_unknowns(dae, tol, self.tolerances(dae, tol))
        return begin(dae, rtol, atol, monitor, self.suppressed(dae))


def begin(posed: Posed, tol: float, atol: Array, monitor: Monitor, suppressed: NDArray[np.bool_] | None = None) -> Advance:
    """Compile the functions of a run, and return how IDA goes through output times.

    Shapes: atol (n,); suppressed (n,).
    """
    settings = native.PLAIN if suppressed is None else native.Settings(suppressed=suppressed)
    return native.begin(posed, native.IDA, tol, atol, monitor, settings) or sundials.ida(posed, tol, atol, monitor)

"""SUNDIALS IDA on Poisson systems: as implicit residuals, and as DAEs that keep the Casimir functions."""

import time
from dataclasses import dataclass

import numpy as np

from daebench.errors import BadInput, unknown
from daebench.method import Request
from daebench.poisson_pose import FORMULATIONS, PoissonDae, pose_poisson, without_casimirs
from daebench.reference.ida import CURES, UNTESTED, begin
from daebench.reference.meter import Meter
from daebench.reference.poisson import ADVICE, accept, poisson_trajectory, refused
from daebench.reference.tolerance import Advance, Array, drive
from daebench.scene import PoissonScene, Setting
from daebench.trajectory import PoissonTrajectory

DEFAULT_CURES = {"casimirs": "derivative", "ode": "none"}


@dataclass(frozen=True)
class PoissonIda:
    """IDA on a Poisson system, with the analytic Jacobian and a dense linear solver.

    The multipliers of ``casimirs`` are zero along the motion and nothing but the numerical error drives them, and yet they spoil the
    error test: without a cure IDA stops at the start at tolerances of 1e-10 and less, and takes 400 times as many steps at 1e-6.
    Two cures, as for constrained problems, of which the second takes fewer steps:

    - ``atol``: an absolute tolerance of 1e20 on mu;
    - ``derivative``: the unknown is Mu with Mu' = mu, so that the multiplier enters as a derivative.

    Parameters
    ----------
    formulation : str
        One of ``daebench.poisson_pose.FORMULATIONS``.
    cure : str, optional
        "derivative", "atol" or "none"; by default the better one for the formulation. ``ode`` has no multiplier to cure.

    Raises
    ------
    BadInput
        If the formulation or the cure is unknown, or a cure is asked for on ``ode``.
    """

    formulation: str
    cure: str | None = None
    knob = "tol"

    def __post_init__(self) -> None:
        if self.formulation not in FORMULATIONS:
            raise unknown("formulation of Poisson systems", self.formulation, FORMULATIONS)
        if self.cure is not None and self.cure not in CURES:
            raise unknown("cure", self.cure, CURES)
        if self.formulation == "ode" and self.cure not in (None, "none"):
            raise BadInput(f"ode has no multipliers, so there is nothing for {self.cure} to cure; leave the cure out.")

    @property
    def name(self) -> str:
        """Name in the grammar of methods: ida:formulation, or ida:formulation:cure where the cure is not the default."""
        default = self._cure == DEFAULT_CURES[self.formulation]
        return f"ida:{self.formulation}" if default else f"ida:{self.formulation}:{self._cure}"

    @property
    def _cure(self) -> str:
        return self.cure or DEFAULT_CURES[self.formulation]

    def refusal(self, scene: Setting) -> str | None:
        """Return why the method cannot be used on this problem, as a sentence, or None."""
        if wrong := refused(self.name, scene):
            return wrong
        return without_casimirs(scene) if self.formulation == "casimirs" and not scene.sheet.CASIMIRS else None

    def check(self, scene: PoissonScene, request: Request) -> None:
        """Accept a request that can be met; raise :class:`BadInput` otherwise."""
        accept(self.name, self.refusal(scene), request)

    def solve(self, scene: PoissonScene, request: Request) -> PoissonTrajectory:
        """Return the trajectory; where IDA stops early, the outputs so far and why.

        Raises
        ------
        BadInput
            If the request cannot be met, see :func:`daebench.reference.poisson.accept`.
        DaebenchError
            If multipliers are not determined at the start, see :func:`daebench.poisson_pose.pose_poisson`.
        """
        began = time.perf_counter()
        self.check(scene, request)
        dae = pose_poisson(scene, self.formulation, multipliers="derivative" if self._cure == "derivative" else "plain")
        found = drive(self.name, dae, request, lambda meter: self._begin(dae, request.value, meter), began=began, advice=self._advice)
        return poisson_trajectory(dae, request, found)

    @property
    def _advice(self) -> str:
        if self._cure == "none" and self.formulation != "ode":
            return "take the multipliers out of the error test with the cure derivative or atol"
        return ADVICE

    def _atol(self, dae: PoissonDae, tol: float) -> Array:
        """Return the absolute tolerances, shape(n,)."""
        atol = np.full(dae.n, tol)
        if self._cure == "atol":
            atol[dae.blocks["mu"]] = UNTESTED
        return atol

    def _begin(self, dae: PoissonDae, tol: float, meter: Meter) -> Advance:
        return begin(dae, tol, self._atol(dae, tol), meter)

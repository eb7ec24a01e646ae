"""SUNDIALS CVODE, Adams or BDF, on the index-reduced ODE, and BDF with each step projected onto the constraints."""

import types
from dataclasses import dataclass

import numpy as np

from daebench.compiler.written import Wrapper
from daebench.errors import BadInput, unknown
from daebench.methods.formulations.constrained import Dae, Posed
from daebench.methods.no_constraint import nothing_to
from daebench.methods.solvers import sundials
from daebench.methods.solvers.constrained_run import OnReducedOde
from daebench.methods.solvers.drive import Advance, require_native
from daebench.methods.solvers.error_test import of_declared_unknowns
from daebench.methods.solvers.monitor import Monitor
from daebench.methods.solvers.native import run as native
from daebench.methods.solvers.variants import CVODE, PROJECTED
from daebench.runs.ivp import ConstrainedIvp, Ivp
from daebench.runs.request import Request
from daebench.runs.scales import constrained_scales


class Cvode(OnReducedOde):
    """CVODE, "adams" (orders 1 to 12) or "bdf" (orders 1 to 5), with a dense linear solver."""

    solver = "cvode"
    tells_steps = True
    variants = CVODE

    def _begin(self, dae: Posed, tol: float, monitor: Monitor) -> Advance:
        family = native.BDF if self.variant == "bdf" else native.ADAMS
        rtol, atol = of_declared_unknowns(dae, tol, np.full(dae.n, tol))
        return native.begin(dae, family, rtol, atol, monitor) or sundials.cvode(dae, self.variant, rtol, atol, monitor)


@dataclass(frozen=True)
class ProjectedCvode(OnReducedOde):
    """CVODE's BDF, orders 1 to 5, whose steps end with a projection onto g = 0 and then onto G H_p = 0, both in the metric of M.

    The corrector's result is projected before the error test, and so is the estimate that is tested, by CVodeSetProjFn and
    CVodeSetProjErrEst. It is the ends of steps that are on the manifold to round-off; outputs between them are interpolated, and near to it
    by the tolerance.
    """

    solver = "cvode"
    tells_steps = True
    variants = (PROJECTED,)

    @classmethod
    def of(cls, family: str, manner: str) -> "ProjectedCvode":
        """Return the method of the names after "cvode:"."""
        if family not in CVODE:
            raise unknown("method of cvode", family, CVODE)
        if manner != "projected":
            raise unknown("treatment of cvode's steps", manner, ["projected"])
        if family != "bdf":
            raise BadInput(
                f"CVODE projects only steps of BDF, not of {family}; use cvode:{PROJECTED}, or leave out :projected.",
                "cvode-projects-only-bdf",
            )
        return cls(PROJECTED)

    def lacks(self, ivp: Ivp) -> str | None:
        """Return why it cannot solve the ODE of a problem, as a sentence, or None: there may be no constraint to project onto."""
        return nothing_to("project onto", self.name, ivp, "use cvode:bdf")

    @property
    def combines(self) -> bool:
        """Whether it takes combinations of redundant constraints: it projects onto independent ones."""
        return True

    def check(self, ivp: ConstrainedIvp, request: Request) -> None:
        """Accept a request that can be met; raise :class:`BadInput` otherwise."""
        super().check(ivp, request)
        require_native(self.name, "has no way to project steps", request)
        if self.least_squares(ivp, request):
            raise BadInput(
                f"{self.name} projects onto independent constraints, and none is redundant everywhere here; for least-squares where G "
                f"loses rank on the way use cvode:bdf or a fixed-step method such as rattle.",
                "cvode-projects-redundant",
            )

    def _begin(self, dae: Dae, tol: float, monitor: Monitor) -> Advance:
        length, _ = constrained_scales(dae.ivp, 0.0, rated=False)
        settings = native.Settings(projection=projection(dae).projection_callback, length=length)
        rtol, atol = of_declared_unknowns(dae, tol, np.full(dae.n, tol))
        advance = native.begin(dae, native.BDF, rtol, atol, monitor, settings)
        if advance is None:
            raise BadInput(
                f"{self.name} needs compiled callbacks, which {dae.ivp.problem} does not have here; use cvode:bdf.", "cvode-needs-callbacks"
            )
        return advance

    @property
    def _advice(self) -> str:
        return "use a larger tol or cvode:bdf, and see whether G keeps its rank"


KERNEL = "daebench.schemes.kernels.solver_projection"

CALLED_BACK = """
def with_length(values, length):
    return ({parameters}(length, 0.0),)


def projection_callback(t, y, correction, epsilon, error, user):
    own = carray(real_pointer(user), HEAD + {k})
    own[PROJECTIONS] += 1.0
    y = carray(numbers_of_vector(user, y), {n})
    correction = carray(numbers_of_vector(user, correction), {n})
    error = carray(numbers_of_vector(user, error), {n})
    par = with_length(own[HEAD:], own[LENGTH])
    {change} = solver_projection_{kernel}({arguments}, par)
    if report[0] != 0:
        return 1
    {assignments}
    return 0
"""
"""A result other than 0 has CVODE try a smaller step; behind the parameters stand length and rate, as schemes have them."""


def projection(posed: Dae) -> types.ModuleType:
    """Return the module with ``projection_callback``, for a problem as HLW (1.18)."""
    ivp = posed.ivp
    kernel = "of_velocities" if posed.mechanical else "of_momenta"
    wrapper = Wrapper(_text(posed.d, len(ivp.par), kernel), ())
    title = f"The projection of steps of {ivp.problem}."
    return ivp.source.linked("projection", title, [(KERNEL, kernel)], wrapper=wrapper)


def _text(d: int, k: int, kernel: str) -> str:
    """Return the source of the C function for d positions and k parameters."""

    def part(array: str, start: int) -> str:
        return f"({''.join(f'{array}[{i}], ' for i in range(start, start + d))})"

    targets = {"d_w": ("correction", d), "d_q": ("correction", 0), "error_w": ("error", d), "error_q": ("error", 0)}
    return CALLED_BACK.format(
        kernel=kernel,
        k=k,
        n=2 * d,
        parameters="".join(f"values[{i}], " for i in range(k)),
        change=", ".join([*targets, "report"]),
        arguments=", ".join(part(array, start) for array in ("y", "error") for start in (d, 0)),
        assignments="\n    ".join(f"{array}[{start + i}] = {name}[{i}]" for name, (array, start) in targets.items() for i in range(d)),
    )

"""Methods for Poisson systems realised on a constrained system: its trajectory is mapped to the Poisson system, HLW VII.5.3."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np

from daebench.errors import BadInput, RunFailed
from daebench.methods.fixed_step.constrained import FixedStep
from daebench.methods.fixed_step.forms import LIFTED
from daebench.methods.fixed_step.poisson import require_poisson
from daebench.methods.initial_value_problem import initial_value_problem
from daebench.methods.monitored_errors import output_maxima
from daebench.runs.ivp import ConstrainedIvp, InitialValueProblem, Ivp, PoissonIvp
from daebench.runs.make_ivp import constrained
from daebench.runs.request import Method, Request
from daebench.runs.trajectory import Array, Outcome, PoissonTrajectory, Trajectory
from daebench.systems.lazily import sympy as sp


@dataclass(frozen=True)
class Lifted:
    """A fixed-step method for constrained problems, run on a Poisson system that declares a :class:`daebench.systems.poisson.Lift`.

    ::

        (q, p)(y0)  --- method --->  (q_n, p_n)  --->  y_n = y(p_n, q_n)

    On the rotation matrices of Euler's equations ``rattle`` is the discrete Moser-Veselov algorithm of HLW VII.5.3.
    """

    method: FixedStep
    """The method on the constrained system."""
    knob = "h"

    @classmethod
    def of(cls, method: Method[ConstrainedIvp, Trajectory]) -> "Lifted":
        """Return a method realised on the constrained system; raise :class:`BadInput` where it chooses its own steps."""
        if not isinstance(method, FixedStep):
            raise BadInput(
                f"{LIFTED}: needs a fixed-step method, and {method.name} chooses its own steps; run it without {LIFTED}:, or "
                f"{LIFTED}:rattle.",
                "lifted-needs-fixed-step",
            )
        return cls(method)

    @property
    def name(self) -> str:
        """Name in the grammar of methods."""
        return f"{LIFTED}:{self.method.name}"

    @property
    def order(self) -> int:
        """Order of convergence that the method on the constrained system claims."""
        return self.method.claims.order

    def is_poisson(self, ivp: InitialValueProblem) -> bool:
        """Return whether the method claims to be a Poisson integrator: whether it is symplectic on the manifold above."""
        claims = self.method.claims
        return bool(ivp.facts.LIFT) and claims.symplectic and claims.on_manifold

    def keeps(self, ivp: InitialValueProblem) -> tuple[str, ...]:
        """Return the names of the conserved quantities that the method claims to keep to round-off: the Casimir functions, or none."""
        return tuple(ivp.facts.CASIMIRS) if self.is_poisson(ivp) else ()

    def refusal(self, ivp: Ivp) -> str | None:
        """Return why the method cannot be used on this problem, as a sentence, or None."""
        if ivp.on_manifold:
            return f"{self.name} is for Poisson systems, and {ivp.problem} is {ivp.state.words}; leave out {LIFTED}:."
        if not ivp.facts.LIFT:
            return f"{self.name} needs a constrained system that maps to {ivp.problem}, which declares none; use strang."
        up = above(ivp)
        if not np.isfinite(float(up.value("H", up.p0, up.q0))):
            reason = f"the energy of {up.problem} above is not finite at these parameters, as where its mass matrix is singular"
            return f"{self.name}: {reason}; use strang."
        why = self.method.refusal(up)
        return f"{self.name} on {ivp.problem}: {why}" if why else None

    def check(self, ivp: PoissonIvp, request: Request) -> None:
        """Accept a request that can be met; raise :class:`BadInput` otherwise."""
        if refusal := self.refusal(ivp):
            raise BadInput(refusal, "method-refuses-problem")
        require_poisson(self.name, request)
        self.method.check(above(ivp), replace(request, watch=()))

    def solve(self, ivp: PoissonIvp, request: Request) -> PoissonTrajectory:
        """Return the trajectory; if the method stops early, the states so far and the reason.

        Maxima of errors are over the outputs, and are marked so; work is that of the method on the constrained system.
        """
        self.check(ivp, request)
        # Nothing is monitored above: errors of y are those of the mapped states.
        trajectory = _mapped_down(self.name, ivp, self.method.solve(above(ivp), replace(request, watch=())))
        return replace(trajectory, maxima=output_maxima(ivp, request.watched(ivp.state), trajectory.y))

    def flow(self, ivp: PoissonIvp, h: float, steps: int) -> Callable[[Sequence[complex]], Array]:
        """Return the map y -> y of ``steps`` steps for complex states, exact to first order in the imaginary part.

        The map raises :class:`RunFailed` where the method has no solution.
        """
        rise, (inner, down) = _rising(ivp), (self.method.flow(above(ivp), h, steps), _falling(ivp))

        def phi(y: Sequence[complex]) -> Array:
            try:
                return np.array(down(*inner(*rise(y))))
            except RunFailed as error:
                raise RunFailed(_told(self.name, ivp, str(error)), "lifted-map-has-no-solution") from error

        return phi


def above(ivp: PoissonIvp) -> ConstrainedIvp:
    """Return the problem of the constrained system above, which starts from (q, p)(y0) with the parameters of the same names."""
    lift = _definition(ivp).lift
    p0, q0 = _rising(ivp)(ivp.y0)
    return constrained(initial_value_problem(lift.problem, None, ivp.parameters, consistent=False)).at(*map(np.array, (p0, q0)))


def _definition(ivp: PoissonIvp) -> Any:
    return ivp.source.derivation.problem


def _rising(ivp: PoissonIvp) -> Callable[[Any], tuple[Any, Any]]:
    """Return the map y -> (p, q), for real and complex states."""
    definition = _definition(ivp)
    expressions = [list(definition.lift.p), list(definition.lift.q)]
    up = sp.lambdify([list(definition.y), list(definition.parameters)], expressions, "numpy", cse=True)

    def rise(y: Any) -> tuple[Any, Any]:
        p, q = up(np.asarray(y), ivp.par)
        return np.array(p), np.array(q)

    return rise


def _falling(ivp: PoissonIvp) -> Callable[[Any, Any], Sequence[Any]]:
    """Return the map (p, q) -> y, of numbers or of columns of them."""
    lift = _definition(ivp).lift
    return lambda p, q: lift.y(p, q, ivp.parameters)


def _mapped_down(name: str, ivp: PoissonIvp, run: Trajectory) -> PoissonTrajectory:
    outcome = {field.name: getattr(run, field.name) for field in fields(Outcome)} | {"looks": None}
    outcome |= {"problem": ivp.problem, "case": ivp.case, "method": name, "parameters": dict(ivp.parameters)}
    failure = _told(name, ivp, run.failure) if run.failure else None
    y = np.array(_falling(ivp)(run.p.T, run.q.T), dtype=float).T
    # The start as it was given: the way up and down rounds it.
    y[0] = ivp.y0
    return PoissonTrajectory(**outcome | {"failure": failure, "maxima_over": "outputs"}, y=y)


def _told(name: str, ivp: PoissonIvp, failure: str) -> str:
    return f"{name} on {ivp.problem}, case {ivp.case}: {failure}"

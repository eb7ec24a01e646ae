"""Fixed-step methods for Poisson systems: a scheme on a form of the system, with a splitting, composed, linked to a problem and run."""

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from daebench.compiler.facts import POISSON_WORK
from daebench.errors import BadInput, require_known
from daebench.methods.fixed_step.base import FixedStepMethod
from daebench.methods.fixed_step.compositions import COMPOSITIONS
from daebench.methods.fixed_step.forms import POISSON_FORMS
from daebench.methods.fixed_step.reasons import REASONS
from daebench.methods.fixed_step.stepping import Run
from daebench.methods.monitored_errors import monitored_names
from daebench.methods.registry import poisson_registry
from daebench.runs.grid import Grid
from daebench.runs.ivp import InitialValueProblem, PoissonIvp
from daebench.runs.request import Request
from daebench.runs.scales import in_coordinates, poisson_scales
from daebench.runs.trajectory import PoissonTrajectory
from daebench.schemes.kernels.claims import CLASSES, PoissonClaims

RUN_AWAY = "use a smaller h, and check whether the motion itself diverges there"
LEFT = {3: ("a value is no longer finite", RUN_AWAY), 6: ("the state has left the domain {domain}", RUN_AWAY)}
"""Why a step of a Poisson system is refused besides :data:`daebench.methods.fixed_step.reasons.REASONS`, and what to do."""


@dataclass(frozen=True)
class PoissonStep(FixedStepMethod[PoissonIvp, PoissonTrajectory]):
    """A scheme of ``daebench.schemes.poisson`` run with constant step size."""

    scheme: str
    """Name of the scheme."""
    form: str = ""
    """"" for the system's own coordinates, or a name in :data:`daebench.methods.fixed_step.forms.POISSON_FORMS`."""
    splitting: str = ""
    """Name of one of the problem's splittings; "" for its first."""
    composition: str = ""
    """"" or a name in :data:`daebench.methods.fixed_step.compositions.COMPOSITIONS`."""
    anyway: bool = False
    """Whether a scheme may be run on a system outside of the class for which it is a Poisson integrator."""
    compiled: bool = True
    """Whether the kernel is compiled."""
    counted = POISSON_WORK

    def __post_init__(self) -> None:
        require_known(
            ("scheme for Poisson systems", self.scheme, poisson_registry()),
            ("form of Poisson systems", self.form, POISSON_FORMS),
            ("composition", self.composition, COMPOSITIONS),
        )
        claims = self.member
        if self.composition and (not claims.symmetric or claims.order != 2):
            raise BadInput(
                f"{self.composition} composes symmetric methods of order 2, which {self.scheme} is not; use strang, verlet or midpoint.",
                "composition-needs-order-two",
            )
        if self.splitting and claims.poisson != "split":
            raise BadInput(f"{self.scheme} does not split H; leave out @{self.splitting}.", "scheme-does-not-split")
        if self.form and claims.poisson == "split":
            raise BadInput(
                f"{self.scheme} uses the flows in the system's own coordinates; leave out {self.form}:, or use verlet there.",
                "scheme-in-own-coordinates",
            )

    @property
    def name(self) -> str:
        """Name in the grammar of methods."""
        base = f"{self.form}:{self.scheme}" if self.form else self.scheme
        return base + (f"@{self.splitting}" if self.splitting else "") + (f"/{self.composition}" if self.composition else "")

    @property
    def member(self) -> PoissonClaims:
        """The claims of the scheme itself."""
        return poisson_registry()[self.scheme]

    @property
    def order(self) -> int:
        """Order of convergence that the whole method claims."""
        return COMPOSITIONS[self.composition].order if self.composition else self.member.order

    def is_poisson(self, ivp: InitialValueProblem) -> bool:
        """Return whether the method claims to be a Poisson integrator for this system: whether B is of the class that it states."""
        kind, facts = self.member.poisson, ivp.facts
        # In canonical coordinates every symplectic scheme is a Poisson integrator, HLW VII.4.3.
        if self.form == "darboux":
            return bool(kind)
        return bool({"split": facts.SPLITTINGS, "constant": facts.CONSTANT, "bilinear": facts.BILINEAR, "": False}[kind])

    def keeps(self, ivp: InitialValueProblem) -> tuple[str, ...]:
        """Return the names of the conserved quantities that the method claims to keep to round-off: "energy", Casimirs, integrals."""
        # In canonical coordinates linear and quadratic integrals are of another form, and are not kept.
        integrals = {"linear": ivp.facts.LINEAR, "quadratic": ivp.facts.QUADRATIC, "": ()}["" if self.form else self.member.keeps]
        casimirs = ivp.facts.CASIMIRS if self.is_poisson(ivp) or self.form == "darboux" else ()
        return tuple(dict.fromkeys((*casimirs, *integrals)))

    def refusal(self, ivp: InitialValueProblem) -> str | None:
        """Return why the method cannot be used on this problem, as a sentence, or None."""
        claims, facts = self.member, ivp.facts
        if ivp.on_manifold:
            return f"{self.name} is for Poisson systems, and {ivp.problem} is {ivp.state.words}; use rattle."
        if self.form == "darboux" and not facts.DARBOUX:
            return f"{self.name} needs canonical coordinates, which {ivp.problem} does not declare; leave out darboux:."
        if claims.poisson == "split" and not facts.SPLITTINGS:
            return f"{self.name} needs parts of H with known flows, which {ivp.problem} does not declare; use midpoint --anyway, or rk4."
        if self.splitting and self.splitting not in facts.SPLITTINGS:
            return f"{ivp.problem} has no splitting {self.splitting!r}; it has {', '.join(facts.SPLITTINGS)}."
        if claims.halves and not facts.HALVES and not self.form:
            return f"{self.name} needs a state in two halves, and {ivp.problem} has {facts.N} coordinates; use strang."
        if claims.poisson and not self.anyway and not self.is_poisson(ivp):
            what = CLASSES[claims.poisson]
            return f"{self.name} is a Poisson integrator for {what} only, which {ivp.problem} does not have; --anyway runs it all the same."
        return None

    def _require(self, ivp: PoissonIvp, request: Request) -> None:
        require_poisson(self.name, request)

    @property
    def scheme_module(self) -> str:
        """Name of the module that the scheme is in."""
        return f"daebench.schemes.poisson.{self.scheme}"

    def _derivation(self, ivp: PoissonIvp) -> Any:
        if self.form:
            return ivp.source.form(self.form)
        return ivp.source.split(self.splitting or next(iter(ivp.facts.SPLITTINGS), "") if self.member.poisson == "split" else "")

    def _coordinates(self, ivp: PoissonIvp) -> tuple[Callable[[Sequence[Any]], Any], Callable[[Any], Sequence[Any]]]:
        if not self.form:
            return lambda vectors: vectors[0], lambda y: (y,)
        enter, leave = coordinates(ivp)
        return lambda vectors: enter(vectors[0]), lambda x: (leave(x),)

    def _scales(self, ivp: PoissonIvp, h: float) -> tuple[float, float]:
        scales = poisson_scales(ivp, h)
        if self.form and not ivp.arrays:  # whose map would have to be compiled for complex numbers first, and stretches little
            enter, leave = coordinates(ivp)
            return in_coordinates(scales, leave, (enter(ivp.y0),), 0)
        return scales

    def _reasons(self, ivp: PoissonIvp) -> Mapping[int, tuple[str, str]]:
        domain = " and ".join(f"{function} > 0" for function in ivp.facts.DOMAIN)
        return REASONS | {status: (why.replace("{domain}", domain), advice) for status, (why, advice) in LEFT.items()}

    def _trajectory(self, ivp: PoissonIvp, request: Request, run: Run) -> PoissonTrajectory:
        outcome, (t, y) = run.outcome(), run.states()
        return PoissonTrajectory(**outcome, t=t, y=y, sensitivities=self._sensitivities(run, len(t), y=slice(ivp.size)))

    def _ready(self, ivp: PoissonIvp, request: Request, grid: Grid, monitored: tuple[str, ...]) -> Callable[..., Run]:
        began = time.perf_counter()
        kernel = self.kernel(ivp, self._number(ivp, request), monitored, count=request.count)
        linked = self._differentiated(ivp, request, grid, kernel)
        return partial(Run, linked, ivp, request, grid, names=monitored_names(monitored, ivp), linking=[time.perf_counter() - began])


def require_poisson(name: str, request: Request) -> None:
    """Refuse requests that have no meaning for a Poisson system; raise :class:`BadInput`."""
    for wrong, what in ((request.multipliers, "multipliers lam(p, q)"), (request.raw, "stage multipliers")):
        if wrong:
            raise BadInput(f"{name} runs on a Poisson system, which has no {what}; leave them out.", "poisson-lacks-request")
    if request.precision == "mixed":
        raise BadInput(
            f"{name} runs on a Poisson system, which has no forces to compute in single precision; use float64 or float32.",
            "poisson-in-single-precision",
        )
    if request.watch and "manifold" in request.watch:
        raise BadInput(
            "a Poisson system has no constraints to monitor; monitor energy, casimirs or integrals.", "poisson-has-no-constraints"
        )


def coordinates(ivp: PoissonIvp) -> tuple[Callable[[Any], Any], Callable[[Any], Any]]:
    """Return the maps into the canonical coordinates of a system and back, for real and complex states."""
    title = f"Canonical coordinates of {ivp.problem}."
    module = ivp.source.linked("darboux", title, ["canonical", "chart"], form="darboux", compiled=ivp.arrays)
    par = tuple(np.complex128(x) if isinstance(x, complex) else np.float64(x) for x in ivp.par)

    def called(function: Callable[..., Any]) -> Callable[[Any], Any]:
        def call(y: Any) -> Any:
            with np.errstate(all="ignore"):
                return function(y if ivp.arrays else tuple(map(np.complex128 if np.iscomplexobj(y) else np.float64, y)), par)

        return call

    return called(module.canonical), called(module.chart)

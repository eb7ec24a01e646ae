"""The parts of a fixed-step method for constrained problems: their combinations, their claims, and the problems that they apply to."""

import importlib
import types
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Any

from daebench.compiler.cache import generated
from daebench.compiler.definition import linker
from daebench.errors import BadInput, InvalidProblem, real, require_known, unknown
from daebench.methods.fixed_step.compositions import COMPOSITIONS
from daebench.methods.fixed_step.forms import FORMS, OWN, Form
from daebench.methods.no_constraint import FORMS as TREATED
from daebench.methods.no_constraint import nothing_to
from daebench.methods.registry import registry
from daebench.schemes.kernels.claims import (
    CHARTED,
    Claims,
    Member,
    composed,
    on_form,
    projected,
    under_forces,
    with_velocities,
    without_constraints,
)

if TYPE_CHECKING:
    from daebench.runs.ivp import ConstrainedIvp, InitialValueProblem


PROJECTIONS = {
    "proj": "orthogonal projection onto the manifold after each step",
    "symproj": "symmetric projection, HLW V.4.1",
}
"""Projections after a step, with descriptions."""


@dataclass(frozen=True)
class Parts:
    """A scheme of ``daebench.schemes`` on a form of the system, composed and projected."""

    scheme: str
    """Name of the scheme."""
    form: str = ""
    """Form of the system: "" for the scheme's own, or a name in :data:`daebench.methods.fixed_step.forms.FORMS`."""
    composition: str = ""
    """"" or a name in :data:`daebench.methods.fixed_step.compositions.COMPOSITIONS`."""
    projection: str = ""
    """"" or a name in :data:`PROJECTIONS`."""
    options: Mapping[str, float] = field(default_factory=dict, hash=False)
    """Free numbers of the scheme and of the form."""
    compensated: bool = False
    """Whether sums over steps are compensated for rounding, HLW VIII.5."""

    def __post_init__(self) -> None:
        require_known(
            ("scheme", self.scheme, registry()),
            ("form", self.form, FORMS),
            ("composition", self.composition, COMPOSITIONS),
            ("projection", self.projection, PROJECTIONS),
        )
        for option, value in self.options.items():
            if option not in self.free_numbers:
                raise unknown(f"option of {self.name}", option, self.free_numbers)
            real(option, value)
        if why := self._misfit():
            raise BadInput(why, "parts-refused")
        if self.options:
            _ = self.data  # numbers out of range are refused here; a tableau is not computed before it is used

    def _misfit(self) -> str | None:
        """Return why the parts do not fit together, as a sentence, or None."""
        claims, module = self.member.claims, self.module
        base = on_form(claims, self.form)
        multistep = hasattr(module, "start")
        if self.form and self.scheme not in (taken := takes_form(self.form)):
            return f"{self.scheme} cannot be run on the form {self.form}; use one of {', '.join(taken)}."
        if self.composition and (multistep or not base.symmetric or base.order != 2):
            instead = "dla" if claims.nonholonomic else "rattle or strang"
            return f"{self.composition} composes symmetric one-step methods of order 2, which {self.base} is not; use {instead}."
        # A scheme with g = 0 alone expects a start with G H_p = 0, which its own substeps do not leave behind.
        if (self.composition or self.projection == "symproj") and base.keeps_g and not base.keeps_Gv:
            part = f"/{self.composition}" if self.composition else "+symproj"
            return f"the momenta of {self.base} leave the manifold, so its steps cannot be combined; leave out {part}."
        if self.projection and (multistep or base.on_manifold or self.system.instead):
            why = "has a memory that a projection would contradict" if multistep else "stays on the manifold by itself"
            why = "does not follow the motion on the manifold" if self.system.instead else why
            return f"{self.base} {why}; leave out +{self.projection}."
        if self.projection == "symproj" and self.composition:
            return f"+symproj is not offered for a composition; use {self.base}+symproj or {self.base}/{self.composition}+proj."
        if self.compensated and (not hasattr(module, "increment") or self.projection):
            what = "a projected state has no increments" if self.projection else f"{self.scheme} does not return its increments"
            return f"compensated summation needs the increment of a step, and {what}; leave it out, or use rattle."
        return None

    @property
    def system(self) -> Form:
        """The form of the system."""
        return FORMS.get(self.form, OWN)

    @property
    def base(self) -> str:
        """Scheme and form as in the name of the method."""
        return f"{self.form}:{self.scheme}" if self.form else self.scheme

    @property
    def name(self) -> str:
        """Name in the grammar of methods."""
        return self.base + (f"/{self.composition}" if self.composition else "") + (f"+{self.projection}" if self.projection else "")

    @property
    def free_numbers(self) -> Mapping[str, float]:
        """Names and defaults of the free numbers of scheme and form."""
        return {**self.member.options, **self.system.options}

    @property
    def imposes(self) -> bool:
        """Whether the scheme is a way to impose constraints, and not a method that also has a meaning without any."""
        claims = self.member.claims
        return claims.imposes or bool(claims.constraints) or claims.system not in ("constrained", "ode")

    @property
    def file(self) -> str:
        """Name of the file that the scheme is in."""
        return registry()[self.scheme][0]

    @property
    def member(self) -> Member:
        """Entry of the scheme in its file."""
        return registry()[self.scheme][1]

    @property
    def module(self) -> types.ModuleType:
        """The scheme's file as a module."""
        return importlib.import_module(f"daebench.schemes.{self.file}")

    @cached_property
    def claims(self) -> Claims:
        """Claims of the whole method: scheme, form, composition and projection together."""
        claims = on_form(self.member.claims, self.form)
        if self.composition:
            claims = composed(claims, COMPOSITIONS[self.composition].order)
        return projected(claims, self.projection) if self.projection else claims

    def claims_on(self, ivp: "InitialValueProblem") -> Claims:
        """Return the claims of the whole method on a problem, which may have forces without potential, or no constraints."""
        claims = self.claims if ivp.m else without_constraints(self.claims)
        if ivp.nonholonomic:
            claims = with_velocities(claims, ivp.holonomic)
        return under_forces(claims) if ivp.facts.FORCED else claims

    @cached_property
    def data(self) -> tuple[Any, ...]:
        """Run-time data of scheme and form: the scheme's numbers, and the form's."""
        options = {name: self.options.get(name, value) for name, value in self.member.options.items()}
        return self.member.numbers(**options), self.system.numbers(self.options)

    def refusal(self, ivp: "ConstrainedIvp") -> str | None:
        """Return why the method cannot be used on this problem, as a sentence, or None."""
        if ivp.arrays:
            why = _unwritten(ivp, self.file, form=self.form, stages=self.member.stages, projection=self.projection)
            return f"{self.name} on the {ivp.facts.NODES} nodes of {ivp.problem}: {why}" if why else None
        if unfit := self._nothing_to_treat(ivp) or self._misfit_of_velocities(ivp) or self._misfit_of_hamiltonian(ivp):
            return unfit
        if self.form in CHARTED:
            return self._misfit_of_chart(ivp)
        return self._misfit_of_constraints(ivp) if self.member.claims.constraints else None

    def _misfit_of_hamiltonian(self, ivp: "ConstrainedIvp") -> str | None:
        needs, facts = self.member.claims, ivp.facts
        if needs.separable_only and not facts.SEPARABLE:
            needed, why = f"{self.name} needs H = 1/2 p^T M^-1 p + U(q) with constant M", getattr(facts, "IN_TIME", "")
            instead = "dla" if needs.nonholonomic else "rattle"
            return f"{needed}, {f'but {ivp.problem} {why}' if why else f'which {ivp.problem} does not have'}; use {instead}."
        # IN_TIME is "" where M depends on q: there a step of RATTLE and the flow of the damping do not commute to second order.
        if needs.conformal and not (facts.DAMPED and facts.IN_TIME):
            return f"{self.name} needs a damping F = -c p with constant M, which {ivp.problem} does not have; use rattle."
        if needs.autonomous_only and facts.EXTENDED:
            return (
                f"{self.name} does not account for the work of time and forces on {ivp.problem}; use rattle, which has the same positions."
            )
        if needs.charged_only and not getattr(facts, "CHARGED", False):
            needed = "H = |p - A(q)|^2 / (2 m) + phi(q) with constant m, and no constraints"
            return f"{self.name} needs {needed}, which {ivp.problem} does not have; use rattle."
        if needs.quadratic_only and not facts.QUADRATIC:
            return f"{self.name} needs an H that is quadratic in p, which {ivp.problem} does not have; use rattle."
        if needs.needs_kinetic_flow and not facts.KINETIC_FLOW:
            return (
                f"{self.name} needs the flow of the kinetic energy in closed form, which {ivp.problem} does not declare; "
                "use rattle, whose compositions have the same orders."
            )
        return None

    def _misfit_of_velocities(self, ivp: "ConstrainedIvp") -> str | None:
        """Return why a method cannot be used where constraints are on velocities, or where none is, as a sentence, or None."""
        claims = self.member.claims
        if not ivp.nonholonomic:
            why = f"{self.name} is for constraints on velocities, and {ivp.problem} has none; use rattle."
            return why if claims.nonholonomic else None
        if self.form not in ("", "baumgarte") or self.projection == "symproj":
            part = f"+{self.projection}" if self.projection else f"{self.form}:"
            return f"{self.name} has no meaning for constraints on velocities, as {ivp.problem} has; leave out {part}."
        if claims.nonholonomic or claims.any_form:
            return None
        return f"{self.name} is not made for constraints on velocities, and {ivp.problem} has one; use dla."

    def _nothing_to_treat(self, ivp: "ConstrainedIvp") -> str | None:
        """Return why a method that treats constraints, by its form, scheme or projection, cannot be used where there are none."""
        if self.form in TREATED:
            return nothing_to(TREATED[self.form], self.name, ivp, f"leave out {self.form}:")
        if self.projection:
            return nothing_to("project onto", self.name, ivp, f"leave out +{self.projection}")
        return nothing_to("impose", self.name, ivp, "use rattle, which is the Störmer-Verlet method there") if self.imposes else None

    def _misfit_of_chart(self, ivp: "ConstrainedIvp") -> str | None:
        if not ivp.facts.CHART:
            return f"{self.name} needs a chart of the manifold, which {ivp.problem} does not declare; leave out {self.form}:."
        if self.form == "canonical" and not ivp.facts.CANONICAL:
            return (
                f"{self.name} needs H = 1/2 p^T M^-1 p + U(q) and a chart whose positions depend on xi alone, "
                f"which {ivp.problem} does not have; use local:."
            )
        return None

    def _misfit_of_constraints(self, ivp: "ConstrainedIvp") -> str | None:
        from daebench.methods.fixed_step.constraint_structure import misfit

        why = misfit(self.member.claims.constraints, ivp)
        return f"{self.name} {why}" if why else None


def takes_form(form: str) -> list[str]:
    """Return the names of the schemes for a form of the system: in canonical coordinates, also those for Hamiltonian ODEs."""
    claims = {name: member.claims for name, (_, member) in registry().items()}
    return [name for name, its in claims.items() if its.any_form or (form == "canonical" and its.canonical)]


def _unwritten(ivp: "ConstrainedIvp", file: str, **structure: Any) -> str:
    """Return why a scheme's file cannot be written as loops over the nodes of a chain, or ""; kept with generated modules."""

    def build() -> str:
        why = ""
        try:
            linker(ivp.source.derivation, f"daebench.schemes.{file}", **structure).module(
                "", [("daebench.schemes.kernels.loop", "integrate")]
            )
        except InvalidProblem as error:
            why = str(error)
        return f'"""Whether {file} is loops over nodes of {ivp.problem}."""\n\nWHY = {why!r}\n'

    # The linker is asked once for each file: for a long chain the answer takes longer than a short run.
    key = f"{ivp.source.key} {file} {sorted(structure.items())} loops"
    return str(generated(f"{ivp.problem}_{file}_loops", key, build).WHY)

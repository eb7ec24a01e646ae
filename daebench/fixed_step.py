"""Fixed-step methods: a scheme on a form of the system, composed, projected, and linked to a problem."""

import importlib
import time
import types
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from daebench.cache import generated
from daebench.chains.unwritten import unwritten
from daebench.claims import Claims, Member, composed, on_form, projected
from daebench.complex_run import complex_run
from daebench.compositions import COMPOSITIONS, weights_of
from daebench.errors import BadInput, RunFailed, require_known, unknown
from daebench.forms import FORMS, OWN, Form
from daebench.grid import Grid
from daebench.inputs import real
from daebench.kernels.hole import ROUNDINGS
from daebench.members import members
from daebench.method import Method, Request
from daebench.rank_run import RankRun
from daebench.scales import constrained_scales, in_coordinates
from daebench.scene import Scene
from daebench.stages import Stages
from daebench.stepping import REASONS, SIMPLIFIED, Linked, Run
from daebench.trajectory import CONSTRAINED, WORK, Array, Trajectory

PROJECTIONS = {
    "proj": "orthogonal projection onto the manifold after each step",
    "symproj": "symmetric projection, HLW V.4.1",
}
"""What may follow a step, and what it is."""

Flow = Callable[[Sequence[complex], Sequence[complex]], tuple[Sequence[complex], Sequence[complex]]]
Path = Callable[[Sequence[complex], Sequence[complex]], tuple[NDArray[np.complex128], str | None]]


@dataclass(frozen=True)
class FixedStep:
    """A scheme of ``daebench.schemes`` run with constant step size.

    Parameters
    ----------
    scheme : str
        Name of the scheme.
    form : str
        Form of the system: "" for the scheme's own, or a name in :data:`daebench.forms.FORMS`.
    composition : str
        "" or a name in :data:`daebench.compositions.COMPOSITIONS`.
    projection : str
        "" or a name in :data:`PROJECTIONS`.
    options : mapping of str to float
        Free numbers of the scheme and of the form.
    compensated : bool
        Whether sums over steps are compensated for rounding, HLW VIII.5.
    compiled : bool
        Whether the kernel is handed to numba.
    sweeps : int
        Sweeps after which Newton's iteration is ended, converged or not; 0 for convergence.
    roundings : float
        Increments of so many roundings end Newton's iteration.

    Raises
    ------
    BadInput
        If a name is unknown, the parts do not go together, or an option is not what it must be.
    """

    scheme: str
    form: str = ""
    composition: str = ""
    projection: str = ""
    options: Mapping[str, float] = field(default_factory=dict, hash=False)
    compensated: bool = False
    compiled: bool = True
    sweeps: int = 0
    roundings: float = ROUNDINGS
    knob = "h"

    def __post_init__(self) -> None:
        require_known(
            ("scheme", self.scheme, members()),
            ("form", self.form, FORMS),
            ("composition", self.composition, COMPOSITIONS),
            ("projection", self.projection, PROJECTIONS),
        )
        for option, value in self.options.items():
            if option not in self.free_numbers:
                raise unknown(f"option of {self.name}", option, self.free_numbers)
            real(option, value)
        if why := self._misfit():
            raise BadInput(why)
        if self.options:
            _ = self.data  # numbers out of range are refused here; a tableau is not worked out before it is used

    def _misfit(self) -> str | None:
        """Return why the parts do not go together, as a sentence, or None."""
        own, module = self.member.claims, self._module
        base = on_form(own, self.form)
        multistep = hasattr(module, "start")
        if self.form and not own.any_form:
            return f"{self.scheme} cannot be run on the form {self.form}; use one of {', '.join(takes_forms())}."
        if self.composition and (multistep or not base.symmetric or base.order != 2):
            return f"{self.composition} composes symmetric one-step methods of order 2, which {self._base} is not; use rattle or strang."
        if (self.composition or self.projection == "symproj") and base.keeps_g and not base.keeps_Gv:
            part = f"/{self.composition}" if self.composition else "+symproj"
            return f"{self._base} lets its momenta leave the manifold, where its steps do not fit together; leave out {part}."
        if self.projection and (multistep or base.on_manifold or self.form == "stiff"):
            why = "has a memory that a projection would contradict" if multistep else "stays on the manifold by itself"
            why = "solves a system that has no constraints" if self.form == "stiff" else why
            return f"{self._base} {why}; leave out +{self.projection}."
        if self.projection == "symproj" and self.composition:
            return f"+symproj is not offered for a composition; use {self._base}+symproj or {self._base}/{self.composition}+proj."
        if self.compensated and (not hasattr(module, "increment") or self.projection):
            what = "a projected state has no increments" if self.projection else f"{self.scheme} does not give its increments"
            return f"compensated summation needs the increment of a step, and {what}; leave it out, or use rattle."
        return None

    @property
    def _form(self) -> Form:
        return FORMS.get(self.form, OWN)

    @property
    def _base(self) -> str:
        return f"{self.form}:{self.scheme}" if self.form else self.scheme

    @property
    def name(self) -> str:
        """Name in the grammar of methods."""
        return self._base + (f"/{self.composition}" if self.composition else "") + (f"+{self.projection}" if self.projection else "")

    @property
    def free_numbers(self) -> Mapping[str, float]:
        """Names and defaults of the free numbers of scheme and form."""
        return {**self.member.options, **self._form.options}

    @property
    def file(self) -> str:
        """Name of the file that the scheme is in."""
        return members()[self.scheme][0]

    @property
    def member(self) -> Member:
        """What the scheme is in its file."""
        return members()[self.scheme][1]

    @property
    def _module(self) -> types.ModuleType:
        return importlib.import_module(f"daebench.schemes.{self.file}")

    @cached_property
    def claims(self) -> Claims:
        """What the whole method claims: scheme, form, composition and projection together."""
        claims = on_form(self.member.claims, self.form)
        if self.composition:
            claims = composed(claims, COMPOSITIONS[self.composition].order)
        return projected(claims, self.projection) if self.projection else claims

    @cached_property
    def data(self) -> tuple[Any, ...]:
        """Run-time data of scheme and form: the scheme's numbers, and the form's."""
        own = {name: self.options.get(name, value) for name, value in self.member.options.items()}
        return self.member.numbers(**own), self._form.numbers(self.options)

    @cached_property
    def weights(self) -> Array:
        """Weights of the substeps of a composition, shape(k,); empty where there is none."""
        return np.array(weights_of(self.composition), dtype=float)

    def refusal(self, scene: Scene) -> str | None:
        """Return why the method cannot be used on this problem, as a sentence, or None."""
        needs, sheet = self.member.claims, scene.sheet
        if scene.arrays:
            why = unwritten(scene, self.file, form=self.form, stages=self.member.stages, projection=self.projection)
            return f"{self.name} on the {scene.sheet.NODES} nodes of {scene.problem}: {why}" if why else None
        if needs.separable_only and not sheet.SEPARABLE:
            return f"{self.name} needs H = 1/2 p^T M^-1 p + U(q) with constant M, which {scene.problem} does not have; use rattle."
        if needs.quadratic_only and not sheet.QUADRATIC:
            return f"{self.name} needs H to be quadratic in p, which that of {scene.problem} is not; use rattle."
        if needs.needs_kinetic_flow and not sheet.KINETIC_FLOW:
            return (
                f"{self.name} needs the flow of the kinetic energy in closed form, which {scene.problem} does not declare; "
                "use rattle, whose compositions have the same orders."
            )
        if self.form == "local" and not sheet.CHART:
            return f"{self.name} needs a chart of the manifold, which {scene.problem} does not declare; leave out local:."
        return None

    @property
    def _solves(self) -> bool:
        """Whether systems of constraints are solved, in its own coordinates: those of ``local`` and ``stiff`` have none."""
        return self.form not in ("local", "stiff")

    def on_singular(self, scene: Scene, request: Request) -> str:
        """Return what to do where G loses rank: one of :data:`daebench.method.ON_SINGULAR`, or "" where it is no matter.

        Raises
        ------
        BadInput
            If the name is unknown, or there is nothing to solve by least squares.
        """
        mode = request.at_rank_loss(scene)
        if mode == "least-squares" and scene.arrays:
            raise BadInput(
                f"{self.name} on {scene.sheet.NODES} nodes of {scene.problem} solves banded systems, and none by least squares; "
                "take continue, or fewer nodes."
            )
        if request.on_singular == "least-squares" and not self._solves:
            raise BadInput(f"{self.name} solves no systems of constraints, and so none by least squares; leave out on_singular.")
        return mode if self._solves else ""

    def kernel(
        self, scene: Scene, precision: str, watch: tuple[str, ...], *, count: bool, raw: bool = False, singular: str = "stop"
    ) -> types.ModuleType:
        """Return the generated module of this method and problem; other numbers of the same structure share it."""
        structure: dict[str, Any] = {
            "precision": precision,
            "watch": watch,
            "count": count,
            "compiled": self.compiled,
            "form": self.form,
            "stages": self.member.stages,
            "composed": bool(self.composition),
            "compensated": self.compensated,
            "projection": self.projection,
            "raw": len(self.member.multipliers()) if raw else 0,
            "sweeps": self.sweeps,
            "roundings": self.roundings,
            "singular": "least-squares" if singular == "least-squares" else "watch" if singular and self._solves else "",
        }

        def build(cached: bool) -> str:
            from daebench.link import Linker, Options

            linker = Linker(scene.source.form(self.form), Options(**structure), f"daebench.schemes.{self.file}")
            memory = linker.constants["MULTISTEP"] or self.compensated
            roots = [("daebench.kernels.loop", "integrate"), ("daebench.kernels.loop", "first")]
            roots += [("daebench.kernels.constrained", "begin")] if memory else []
            return linker.module(f"{self.name} on {scene.problem}, {precision}.", roots, cached)

        stem = f"{scene.problem}_{self.form}_{self.file}{self.member.stages}_{precision}"
        return generated(stem, f"{scene.source.key} {self.file} {sorted(structure.items())}", build)

    def _scales(self, scene: Scene, h: float) -> tuple[float, float]:
        """Return the length and the rate of the initial value problem in the coordinates that the scheme computes in."""
        scales = constrained_scales(scene, h, rated=self.member.claims.any_form)
        if self.form != "local":
            return scales
        return in_coordinates(scales, self._form.leave(scene), self._form.enter(scene)(*scene.start), 1)

    def _linked(self, scene: Scene, kernel: types.ModuleType, h: float) -> Linked:
        enter, leave = self._form.enter(scene), self._form.leave(scene)
        return Linked(
            self.name,
            kernel,
            (*scene.par, *self.data, self._scales(scene, h)),
            self.weights,
            self.compiled,
            enter=lambda start: enter(*start),
            leave=lambda x: np.concatenate(leave(*x)),
            work=WORK,
            reasons=SIMPLIFIED if self.member.simplified and self.form != "stiff" else REASONS,
            arrays=scene.arrays,
        )

    def solve(self, scene: Scene, request: Request) -> Trajectory:
        """Return the trajectory; where the scheme stops early, what was computed so far and why.

        Raises
        ------
        BadInput
            If the request cannot be met: see :class:`daebench.grid.Grid`.
        """
        run = self.begin(scene, request, self.grid(scene, request), request.watched(CONSTRAINED))
        outcome = run.outcome()
        t, rows = run.states()
        p, q = rows[:, : scene.d].copy(), rows[:, scene.d :].copy()
        stages = Stages(self.member.multipliers())
        return Trajectory(
            **outcome,
            t=t,
            q=q,
            p=p,
            lam=run.scene.along("lam", p, q) if request.multipliers else None,
            raw=stages.multipliers(run.multipliers(), run.grid.h, scene.m) if request.raw else {},
            passages=tuple(run.passages),
        )

    def begin(self, scene: Scene, request: Request, grid: Grid, watched: tuple[str, ...]) -> Run:
        """Return a run at its start.

        Parameters
        ----------
        scene : Scene
            The problem with its numbers.
        request : Request
            What is asked for.
        grid : Grid
            The steps that this comes to, see :meth:`grid`.
        watched : tuple of str
            What the loop watches, or ("samples",) for it to store H in place of states.
        """
        began = time.perf_counter()
        mode = self.on_singular(scene, request)
        scene = replace(scene, on_singular=mode)
        kernel = self.kernel(scene, request.precision, watched, count=request.count, raw=request.raw, singular=mode)
        raw = len(Stages(self.member.multipliers()).nodes) * scene.m if request.raw else 0
        made: Callable[..., Run] = partial(RankRun, mode) if mode else Run
        return made(self._linked(scene, kernel, grid.h), scene, request, grid, names=_watched_names(watched, scene), raw=raw, began=began)

    def check(self, scene: Scene, request: Request) -> None:
        """Accept a request that can be met; raise :class:`BadInput` otherwise."""
        self.grid(scene, request)

    def grid(self, scene: Scene, request: Request) -> Grid:
        """Return the steps that a request comes to; raise :class:`BadInput` if it cannot be met."""
        if refusal := self.refusal(scene):
            raise BadInput(refusal)
        self.on_singular(scene, request)
        grid = Grid.fixed_step(self.name, request, scene.size)
        if request.raw and (self.composition or not self.member.multipliers()):
            why = "those of a composition belong to its substeps" if self.composition else "it computes none"
            raise BadInput(f"{self.name} has no raw multipliers to give: {why}; ask for lam(p, q) instead.")
        if request.raw and grid.every != 1:
            raise BadInput(f"raw multipliers are those of every step; leave out every = {grid.every}.")
        return grid

    def flow(self, scene: Scene, h: float, steps: int) -> Flow:
        """Return the map of ``steps`` steps for complex states, exact to first order in the imaginary part.

        The map raises :class:`RunFailed` where the scheme has no solution.
        """
        linked = self._linked(scene, self.kernel(scene, "complex128", (), count=False, singular=""), h)

        def phi(p: Sequence[complex], q: Sequence[complex]) -> tuple[Sequence[complex], Sequence[complex]]:
            x, _, failure = complex_run(linked, scene, _complex_state(linked, p, q), h, steps)
            if failure:
                raise RunFailed(failure)
            return self._form.leave(scene)(*x)

        return phi

    def path(self, scene: Scene, h: float, steps: int) -> Path:
        """Return the map from a complex state to those after 0, 1, 2, ... steps, exact to first order in the imaginary part.

        It gives rows (p, q), and why there are fewer than ``steps`` more, or None.
        """
        linked = self._linked(scene, self.kernel(scene, "complex128", (), count=False, singular=""), h)

        def along(p: Sequence[complex], q: Sequence[complex]) -> tuple[NDArray[np.complex128], str | None]:
            _, rows, failure = complex_run(linked, scene, _complex_state(linked, p, q), h, steps, every=1)
            return np.concatenate([np.concatenate([p, q])[None], rows]), failure

        return along


def _complex_state(linked: Linked, p: Sequence[complex], q: Sequence[complex]) -> Any:
    state = linked.enter(([np.complex128(x) for x in p], [np.complex128(x) for x in q]))
    return tuple(np.array(part) if linked.arrays else tuple(map(np.complex128, part)) for part in state)


def accepted(method: Method[Scene, Trajectory], scene: Scene, why: str) -> FixedStep:
    """Return a method where it is a fixed-step method that takes this problem.

    Raises
    ------
    BadInput
        If it is not, with ``why`` that matters, or if it refuses the problem.
    """
    if not isinstance(method, FixedStep):
        raise BadInput(f"{method.name} chooses its own steps {why}; give a fixed-step method, for example rattle.")
    if refusal := method.refusal(scene):
        raise BadInput(refusal)
    return method


def _watched_names(watch: Sequence[str], scene: Scene) -> list[str]:
    names = {"energy": ["energy"], "manifold": ["g", "Gv"], "integrals": list(scene.integrals), "samples": []}
    return [name for each in watch for name in names[each]]


def takes_forms() -> list[str]:
    """Return the names of the schemes that can be run on every form of the system."""
    return [name for name, (_, member) in members().items() if member.claims.any_form]

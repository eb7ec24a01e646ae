"""Fixed-step methods for either kind of problem: a scheme linked to a problem, and its map for complex states."""

import types
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import cached_property, partial
from typing import TYPE_CHECKING, Any, ClassVar, Generic, Self, TypeVar

import numpy as np
from numpy.typing import NDArray

from daebench.compiler.cache import generated
from daebench.compiler.definition import linker
from daebench.compiler.under_way import compiling
from daebench.errors import BadInput, RunFailed
from daebench.methods.fixed_step.complex_step import complex_run
from daebench.methods.fixed_step.compositions import weights_of
from daebench.methods.fixed_step.dual_kernel import DualKernel, seeds, width
from daebench.methods.fixed_step.stepping import Linked, Run
from daebench.runs.directions import directions, require_names, require_tuples
from daebench.runs.grid import Grid
from daebench.runs.ivp import ConstrainedIvp, PoissonIvp
from daebench.runs.request import Progress, Request
from daebench.runs.trajectory import Array
from daebench.schemes.kernels.claims import MAPPED

if TYPE_CHECKING:
    from daebench.compiler.link import Linker

Ivp = TypeVar("Ivp", bound=ConstrainedIvp | PoissonIvp)
Result = TypeVar("Result")

INTEGRATE, FIRST = (("daebench.schemes.kernels.loop", name) for name in ("integrate", "first"))
"""Functions of a generated module that are called: the loop and, if it monitors conserved quantities, their values at the start."""

ALONE = ("daebench.schemes.kernels.alone", "alone")
"""One step by itself, where code has a loop of its own."""

INITIALISE = ("daebench.schemes.kernels.constrained", "initialise")
"""The function that is also called if a scheme has a memory from step to step."""


_ITERATED: dict[str, frozenset[str]] = {}
"""Results of :meth:`FixedStepMethod.iterated`."""


class FixedStepMethod(ABC, Generic[Ivp, Result]):
    """A scheme with constant step size; subclasses for each kind of problem add the run and the maps to and from the scheme's state."""

    knob = "h"
    differentiable: ClassVar[bool] = True
    counted: ClassVar[tuple[str, ...]]
    form: str
    composition: str
    compiled: bool
    compensated: bool = False
    splitting: str = ""

    @property
    @abstractmethod
    def name(self) -> str:
        """Name in the grammar of methods."""

    @property
    def rated(self) -> bool:
        """Whether its steps need the rate of the motion, see :mod:`daebench.runs.scales`."""
        return False

    def on_singular(self, ivp: Ivp, request: Request) -> str:
        """Return the choice for a run where G loses rank; "" if it does not matter, as on a Poisson system."""
        return ""

    @abstractmethod
    def refusal(self, ivp: Ivp) -> str | None:
        """Return why the method cannot be used on this problem, as a sentence, or None."""

    @abstractmethod
    def _require(self, ivp: Ivp, request: Request) -> None:
        """Accept a request for problems of this kind; raise :class:`BadInput` otherwise."""

    @property
    @abstractmethod
    def scheme_module(self) -> str:
        """Name of the module that the scheme is in."""

    @abstractmethod
    def _derivation(self, ivp: Ivp) -> Any:
        """Return the derivation of the problem in the form of the scheme."""

    @abstractmethod
    def _scales(self, ivp: Ivp, h: float) -> tuple[float, float]:
        """Return the length and the rate of the initial value problem in the coordinates of the scheme."""

    @abstractmethod
    def _reasons(self, ivp: Ivp) -> Mapping[int, tuple[str, str]]:
        """Return why a run stops and what to do, by status."""

    @abstractmethod
    def _coordinates(self, ivp: Ivp) -> tuple[Callable[[Sequence[Any]], Any], Callable[[Any], Sequence[Any]]]:
        """Return the maps from the vectors of a state to what the scheme computes in, and back."""

    def _structure(self, *, stage_multipliers: bool, singular: str) -> dict[str, Any]:
        """Return the other options that decide the generated module, as :class:`daebench.compiler.link.Options` takes them."""
        return {}

    def _in_loops(self, ivp: Ivp, precision: str) -> bool:
        """Return whether vectors in a kernel are arrays although those of the problem's functions are tuples; by default they are not."""
        return False

    @property
    def data(self) -> tuple[Any, ...]:
        """Run-time data of scheme and form: the scheme's numbers, and the form's."""
        return (), ()

    @cached_property
    def weights(self) -> Array:
        """Weights of the substeps of a composition, shape(k,); empty where there is none."""
        return np.array(weights_of(self.composition), dtype=float)

    def weighted(self, weights: Array) -> Self:
        """Return the same method with other weights of its composition, shape(k,)."""
        method: Self = replace(self)  # type: ignore[type-var]
        # Set beside the dataclass: the weights are a cached property, and the name of the method stays that of the composition.
        vars(method)["weights"] = np.array(weights, dtype=float)
        return method

    def kernel(
        self,
        ivp: Ivp,
        precision: str,
        watch: tuple[str, ...],
        *,
        count: bool,
        stage_multipliers: bool = False,
        singular: str = "stop",
    ) -> types.ModuleType:
        """Return the generated module of this method and problem; other numbers of the same structure share it."""
        structure = self._options(ivp, precision, watch, count=count, stage_multipliers=stage_multipliers, singular=singular)
        file = f"{self.scheme_module.rpartition('.')[2]}{structure.get('stages', '')}"
        key = self._key(ivp, structure)
        name = f"{ivp.problem}_{self.form}_{file}_{precision}"
        with compiling(f"{self.name} for {ivp.problem}"):
            return generated(name, key, lambda: self._module(ivp, structure))

    def _key(self, ivp: Ivp, options: Mapping[str, Any]) -> str:
        """Return a text that is the same for problems and methods with the same generated module."""
        # No numbers in it: parameters, tableaux and weights are run-time data, so that one module serves all of them.
        return f"{ivp.source.key} {self.scheme_module} {self.splitting} {sorted(options.items())}"

    def source(self, ivp: Ivp, precision: str, watch: tuple[str, ...], *, singular: str = "") -> str:
        """Return the text of a generated module for translation; unless ``singular`` says so, it does not monitor the rank of G."""
        return self._module(ivp, self._options(ivp, precision, watch, count=False, stage_multipliers=False, singular=singular))

    def printable(self, ivp: Ivp, h: float, precision: str) -> tuple[str, Any, Any]:
        """Return the text of a generated module with one step by itself, a state that the scheme computes in, and the run-time data."""
        options = self._options(ivp, precision, (), count=False, stage_multipliers=True, singular=ivp.singular)
        linking, roots = self._linker(ivp, options)
        linked = self.linked(ivp, types.ModuleType("none"), h)
        state, convert = linked.enter(ivp.start), np.asarray if linked.arrays or options.get("loops") else _tuples
        state = tuple(map(convert, state)) if isinstance(state, tuple) and np.ndim(state[0]) else convert(state)
        output = [("daebench.schemes.kernels.language", "output")] * (self.form in MAPPED)
        return linking.module(f"{self.name} on {ivp.problem}.", [*roots, ALONE, *output]), state, _tuples(linked.par)

    def _options(
        self, ivp: Ivp, precision: str, watch: tuple[str, ...], *, count: bool, stage_multipliers: bool, singular: str
    ) -> dict[str, Any]:
        """Return the options that decide a generated module, as :class:`daebench.compiler.link.Options` takes them."""
        options: dict[str, Any] = {"precision": precision, "watch": watch, "count": count, "compiled": self.compiled, "form": self.form}
        options |= {"composed": bool(self.composition), **self._structure(stage_multipliers=stage_multipliers, singular=singular)}
        return options | ({"loops": True} if self._in_loops(ivp, precision) else {})

    def _module(self, ivp: Ivp, options: Mapping[str, Any]) -> str:
        """Return the text of a generated module."""
        linking, roots = self._linker(ivp, options)
        return linking.module(f"{self.name} on {ivp.problem}, {options['precision']}.", roots)

    def _linker(self, ivp: Ivp, options: Mapping[str, Any]) -> tuple["Linker", Sequence[tuple[str, str]]]:
        """Return the linker of a generated module, and the functions that the module needs."""
        linked = linker(self._derivation(ivp), self.scheme_module, **options)
        # Rounding errors of compensated sums are a memory, too.
        remembers = linked.constants["MULTISTEP"] or self.compensated
        return linked, [INTEGRATE, *[FIRST] * bool(linked.monitored.conserved), *[INITIALISE] * bool(remembers)]

    def iterated(self, ivp: Ivp) -> frozenset[str]:
        """Return the kinds of work, as in ``Trajectory.work``, that are done in the iterations of a step."""
        options = self._options(ivp, "float64", (), count=False, stage_multipliers=False, singular="")
        key = self._key(ivp, options)
        # The answer needs the linker, which takes longer than a short run.
        if key not in _ITERATED:
            _ITERATED[key] = frozenset(self.read(ivp).iterated)
        return _ITERATED[key]

    def read(self, ivp: Ivp) -> "Linker":
        """Return the linker of a module, which has read the files of the scheme and of what surrounds it."""
        linking, roots = self._linker(ivp, self._options(ivp, "float64", (), count=False, stage_multipliers=False, singular=""))
        for file, name in roots:
            linking.resolve(file, name)
        return linking

    def linked(self, ivp: Ivp, kernel: types.ModuleType, h: float) -> Linked:
        """Return the scheme linked to a problem with its numbers, to run with a kernel."""
        enter, leave = self._coordinates(ivp)
        return Linked(
            self.name,
            kernel,
            (*ivp.par, self._scales(ivp, h), *self.data),
            self.weights,
            enter=enter,
            leave=lambda x: np.concatenate(leave(x)),
            work=self.counted,
            reasons=self._reasons(ivp),
            arrays=ivp.arrays or getattr(kernel, "ARRAYS", False),
        )

    def solve(self, ivp: Ivp, request: Request) -> Result:
        """Return the trajectory; if the scheme stops early, the states so far and the reason."""
        return self.linked_run(ivp, request)(request.progress)

    def linked_run(self, ivp: Ivp, request: Request) -> Callable[[Progress | None], Result]:
        """Return the run of a request that can be met, linked to the problem: called with a progress, it returns the trajectory."""
        ready = partial(self._ready, ivp, request, self.grid(ivp, request), request.watched(ivp.state))
        if request.sensitivities:  # a kernel of dual numbers has the derivatives so far in it
            return lambda progress: self._trajectory(ivp, request, ready()(progress=progress))
        begin = ready()
        return lambda progress: self._trajectory(ivp, request, begin(progress=progress))

    def begin(self, ivp: Ivp, request: Request, grid: Grid, monitored: tuple[str, ...]) -> Run:
        """Return a run at its start, of the steps of :meth:`grid`; monitored ("samples",), the loop stores H in place of states."""
        return self._ready(ivp, request, grid, monitored)(progress=request.progress)

    @abstractmethod
    def _ready(self, ivp: Ivp, request: Request, grid: Grid, monitored: tuple[str, ...]) -> Callable[..., Run]:
        """Link the scheme to the problem, and return the maker of a run at its start."""

    @abstractmethod
    def _trajectory(self, ivp: Ivp, request: Request, run: Run) -> Result:
        """Return the trajectory of a run that is at its start."""

    def check(self, ivp: Ivp, request: Request) -> None:
        """Accept a request that can be met; raise :class:`BadInput` otherwise."""
        self.grid(ivp, request)

    def grid(self, ivp: Ivp, request: Request) -> Grid:
        """Return the steps of a request; raise :class:`BadInput` if it cannot be met."""
        if refusal := self.refusal(ivp):
            raise BadInput(refusal, "method-refuses-problem")
        self._require(ivp, request)
        self._require_differentiable(ivp, request)
        return Grid.fixed_step(self.name, request, ivp.size * (1 + width(ivp, request.sensitivities)))

    def _require_differentiable(self, ivp: Ivp, request: Request) -> None:
        """Accept the quantities to differentiate by; raise :class:`BadInput` if this is not possible."""
        if not request.sensitivities:
            return
        require_names(ivp, request.sensitivities)
        require_tuples(self.name, ivp)
        if request.precision != "float64" or not self.compiled:
            why = f"{request.precision} has too few digits for them; use float64" if self.compiled else "they need a compiled kernel"
            raise BadInput(f"{self.name} on {ivp.problem} cannot give sensitivities: {why}.", "sensitivities-refused")

    def _number(self, ivp: Ivp, request: Request) -> str:
        """Return the number type of a run, as :class:`daebench.compiler.link.Options` takes it."""
        return f"dual{width(ivp, request.sensitivities)}" if request.sensitivities else request.precision

    def _differentiated(self, ivp: Ivp, request: Request, grid: Grid, kernel: types.ModuleType) -> Linked:
        """Return the scheme linked to a problem, with its derivatives if the request has sensitivities."""
        linked = self.linked(ivp, kernel, grid.h)
        if not request.sensitivities:
            return linked
        chosen = directions(ivp, request.sensitivities).widened(width(ivp, request.sensitivities))
        begin = seeds(ivp, chosen, lambda moved: self._coordinates(moved)[0], len(linked.par) - len(ivp.par))
        return replace(linked, kernel=DualKernel(kernel, begin, grid.rows, chosen))

    def _sensitivities(self, run: Run, n: int, **parts: slice) -> Mapping[str, Mapping[str, Array]]:
        """Return the derivatives of a run's n states, on request; ``parts`` are the places of q and p, or y, in a state."""
        return run.kernel.sensitivities(run.row, n, parts) if isinstance(run.kernel, DualKernel) else {}

    def flow(self, ivp: Ivp, h: float, steps: int) -> Callable[..., Any]:
        """Return the map of ``steps`` steps for complex states, exact to first order in the imaginary part.

        The map is (p, q) -> (p, q), or y -> y, and raises :class:`RunFailed` if the scheme has no solution.
        """
        linked = self.linked(ivp, self.kernel(ivp, "complex128", (), count=False, singular=ivp.singular), h)
        leave = self._coordinates(ivp)[1]

        def phi(*vectors: Sequence[complex]) -> Any:
            x, _, failure = complex_run(linked, ivp, _complex_state(linked, vectors), h, steps)
            if failure:
                raise RunFailed(failure, "map-has-no-solution")
            ends = leave(x)
            return ends if len(ends) > 1 else np.array(ends[0])

        return phi

    def path(self, ivp: Ivp, h: float, steps: int) -> Callable[..., tuple[NDArray[np.complex128], str | None]]:
        """Return the map from a complex state to those after 0, 1, 2, ... steps, exact to first order in the imaginary part.

        It gives rows (p, q), or y, and why there are fewer than ``steps`` more, or None.
        """
        linked = self.linked(ivp, self.kernel(ivp, "complex128", (), count=False, singular=ivp.singular), h)

        def along(*vectors: Sequence[complex]) -> tuple[NDArray[np.complex128], str | None]:
            _, rows, failure = complex_run(linked, ivp, _complex_state(linked, vectors), h, steps, every=1)
            start = np.concatenate([np.asarray(vector, dtype=complex) for vector in vectors])
            return np.concatenate([start[None], rows]), failure

        return along


def _tuples(x: Any) -> Any:
    """Return a nested tuple of floats."""
    return tuple(map(_tuples, x)) if hasattr(x, "__len__") else float(x)


def _complex_state(linked: Linked, vectors: Sequence[Sequence[complex]]) -> Any:
    """Return the scheme's own state with complex entries: a vector, or a tuple of them."""
    state = linked.enter([np.array(vector, dtype=complex) for vector in vectors])

    def typed(vector: Any) -> Any:
        return np.array(vector) if linked.arrays else tuple(map(np.complex128, vector))

    return tuple(map(typed, state)) if isinstance(state, tuple) and np.ndim(state[0]) else typed(state)

"""A method from outside as a method: its states are monitored and stored like those of a scheme of daebench."""

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial
from typing import Any

import numpy as np

from daebench.errors import BadInput, RunFailed, Stopped
from daebench.methods.outside.call import Stated as Stated
from daebench.methods.outside.call import Step as Step
from daebench.methods.outside.record import Blocks, Record, SampledRun
from daebench.methods.solvers.drive import POINTS, check
from daebench.runs.grid import Grid, require_memory
from daebench.runs.ivp import Ivp, PoissonIvp
from daebench.runs.request import Request
from daebench.runs.trajectory import PoissonTrajectory, Trajectory


@dataclass(frozen=True)
class OutsideMethod:
    """Code from outside, run with constant step size, or with a tolerance.

    Its cost is the time of its steps, CPU time where it runs in a process of its own, or what a program says; its work is not counted.
    """

    name: str
    """Name in tables: the text of the request, or the name of the callable."""
    blocks: Blocks = field(repr=False)
    """See :data:`daebench.methods.outside.record.Blocks`."""
    content: str = ""
    """Digest of the code, which is part of the key of a stored run; "" if there is none, for example for a callable."""
    every_step: bool = True
    """Whether there is a state after each step; otherwise only at the outputs."""
    remembers: bool = False
    """Whether it passes more from step to step than the state."""
    step: Callable[[], Step] | None = field(default=None, repr=False)
    """Returns a fresh :data:`Step` of a Python callable, which may compute in complex numbers."""
    claims: Stated = field(default_factory=Stated)
    """Claims of the code."""
    knob: str = "h"
    """"h"; or "tol", where the code chooses its own steps, whose number is not known: its states are those at the outputs."""

    def refusal(self, ivp: Ivp) -> str | None:
        """Return None: what the code cannot do shows when it is run."""
        return None

    def check(self, ivp: Ivp, request: Request) -> None:
        """Accept a request that can be met; raise :class:`BadInput` otherwise."""
        self.grid(ivp, request)

    def grid(self, ivp: Ivp, request: Request) -> Grid:
        """Return the steps that a request comes to; raise :class:`BadInput` if it cannot be met."""
        if request.precision != "float64":
            raise BadInput(f"{self.name} computes in float64, not in {request.precision}.", "outside-precision")
        if request.raw:
            raise BadInput(
                f"{self.name} is from outside, and has no stage multipliers; ask for lam(p, q) instead.", "outside-stage-multipliers"
            )
        return self._outputs(request, ivp.size) if self.knob == "tol" else Grid.fixed_step(self.name, request, ivp.size)

    def _outputs(self, request: Request, size: int) -> Grid:
        """Return the times of output of code that chooses its own steps, as parts of the run."""
        check(self.name, request, least=float(np.finfo(float).tiny))
        if request.solver_steps:
            raise BadInput(
                f"{self.name} is from outside, and does not tell of its steps; leave out the record of steps.", "outside-record-of-steps"
            )
        assert request.t_end is not None
        parts = (request.points or POINTS) - 1
        every = 0 if request.every == 0 or parts == 1 else 1
        grid = Grid(request.t_end / parts, parts, every, request.t_end)
        require_memory(grid, size)
        return grid

    def is_poisson(self, ivp: PoissonIvp) -> bool:
        """Return whether it is said to be a Poisson map."""
        return bool(self.claims.symplectic)

    def keeps(self, ivp: PoissonIvp) -> frozenset[str]:
        """Return the names of what is said to be conserved to round-off on a Poisson system."""
        return frozenset({"energy"} if self.claims.conserves_energy else ())

    def flow(self, ivp: Ivp, h: float, steps: int) -> Callable[..., Any]:
        """Return the map of ``steps`` steps, (p, q) -> (p, q) or y -> y, of real states, and of complex ones where the code takes them.

        Where the code cannot go on from a real state, it raises :class:`RunFailed`; what the code raises of complex ones it raises too.
        """
        along = partial(_at_end, self.name, self.blocks, ivp) if self.step is None else partial(_chained, self.step)

        def phi(*vectors: Any) -> Any:
            try:
                return along(h, steps, *vectors)
            except Stopped as stop:
                why = str(stop).rstrip(".")
                raise RunFailed(f"{why}." if why.startswith(self.name) else f"{self.name}: {why}.", "outside-step-failed") from None

        return phi

    def begin(self, ivp: Ivp, request: Request, grid: Grid, monitored: tuple[str, ...]) -> SampledRun:
        """Return a run at its start of which H alone is sampled: of code that has a state after each step, and remembers nothing else."""
        assert monitored == ("samples",)
        assert self.every_step
        assert not self.remembers
        return SampledRun(self.name, self.blocks, ivp, request, grid)

    def solve(self, ivp: Ivp, request: Request) -> Trajectory | PoissonTrajectory:
        """Return the trajectory; where the code stops early, what was computed so far and why."""
        record = Record(self.name, ivp, request, self.grid(ivp, request), every_step=self.every_step, knob=self.knob)
        outcome = record.outcome(self.blocks)
        t, rows = record.states()
        states = ivp.trajectory.parts(rows)
        if request.multipliers and ivp.on_manifold:
            states["lam"] = ivp.along("lam", states["p"], states["q"])
        return ivp.trajectory(**outcome, t=t, **states)


def _chained(fresh: Callable[[], Step], h: float, steps: int, *vectors: Any) -> Any:
    """Return the state after so many steps of a Python callable."""
    step, state = fresh(), tuple(np.array(vector) for vector in vectors)
    for _ in range(steps):
        result = step(*state, h)
        state = tuple(map(np.asarray, result)) if len(state) == 2 else (np.asarray(result),)
    return state if len(state) == 2 else state[0]


def _at_end(name: str, blocks: Blocks, ivp: Ivp, h: float, steps: int, *vectors: Any) -> Any:
    """Return where a run that begins at a state is after so many steps."""
    if any(map(np.iscomplexobj, vectors)):
        raise TypeError(f"{name} accepts only real numbers")
    start = ivp.at(*(np.array(vector, dtype=float) for vector in vectors))
    end = np.concatenate(start.start)
    for block in blocks(start, Grid(h, steps, 0), Request(value=h, steps=steps)):
        end = block.rows[-1] if len(block.rows) else end
    return np.split(end, 2) if len(vectors) == 2 else end

"""The record of what IDA or CVODE thinks of each step, filled by the compiled loop."""

from typing import Any

import numpy as np

from daebench.errors import Stopped
from daebench.methods.formulations.constrained import Dae, Posed
from daebench.methods.solvers.drive import Array
from daebench.methods.solvers.native import loop
from daebench.methods.solvers.native.libraries import address
from daebench.methods.solvers.native.memory import Solver
from daebench.runs.solver_steps import SolverSteps

ROWS = 512
"""Steps that are noted before the loop comes back."""

MOST_NUMBERS = 50_000_000
"""Numbers of a record, 400 MB; a run that needs more is ended."""

QUESTIONS = ("LastStep", "LastOrder", "NumNonlinSolvIters", "NumErrTestFails", "NumNonlinSolvConvFails", "ErrWeights", "EstLocalErrors")
"""What the solver is asked after each step: a size, four whole numbers, two vectors."""

FEWEST_FAILURES, MOST_FAILURES = 3, 10
"""After so many failures of the error test IDA gives up: as few as it can be told, and as many as it is by default."""

ERROR_TEST_FAILED = -3
"""The flag of a run that ends because the error test fails whatever the step size is."""


class Recorder:
    """Memory that the loop fills with steps.

    Shapes: counts (6,).
    """

    def __init__(self, solver: Solver, posed: Posed, counts: Any, tol: float) -> None:
        self.solver, self.posed, self.counts, self.tol, self.rows = solver, posed, counts, tol, 0
        n = posed.n
        self._size, self._numbers, self._columns = np.zeros(1), np.zeros(loop.COUNTED, np.int64), np.zeros((2, n))
        self._table = np.empty((ROWS, loop.COLUMNS + 3 * n))
        addresses = [address(f"{solver.prefix}Get{name}") for name in QUESTIONS]
        vectors = [solver.vector(column) for column in self._columns]
        self._places = [self._size.ctypes.data, *(self._numbers[k:].ctypes.data for k in range(loop.COUNTED)), *vectors]
        self.memory = np.array([*addresses, *self._places], np.uint64), self._size, self._numbers, self._columns, self._table
        self._pieces: list[Array] = []
        self._refused = 0

    def take(self) -> None:
        """Keep the steps that were noted, and make room."""
        self._keep_noted()
        if self.rows * self._table.shape[1] > MOST_NUMBERS:
            raise Stopped(f"{self.rows} steps are recorded, and there is no room for more", advice="end the run before, or record no steps")

    def refuse(self, flag: int, y: Array) -> None:
        """Keep the attempts that failed in the error test where IDA gave up, at a state: the last one, or those at the first step.

        For these it is started again, and told to give up sooner: after the third failure, which is the least, the fourth, and so on.
        """
        if self.solver.prefix != "IDA":
            return
        self._keep_noted()
        if self.rows == 0:
            for most in range(FEWEST_FAILURES, MOST_FAILURES + 1):
                if self.solver.first_step(most) != ERROR_TEST_FAILED:
                    return
                self._keep_refused(y)
        elif flag == ERROR_TEST_FAILED:
            self._keep_refused(y)

    def _keep_refused(self, y: Array) -> None:
        """Keep an attempt at the order 1, which it is at the start, and after three failures.

        IDA leaves the estimate without its factor: h / (h + h') after a step of size h', and 1/2 at the start.
        """
        for name, place in zip(QUESTIONS, self._places, strict=True):
            self.solver(f"Get{name}", place)
        before = float(self._size[0])
        self.solver("GetCurrentStep", self._places[0])
        h, t = float(self._size[0]), self._pieces[-1][-1, 0] if before else 0.0
        weight, estimate = self._columns
        factor = h / (h + before) if before else 0.5
        self._keep(np.array([[t + h, h, 1, *self._numbers[1:], *y, *weight, *(factor * estimate)]]))
        self._refused += 1

    def _keep_noted(self) -> None:
        self._keep(self._table[: self.counts[loop.NOTED]].copy())
        self.counts[loop.NOTED] = 0

    def _keep(self, rows: Array) -> None:
        self._pieces.append(rows)
        self.rows += len(rows)

    def steps(self) -> SolverSteps:
        """Return the record."""
        self._keep_noted()
        table, n = np.concatenate([np.empty((0, self._table.shape[1])), *self._pieces]), self.posed.n
        each_step = np.diff(table[:, 3:6], axis=0, prepend=0.0).astype(np.int64)
        unknowns = np.empty((3, len(table), n))
        unknowns[:, :, self.solver.order] = table[:, loop.COLUMNS :].reshape(len(table), 3, n).swapaxes(0, 1)
        accepted = np.ones(len(table), bool)
        accepted[len(table) - self._refused :] = False
        blocks = named_blocks(self.posed)
        return SolverSteps(
            t=table[:, 0].copy(),
            h=table[:, 1].copy(),
            order=table[:, 2].astype(np.int64),
            iterations=each_step[:, 0],
            error_failures=each_step[:, 1],
            newton_failures=each_step[:, 2],
            accepted=accepted,
            y=unknowns[0],
            weight=unknowns[1],
            estimate=unknowns[2],
            blocks=blocks,
            tol=self.tol,
            untested=tuple(name for name, place in blocks.items() if not self.solver.tested[place].any()),
        )


def named_blocks(posed: Posed) -> dict[str, slice]:
    """Return where the unknowns are, by what they are: momenta are "p", and functions whose derivatives are multipliers "Lam", "Mu"."""
    names = {"lam": "Lam", "mu": "Mu"} if posed.multipliers == "derivative" else {}
    names |= {"v": "p"} if isinstance(posed, Dae) and not posed.mechanical else {}
    return {names.get(name, name): place for name, place in posed.blocks.items()}

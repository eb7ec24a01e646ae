"""The memory of a solver of SUNDIALS: what it is made of, what is set, and that all of it is given back."""

import ctypes
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from daebench.compiler import callbacks
from daebench.compiler.native import Callback
from daebench.methods.formulations.chain import BandedDae
from daebench.methods.formulations.constrained import Posed
from daebench.methods.solvers.drive import Array
from daebench.methods.solvers.error_test import UNTESTED
from daebench.methods.solvers.native.libraries import Unavailable, address, functions

IDA, ADAMS, BDF = 0, 1, 2
"""IDA, and the families of linear multistep methods of CVODE by its own numbers."""


@dataclass(frozen=True, eq=False)
class Settings:
    """Settings of a solver besides its tolerances."""

    projection: Callback | None = None
    """What CVODE calls to project a step, and the estimate of its error, see :mod:`daebench.methods.solvers.cvode`."""
    length: float = 0.0
    """The length of the initial value problem, which the projection is iterated against."""
    suppressed: NDArray[np.bool_] | None = None
    """Which unknowns IDA is told to be algebraic, and to leave out of the error test; shape (n,)."""


PLAIN = Settings()
"""Nothing besides."""

NO_LIMIT = 2**31 - 1
"""Most steps in one call, which is one step here."""


class Solver:
    """IDA or CVODE on a posed problem, with compiled callbacks; ``with`` gives back all that it holds.

    Functions of SUNDIALS are called as ``solver("SetStopTime", t)``, under the prefix of the solver.

    Shapes: atol (n,).
    """

    def __init__(self, posed: Posed, family: int, tol: float, atol: Array, user: Array, settings: Settings = PLAIN) -> None:
        self.functions, self.prefix = functions(), "CVode" if family else "IDA"
        self.context, self.mem, self._held = ctypes.c_void_p(), ctypes.c_void_p(), list[tuple[str, int]]()
        self.order = posed.order if isinstance(posed, BandedDae) else np.arange(posed.n)
        self.y = np.empty((3, posed.n))
        self.end = 0.0
        self.start = posed.y0[self.order], posed.yp0[self.order]
        self.y[:], self.yp, self.atol, self.user = self.start[0], self.start[1].copy(), atol[self.order].copy(), user
        self.functions["SUNContext_Create"](0, ctypes.addressof(self.context))
        self.functions["SUNContext_ClearErrHandlers"](self.context)  # nothing is printed: flags say what failed
        try:
            self._make(posed, family, tol)
            self._set(settings, atol)
        except BaseException:
            self.free()
            raise

    def _make(self, posed: Posed, family: int, tol: float) -> None:
        call, module, n = self.functions, posed.module, posed.n
        self.vectors = np.array([self.vector(array) for array in (self.y[0], self.yp, self.y[1])], np.uint64)
        call["N_VConst"](1.5, int(self.vectors[2]))
        if not np.all(self.y[1] == 1.5):
            raise Unavailable("SUNDIALS was not built for double precision")
        self.mem.value = call["CVodeCreate"](family, self.context) if family else call["IDACreate"](self.context)
        y, yp = int(self.vectors[0]), int(self.vectors[1])
        self("Init", module.rhs_callback.address, 0.0, y) if family else self("Init", module.residual_callback.address, 0.0, y, yp)
        A, linear = self._linear_solver(posed, n, y)
        self("SetUserData", self.user.ctypes.data)
        self("SVtolerances", tol, self.vector(self.atol))
        self("SetLinearSolver", linear, A)
        self("SetJacFn", (module.rhs_jacobian_callback if family else module.jacobian_callback).address)
        self("SetMaxNumSteps", NO_LIMIT)

    def _set(self, settings: Settings, atol: Array) -> None:
        """Set the settings besides tolerances."""
        if settings.projection:
            self.user[callbacks.LENGTH] = settings.length
            self("SetProjFn", settings.projection.address)
            self("SetProjErrEst", 1)
            self("SetProjFrequency", 1)
        self.tested = atol < UNTESTED
        if settings.suppressed is not None:
            self.tested &= ~settings.suppressed
            self._differential = np.where(settings.suppressed, 0.0, 1.0)[self.order]
            self("SetId", self.vector(self._differential))
            self("SetSuppressAlg", 1)

    def _linear_solver(self, posed: Posed, n: int, y: int) -> tuple[int, int]:
        """Return a matrix and a linear solver for it, and write down how the matrix is stored."""
        call, words = self.functions, self.user.view(np.uint64)
        words[callbacks.VECTOR] = address("N_VGetArrayPointer")
        if isinstance(posed, BandedDae):
            lower, upper = posed.band
            A = self._hold("SUNMatDestroy", call["SUNBandMatrix"](n, upper, lower, self.context))
            self.user[callbacks.WIDTH] = call["SUNBandMatrix_LDim"](A)
            words[callbacks.MATRIX] = address("SUNBandMatrix_Data")
            self.user[callbacks.ABOVE] = call["SUNBandMatrix_StoredUpperBandwidth"](A)
            return A, self._hold("SUNLinSolFree", call["SUNLinSol_Band"](y, A, self.context))
        A = self._hold("SUNMatDestroy", call["SUNDenseMatrix"](n, n, self.context))
        words[callbacks.MATRIX] = address("SUNDenseMatrix_Data")
        return A, self._hold("SUNLinSolFree", call["SUNLinSol_Dense"](y, A, self.context))

    def _hold(self, destroy: str, what: int | None) -> int:
        if not what:
            raise Unavailable(f"SUNDIALS could not make what {destroy} would give back")
        self._held.append((destroy, what))
        return what

    def vector(self, array: Array) -> int:
        """Return a vector of SUNDIALS on the memory of an array, which must live as long."""
        return self._hold("N_VDestroy", self.functions["N_VMake_Serial"](len(array), array.ctypes.data, self.context))

    def __call__(self, name: str, *arguments: Any) -> None:
        """Call a function of the solver."""
        flag = self.functions[self.prefix + name](self.mem, *arguments)
        if flag < 0:
            raise Unavailable(f"{self.prefix}{name} of SUNDIALS returned {flag}")

    def first_step(self, most_failures: int) -> int:
        """Return the flag of the first step of IDA, taken once more, with so many failures of the error test allowed.

        What the memory of callbacks counts stays as it is.
        """
        memory = self.user.copy()
        self.y[:], self.yp[:] = self.start
        self.user[callbacks.MOST], self.user[callbacks.SLOW] = np.inf, 0.0
        y, yp, t = int(self.vectors[0]), int(self.vectors[1]), ctypes.c_double()
        try:
            self("ReInit", 0.0, y, yp)
            self("SetMaxErrTestFails", most_failures)
            self("SetStopTime", self.end)
            return int(self.functions["IDASolve"](self.mem, self.end, ctypes.addressof(t), y, yp, 2))
        finally:
            self.user[:] = memory

    @property
    def step(self) -> int:
        """Address of the function that takes steps."""
        return address("CVode" if self.prefix == "CVode" else "IDASolve")

    @property
    def interpolation(self) -> int:
        """Address of the function that gives the unknowns in the last step."""
        return address(f"{self.prefix}GetDky")

    def free(self) -> None:
        """Give all memory back."""
        if self.mem:
            self.functions[f"{self.prefix}Free"](ctypes.addressof(self.mem))
        for destroy, what in reversed(self._held):
            self.functions[destroy](what)
        if self.context:
            self.functions["SUNContext_Free"](ctypes.addressof(self.context))
        self.mem, self.context, self._held = ctypes.c_void_p(), ctypes.c_void_p(), []

    def __enter__(self) -> "Solver":
        return self

    def __exit__(self, *_: object) -> None:
        self.free()

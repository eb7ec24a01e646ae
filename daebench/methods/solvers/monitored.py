"""Generated functions of a solver's unknowns, which the monitor of a tolerance-driven run evaluates after each step."""

import ctypes
import types
from collections.abc import Callable
from functools import cache, cached_property
from typing import Any

import numpy as np

from daebench.compiler import callbacks
from daebench.compiler.cache import Wrapper
from daebench.compiler.entry import Memory
from daebench.compiler.facts import in_loops
from daebench.compiler.native import Native, no_machine_code
from daebench.compiler.syntax import constants, text_of
from daebench.methods.formulations.constrained import Dae, Posed
from daebench.methods.solvers import step_check

KERNEL = "daebench.schemes.kernels.conserved"

NAMES = ("H", "|g|", "|G H_p|")
"""Names of what is conserved."""

MOST_UNKNOWNS = 400
"""Unknowns up to which it is said by how much a step may change what is conserved: it takes as many values of it."""

ARRAYS = """
def moduli(values):
    total = 0.0
    for value in values:
        total += abs(value)
    return total


def conserved(y, par):
    q, p = y[:{d}], empty({d})
    momenta(y[{d} : 2 * {d}], p, par)
    return H(p, q, par), moduli(g(q, par)), moduli(Gv(p, q, par))
"""
"""Source of the conserved values of a chain."""


class Monitored:
    """Conserved quantities of a run, their largest change by a step within the tolerance, and the distance of G from a loss of rank."""

    def __init__(self, posed: Posed, tol: float) -> None:
        self.posed, self.tol, self.size = posed, tol, posed.ivp.size
        self.compiled = isinstance(posed.residual, Native) and not no_machine_code()
        self.count = len(NAMES) if isinstance(posed, Dae) else 1
        self.positions = posed.ivp.d if isinstance(posed, Dae) and posed.formulation == "index3" else 0
        self.par = tuple(map(float, posed.ivp.par))

    def values(self, y: Any) -> tuple[float, ...]:
        """Return the constants of a motion at a solver's unknowns y, shape(n,): H, and on constrained problems |g| and |G H_p|."""
        if self.compiled:
            return tuple(self._looked(callbacks.VALUES, 0.0, y)[: self.count])
        return tuple(self._evaluated("conserved", y))

    def independence(self, y: Any) -> float:
        """Return the square of what goes to zero where G loses rank; 1 on Poisson systems."""
        return self._looked(callbacks.VALUES, 0.0, y)[3] if self.compiled else float(self._evaluated("independent", y))

    def explained(self, y: Any, h: float) -> tuple[float, float]:
        """Return the change of the first and of the last of the values by errors of tol (1 + |y_j|) in all unknowns.

        Shapes: y (n,).
        """
        if self.size > MOST_UNKNOWNS:
            return float("inf"), float("inf")
        looked = self._looked(callbacks.CHANGES, h, y) if self.compiled else self._evaluated("explained", y, h, self.tol, self.positions)
        return looked[0], looked[1]

    def received(self, before: Any, after: Any) -> float:
        """Return by how much H may be wrong in a step because p_t, the energy received, is in no error test; 0 of systems without time."""
        posed = self.posed
        if not (isinstance(posed, Dae) and posed.ivp.facts.EXTENDED):
            return 0.0
        # The work of drivers follows from multipliers, and plain ones are in no error test either.
        untested = posed.formulation != "ode" and posed.multipliers == "plain"
        return float("inf") if untested else float(abs(after[self.size - 1] - before[self.size - 1]))

    def _evaluated(self, name: str, y: Any, *arguments: Any) -> Any:
        """Return a value of a function that Python executes."""
        with np.errstate(all="ignore"):
            return getattr(self.functions, name)(y, *arguments, self.par)

    @cached_property
    def functions(self) -> types.ModuleType:
        """The generated module: ``conserved``, ``independent`` and ``explained``, or ``look_callback`` where they are compiled."""
        ivp, constrained = self.posed.ivp, isinstance(self.posed, Dae)
        roots: list[str | tuple[str, str]] = [(KERNEL, self._kernel)]
        if constrained:
            roots = ["H", "g", "Gv", "independence"] if ivp.arrays else [*roots, "independence"]
        elif ivp.facts.DOMAIN:
            roots.append("inside")
        wrapper = Wrapper(self._text(), ("conserved", "independent", "explained"), _momenta if constrained and ivp.arrays else None)
        options: dict[str, Any] = {"wrapper": wrapper, "compiled": self.compiled, "singular": ivp.singular}
        options |= {"loops": True} if self._loops else {}
        return ivp.source.linked("monitored", f"What is monitored of {ivp.problem}.", roots, **options)

    @property
    def _loops(self) -> bool:
        """Whether functions of a problem with many unknowns take arrays."""
        return in_loops(self.posed.ivp.facts)

    @property
    def address(self) -> int:
        """Address of the compiled look at steps and outputs, see :mod:`daebench.methods.solvers.step_check`."""
        address: int = self.functions.look_callback.address
        return address

    @property
    def _kernel(self) -> str:
        if not isinstance(self.posed, Dae):
            return "of_state"
        return "of_velocities" if self.posed.mechanical else "of_momenta"

    def _text(self) -> str:
        """Return the source of the functions of unknowns, and with them of the look at steps."""
        posed, ivp, size = self.posed, self.posed.ivp, self.size
        constrained = isinstance(posed, Dae)
        ends = ((size // 2, size), (0, size // 2)) if constrained else ((0, size),)
        vectors = [f"y[{a}:{b}]" if ivp.arrays or self._loops else _tuple("y", range(a, b)) for a, b in ends]
        state = ", ".join([*vectors, "par"])
        value = f"conserved_{self._kernel}({state})"
        functions = {
            "conserved(y, par)": value if constrained else f"({value},)",
            "independent(y, par)": f"independence({state})" if constrained else "1.0",
            "outside(y, par)": f"not inside({state})" if not constrained and ivp.facts.DOMAIN else "False",
            "unpacked(values)": _tuple("values", range(len(ivp.par))),
            "parameters(user)": f"unpacked(carray(real_pointer(user), HEAD + {len(ivp.par)})[HEAD:])",
        }
        texts = {signature: f"def {signature}:\n    return {result}" for signature, result in functions.items()}
        if constrained and ivp.arrays:
            texts["conserved(y, par)"] = ARRAYS.format(d=size // 2)
        return "\n\n".join([_looks(), f"SIZE = {size}", *texts.values()])

    def _looked(self, mode: int, t: float, y: Any) -> list[float]:
        """Return the 4 numbers of the compiled look for unknowns."""
        look, user, state = self._look
        user[callbacks.MODE], state[:] = mode, y
        look(t)
        self._new.require_enough()
        numbers: list[float] = user[callbacks.RESULT : callbacks.RESULT + 4].tolist()
        return numbers

    @cached_property
    def _new(self) -> Memory:
        """Memory for new arrays."""
        return Memory.of_unknowns(self.posed.n)

    @cached_property
    def _look(self) -> tuple[Callable[[float], int], Any, Any]:
        """The compiled look at a time, the memory of calls from Python, in which nothing of a run is noted, and what it looks at."""
        user, state = np.zeros(callbacks.HEAD + len(self.par)), np.empty(self.posed.n)
        user[callbacks.HEAD :] = self.par
        user[callbacks.UNKNOWNS], user[callbacks.PARAMETERS] = self.posed.n, len(self.par)
        user[callbacks.TOLERANCE], user[callbacks.POSITIONS] = self.tol, self.positions
        user.view(np.uint64)[callbacks.ARENA] = self._new.begun()
        look = ctypes.CFUNCTYPE(ctypes.c_int, ctypes.c_double, ctypes.c_void_p, ctypes.c_void_p)(self.address)
        places = state.ctypes.data, user.ctypes.data
        return lambda t: look(t, *places), user, state


def _momenta(derivation: Any) -> str:
    """Return the source of the momenta of a chain."""
    from daebench.methods.formulations.chain_residuals import momenta

    return momenta(derivation.chain)


def _tuple(name: str, places: range) -> str:
    """Return the source of a tuple of entries of an array."""
    return f"({''.join(f'{name}[{i}], ' for i in places)})"


@cache
def _looks() -> str:
    """Return the source of what is the same for all problems: the look at steps."""
    return "\n\n".join([constants(step_check), *map(text_of, step_check.WRITTEN)])

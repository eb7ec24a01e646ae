"""The files of schemes and kernels, executed unchanged on the symbols of a chain.

The constants of the language are settled, and every name is bound to a method of
:class:`daebench.compiler.chain.algebra.ChainLanguage`.
"""

from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

from daebench.compiler import values
from daebench.compiler.chain.fields import Scalar, applied, selected
from daebench.compiler.files import Files, Function, Operation
from daebench.compiler.plain import Plain
from daebench.compiler.shapes import OVERLOADS
from daebench.errors import InvalidProblem

NEWTON = "daebench.schemes.kernels.newton"
BRANCH = "daebench.schemes.kernels.branch"
ITERATIONS = ((NEWTON, "newton"), ("daebench.schemes.kernels.relax", "until_met"), (BRANCH, "walked"))
"""Iterations, as files and names: functions of an update, the unknowns, data, and perhaps numbers."""

OF_REPORTS = ((NEWTON, "judge"), (NEWTON, "both"), (BRANCH, "landed"))
"""Functions of numbers and reports, which are called as they are."""

HOMES = {"H": "mechanical"}
"""Files that compose functions of the scheme language from others; any other such function is in ``composed``."""


class Symbols(Plain):
    """Runs functions of files as Python does, on symbols."""

    def __init__(self) -> None:
        self.names = {name: partial(_chosen, name) for name in ("min", "max")} | {"abs": partial(applied, "abs"), "selected": _selected}
        super().__init__({})

    def body(self, function: Function) -> Operation:
        """Return the function itself."""
        return function.plain


class ChainFiles(Files):
    """The files of a scheme, run on the symbols of a chain."""

    deferred = True

    def __init__(self, tracer: Any) -> None:
        linker = tracer.linker
        super().__init__({"constants": linker.constants, "states": "constrained", "homes": {}, "single": False}, Symbols())
        self.tracer, self.linker = tracer, linker

    def names_of(self, module: str) -> dict[str, Any]:
        """Return the names of a file. Iterations are written; what a chain has of its own takes the place of what is composed."""
        if module in self.read:
            return self.read[module]
        space = super().names_of(module)
        for name in [name for name, value in space.items() if isinstance(value, Function)]:
            if (module, name) in ITERATIONS:
                space[name] = partial(self.tracer.iterated, module, name)
            elif (module, name) in OF_REPORTS:
                space[name] = partial(self._reported, module, name)
            elif module.rpartition(".")[2] in ("mechanical", "composed") and hasattr(self.tracer.language, name):
                space[name] = partial(self._of_chain, name)
        return space

    def _reported(self, module: str, name: str, *arguments: Any) -> Scalar:
        return applied(self.linker.resolve(module, name), *values.held(arguments), Scalar("par"))

    def _of_chain(self, name: str, *args: Any) -> Any:
        return self.called(name, args)

    def operation(self, name: str) -> Any:
        """Return an operation of the chain, or a constant of the type of numbers."""
        return Scalar(name) if name in ("EPS", "INF") else getattr(self.tracer.language, name)

    def bare(self, name: str) -> bool:
        """Whether a function is called without the parameters of the problem, as all are."""
        return True

    def datum(self, place: int, *inside: int) -> Scalar:
        """Return the source of run-time data."""
        return Scalar("par" + "".join(f"[{i}]" for i in (len(self.tracer.nodes.parameters) + place, *inside)))

    def called(self, name: str, args: Sequence[Any]) -> Any:
        """Return the value of a call of a function of the scheme language, and count its work."""
        if name in OVERLOADS or hasattr(self.tracer.language, name):
            work, program = self.linker.work_of("", name), self.tracer.programs[-1]
            program.work = [mine + more for mine, more in zip(program.work or [0] * len(work), work, strict=True)]
            return super().called(name, args)
        module, name = self.linker.filled(name) or (f"daebench.schemes.kernels.{HOMES.get(name, 'composed')}", name)
        if name not in self.names_of(module):
            raise InvalidProblem(
                f"a scheme asks for {name}, which long chains do not support; take a shorter chain, or another scheme.",
                "chain-unsupported-request",
            )
        return self.function(module, name)(*args)


def _selected(test: Any, one: Callable[[], Any], other: Callable[[], Any]) -> Any:
    """Return a choice between two values, which may be elements."""
    if not isinstance(test, Scalar):
        return one() if test else other()
    x, y = one(), other()
    if isinstance(x, values.Element):
        return x.merged(y, lambda a, b: selected(test, lambda: a, lambda: b))
    return selected(test, lambda: x, lambda: y)


def _chosen(name: str, *numbers: Any) -> Any:
    """Return the source of the least or the greatest of some numbers, or of those in a tuple."""
    numbers = tuple(numbers[0]) if len(numbers) == 1 else numbers
    return numbers[0] if len(numbers) == 1 else applied(name, *numbers)

"""Compile kernels in a second process while the first one measures: half of the waiting on a fresh machine."""

import os
import subprocess
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager

_PROGRAM = "import sys; from daebench.pages.report.compile_ahead import compile_tangents; compile_tangents(*sys.argv[1:3], sys.argv[3:])"


@contextmanager
def compiling_ahead(problem: str, case: str, schemes: Sequence[str]) -> Iterator[Callable[[], object]]:
    """Have the complex kernels of some schemes made in another process, and give a function that waits for it.

    Whether it works does not matter to the result: what is not in the cache by then is compiled when it is used. The process ends
    with the block, whatever ends the block.
    """
    if (os.cpu_count() or 1) < 2:
        yield lambda: None
        return
    command = [sys.executable, "-c", _PROGRAM, problem, case, *schemes]
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(path for path in sys.path if path)}
    nothing = subprocess.DEVNULL
    with subprocess.Popen(command, stdin=nothing, stdout=nothing, stderr=nothing, env=environment) as process:
        try:
            yield process.wait
        finally:
            process.kill()


def compile_tangents(problem: str, case: str, schemes: Sequence[str]) -> None:
    """Make the complex kernel of each scheme by taking a step of no consequence."""
    from daebench.methods.fixed_step.constrained import FixedStep
    from daebench.methods.initial_value_problem import initial_value_problem
    from daebench.runs.make_ivp import constrained

    ivp = constrained(initial_value_problem(problem, case))
    for name in schemes:
        FixedStep(name).flow(ivp, 1e-3, 1)(tuple(ivp.p0), tuple(ivp.q0))

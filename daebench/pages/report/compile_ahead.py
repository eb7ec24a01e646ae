"""Compile kernels in a second process while this one measures: half of the waiting on a fresh machine."""

from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import wait
from contextlib import contextmanager

from daebench.pages.report.two_processes import NEEDED
from daebench.runs.machine import cores
from daebench.studies.grid.schedulers import local_processes


@contextmanager
def compiling_ahead(problem: str, case: str, schemes: Sequence[str]) -> Iterator[Callable[[], object]]:
    """Have the complex kernels of some schemes made in another process, and give a function that waits for it.

    Whether it works does not matter to the result: what is not in the cache by then is compiled when it is used.
    """
    if cores() < 2:
        yield lambda: None
        return
    with local_processes(1, NEEDED) as pool:
        made = [pool.submit(compile_tangent, problem, case, name) for name in schemes]
        yield lambda: wait(made)


def compile_tangent(problem: str, case: str, scheme: str) -> None:
    """Make the complex kernel of a scheme by taking a step of no consequence."""
    from daebench.methods.fixed_step.constrained import FixedStep
    from daebench.methods.initial_value_problem import initial_value_problem
    from daebench.runs.make_ivp import constrained

    ivp = constrained(initial_value_problem(problem, case))
    FixedStep(scheme).flow(ivp, 1e-3, 1)(tuple(ivp.p0), tuple(ivp.q0))

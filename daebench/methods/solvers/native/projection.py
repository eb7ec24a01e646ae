"""The projection of a step that CVODE calls, made of generated functions of one problem."""

import types

from daebench.compiler.written import Wrapper
from daebench.methods.formulations.constrained import Dae

KERNEL = "daebench.schemes.kernels.solver_projection"

CALLED_BACK = """
def with_length(values, length):
    return ({parameters}(length, 0.0),)


def projection_callback(t, y, correction, epsilon, error, user):
    own = carray(real_pointer(user), HEAD + {k})
    own[PROJECTIONS] += 1.0
    y = carray(numbers_of_vector(user, y), {n})
    correction = carray(numbers_of_vector(user, correction), {n})
    error = carray(numbers_of_vector(user, error), {n})
    par = with_length(own[HEAD:], own[LENGTH])
    {change} = solver_projection_{kernel}({arguments}, par)
    if report[0] != 0:
        return 1
    {assignments}
    return 0
"""
"""A result other than 0 has CVODE try a smaller step; behind the parameters stand length and rate, as schemes have them."""


def projection(posed: Dae) -> types.ModuleType:
    """Return the module with ``projection_callback``, for a problem as HLW (1.18)."""
    ivp = posed.ivp
    kernel = "of_velocities" if posed.mechanical else "of_momenta"
    wrapper = Wrapper(_text(posed.d, len(ivp.par), kernel), ())
    title = f"The projection of steps of {ivp.problem}."
    return ivp.source.linked("projection", title, [(KERNEL, kernel)], wrapper=wrapper)


def _text(d: int, k: int, kernel: str) -> str:
    """Return the source of the C function for d positions and k parameters."""

    def part(array: str, start: int) -> str:
        return f"({''.join(f'{array}[{i}], ' for i in range(start, start + d))})"

    targets = {"d_w": ("correction", d), "d_q": ("correction", 0), "error_w": ("error", d), "error_q": ("error", 0)}
    return CALLED_BACK.format(
        kernel=kernel,
        k=k,
        n=2 * d,
        parameters="".join(f"values[{i}], " for i in range(k)),
        change=", ".join([*targets, "report"]),
        arguments=", ".join(part(array, start) for array in ("y", "error") for start in (d, 0)),
        assignments="\n    ".join(f"{array}[{start + i}] = {name}[{i}]" for name, (array, start) in targets.items() for i in range(d)),
    )

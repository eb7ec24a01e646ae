"""What a tolerance-driven run conserves, as a function of a solver's unknowns: compiled, for it is asked for after every step."""

import types
from typing import Any

import numpy as np

from daebench.cache import generated
from daebench.codegen import function, pack
from daebench.pose import Dae, Posed
from daebench.reference.meter import Conserved

KERNEL = "daebench.kernels.conserved"


def conserved(posed: Posed) -> Conserved:
    """Return the function of the unknowns y, shape(n,), that gives H, and on constrained problems the moduli of g and G H_p besides.

    Parameters
    ----------
    posed : Posed
        What is solved. Where its functions are not compiled, this one is not either.
    """
    par = tuple(map(float, posed.scene.par))
    if posed.scene.arrays:
        return np.errstate(all="ignore")(_of_arrays(posed, par))
    compiled = hasattr(posed.residual, "signatures")
    call = _module(posed, compiled=compiled).conserved

    def at(y: Any) -> tuple[float, ...]:
        found: tuple[float, ...] = call(y, par)
        return found

    return at if compiled else np.errstate(all="ignore")(at)


def _of_arrays(posed: Posed, par: tuple[float, ...]) -> Conserved:
    """Return it where vectors are arrays, whose functions are there already."""
    scene = posed.scene
    if not isinstance(posed, Dae):
        H, size = scene.functions("H").H, scene.size
        return lambda y: (float(H(y[:size], par)),)
    module = scene.functions("H", "g", "Gv")

    def at(y: Any) -> tuple[float, ...]:
        q, v = posed.unpack(y[None])
        p = posed.momenta(q, v)
        distances = (float(np.sum(np.abs(value))) for value in (module.g(q[0], par), module.Gv(p[0], q[0], par)))
        return float(module.H(p[0], q[0], par)), *distances

    return at


def _module(posed: Posed, *, compiled: bool) -> types.ModuleType:
    scene, size = posed.scene, posed.scene.size
    ends: tuple[tuple[int, int], ...]
    if isinstance(posed, Dae):
        name, ends = "of_velocities" if posed.mechanical else "of_momenta", ((posed.d, size), (0, posed.d))
    else:
        name, ends = "of_state", ((0, size),)
    vectors = ", ".join(pack(f"y[{i}]" for i in range(*each)) for each in ends)
    result = f"conserved_{name}({vectors}, par)"
    wrapper = function("conserved(y, par)", f"return {result if isinstance(posed, Dae) else f'({result},)'}")

    def build(cached: bool) -> str:
        from daebench.link import Linker, Options
        from daebench.syntax import decorated

        linker = Linker(scene.source.derivation, Options(compiled=compiled, singular=scene.singular))
        module = linker.module(f"What {scene.problem} conserves.", [(KERNEL, name)], cached)
        return f"{module}\n\n{decorated(wrapper, ['conserved'], cached) if compiled else wrapper}"

    return generated(f"{scene.problem}_conserved", f"{scene.source.key} conserved {compiled} {scene.singular} {wrapper}", build)

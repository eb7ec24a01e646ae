"""Libraries that are slow to import, each imported where it is first used: ``from daebench.systems.lazily import pandas as pd``.

lazy_loader would do the same, but leaves an unfinished module in ``sys.modules``, where other libraries look for what is there.
"""

from contextlib import suppress
from importlib import import_module
from typing import TYPE_CHECKING, Any

from daebench.errors import BadInput

if TYPE_CHECKING:
    import casadi as casadi
    import exudyn as exudyn
    import heyoka as heyoka
    import jax as jax
    import jax_md as jax_md
    import jinja2 as jinja2
    import llvmlite as llvmlite
    import matplotlib as matplotlib
    import matplotlib.colors
    import matplotlib.patches
    import matplotlib.ticker
    import mici as mici
    import mpmath as mpmath
    import mujoco as mujoco
    import openmm as openmm
    import pandas as pandas
    import pinocchio as pinocchio
    import platformdirs as platformdirs
    import rich as rich
    import rich.progress
    import scipy as scipy
    import sksundae as sksundae
    import solve_dae as solve_dae
    import sympy as sympy

    exudyn_items: Any
    jax_md_constraints: Any
    jnp: Any
else:

    class Later:
        """A library, or a package of one, by its name; ``extra`` is that of daebench with which it is installed."""

        def __init__(self, name: str, extra: str = "") -> None:
            self._name, self._extra = name, extra

        def __getattr__(self, attribute: str) -> Any:
            if attribute.startswith("__"):  # those who ask whether this is a function or a wrapper do not need the library
                raise AttributeError(attribute)
            module = self._imported()
            with suppress(ModuleNotFoundError):  # a package within this one
                import_module(f"{self._name}.{attribute}")
            value = getattr(module, attribute)
            setattr(self, attribute, value)
            return value

        def _imported(self) -> Any:
            try:
                return import_module(self._name)
            except ModuleNotFoundError as error:
                if not self._extra:
                    raise
                library, command = self._name.partition(".")[0], f"pip install 'daebench[{self._extra}]'"
                raise BadInput(f"{library} is needed here, and is not installed; install it by {command}.", "library-missing") from error

    def _later(extra: str, names: str) -> list[Later]:
        return [Later(name, extra) for name in names.split()]

    jinja2, llvmlite, matplotlib, mpmath, pandas = _later("", "jinja2 llvmlite matplotlib mpmath pandas")
    platformdirs, rich, scipy, sksundae, sympy = _later("", "platformdirs rich scipy sksundae sympy")
    heyoka, solve_dae = _later("peers", "heyoka solve_dae")
    (mujoco,) = _later("models", "mujoco")
    casadi, exudyn, exudyn_items, mici, openmm, pinocchio = _later("engines", "casadi exudyn exudyn.itemInterface mici openmm pinocchio")
    jax, jnp, jax_md, jax_md_constraints = _later("engines", "jax jax.numpy jax_md jax_md.mm_forcefields.amber.constraints")

"""Module names of the previous release: each still imports, with a warning, and will be removed in the next release."""

import sys
import warnings
from collections.abc import Sequence
from importlib import import_module
from importlib.machinery import ModuleSpec
from importlib.util import find_spec, spec_from_file_location
from types import ModuleType
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from importlib.abc import Loader
else:
    Loader = object  # importlib.abc takes longer to import than everything else here

MODULES = {
    "api": "methods.run",
    "claims": "schemes.kernels.claims",
    "comparison": "studies.comparison.table",
    "darboux_lie": "diagnostics.darboux_lie",
    "figures": "draw.figures",
    "film.animation": "pages.animation.animation",
    "inputs": "errors",
    "kernels.hole": "schemes.kernels.language",
    "kernels.poisson_hole": "schemes.kernels.poisson_language",
    "kinetic_flows": "systems.kinetic_flows",
    "method": "runs.request",
    "names": "methods.names",
    "order_study": "studies.orders.study",
    "poisson_lattice": "systems.lattice",
    "poisson_system": "systems.poisson",
    "problem": "systems.constrained",
    "reference.certified.record": "reference.keep.record",
    "reference.certified.store": "reference.keep.store",
    "report": "pages.report",
    "scene": "runs.ivp",
    "studies.cell": "studies.grid.run_specification",
    "studies.extreme": "studies.stability.extreme",
    "studies.long_run": "studies.long.run",
    "studies.metrics": "studies.grid.metrics",
    "studies.schedulers": "studies.grid.schedulers",
    "studies.store": "studies.grid.store",
    "studies.study": "studies.grid.study",
    "submanifold": "diagnostics.submanifold",
    "trajectory": "runs.trajectory",
    "vector.axis": "draw.svg.axis",
    "vector.marks": "draw.svg.marks",
    "vector.sheet": "draw.svg.panels",
}
"""Old name of a public module -> its present name, both without ``daebench.``."""

_FOLDERS = {f"daebench.{name.rpartition('.')[0]}" for name in MODULES if "." in name} - {"daebench.studies", "daebench.reference"}


class _OldCall(ModuleType):
    """A package whose name used to be that of a function."""

    def __call__(self) -> Any:
        today = vars(self)["_TODAY"]
        message = f"{self.__name__}() is now daebench.{today}(); the old call will be removed in the next release."
        warnings.warn(message, FutureWarning, stacklevel=2)
        return getattr(sys.modules["daebench"], today)()


def keep_old_call(package: str, today: str) -> None:
    """Make a package callable as the function that had its name; ``today`` is the function's public name."""
    module = sys.modules[package]
    vars(module)["_TODAY"] = today
    module.__class__ = _OldCall


class _Copy(Loader):
    """Fills a module of an old name with the contents of the module of the present name; without a present name it is an empty folder."""

    def __init__(self, target: str | None) -> None:
        self.target = target

    def create_module(self, spec: ModuleSpec) -> None:
        """Leave the creation of the module to Python."""

    def exec_module(self, module: ModuleType) -> None:
        """Copy every name except those that Python itself sets."""
        if self.target is not None:
            names = vars(import_module(self.target))
            vars(module).update({name: value for name, value in names.items() if not (name.startswith("__") and name != "__all__")})


class RenamedModules:
    """Finds modules by their names in the previous release; ``python -m daebench`` uses it to find the command line."""

    def find_spec(self, fullname: str, path: Sequence[str] | None = None, target: ModuleType | None = None) -> ModuleSpec | None:
        """Return how to load a module of an old name; None if the name is not one of them."""
        if not fullname.startswith("daebench."):
            return None
        if fullname == "daebench.__main__":
            command_line = find_spec("daebench.cli.__main__")
            return spec_from_file_location(fullname, command_line.origin) if command_line and command_line.origin else None
        today = MODULES.get(fullname.removeprefix("daebench."))
        if today is not None:
            message = f"the module {fullname} is daebench.{today} now; its old name will be removed in the next release."
            warnings.warn(message, FutureWarning, stacklevel=2)
            return ModuleSpec(fullname, _Copy(f"daebench.{today}"), is_package=fullname in _FOLDERS)
        return ModuleSpec(fullname, _Copy(None), is_package=True) if fullname in _FOLDERS else None


def find_renamed_modules() -> None:
    """Make Python find modules by their old names, after all other finders."""
    if not any(isinstance(finder, RenamedModules) for finder in sys.meta_path):
        sys.meta_path.append(RenamedModules())

"""Files of planted codes as modules."""

from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path

PLANTED = Path(__file__).parent.parent / "studies" / "planted"


def loaded(name):
    """Return a file of planted codes as a module."""
    spec = spec_from_file_location(name, PLANTED / f"{name}.py")
    module = module_from_spec(spec)
    spec.loader.exec_module(module)
    return module

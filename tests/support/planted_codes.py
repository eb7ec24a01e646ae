"""Files of planted codes as modules."""

from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path

import pytest

PLANTED = Path(__file__).parent.parent / "studies" / "planted"


def loaded(name):
    """Return a file of planted codes as a module."""
    spec = spec_from_file_location(name, PLANTED / f"{name}.py")
    module = module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def marks(quick, slow):
    """Return the marks of a code that is tried in each run of the tests, by the gate, or on the day of a release."""
    return [] if quick else [pytest.mark.slow if slow else pytest.mark.exhaustive]

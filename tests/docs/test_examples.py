"""Every public function has an example, and the examples of all docstrings run and print what they show."""

import doctest
import importlib
import inspect

import pytest
from said import ROOT

import daebench
from daebench import testing

MODULES = sorted(
    ".".join((*package, *path.relative_to(ROOT).with_suffix("").parts))
    for folder, package in (("daebench", ()), ("problems", ("daebench",)), ("reference", ("daebench",)), ("reports", ("daebench",)))
    for path in (ROOT / folder).rglob("*.py")
    if not path.parent.is_symlink() and ">>> " in path.read_text(encoding="utf-8")
)


@pytest.mark.parametrize("place", [daebench, testing], ids=lambda place: place.__name__)
def test_every_public_function_has_an_example(place):
    functions = {name: getattr(place, name) for name in place.__all__ if inspect.isfunction(getattr(place, name))}
    assert len(functions) > 8
    assert [name for name, function in functions.items() if ">>> " not in inspect.getdoc(function)] == []


@pytest.mark.slow
@pytest.mark.sampled(left_out=("daebench.pages.certificate.certify", "daebench.studies.certificate.verify"))
@pytest.mark.parametrize("module", MODULES)
def test_the_examples_of_a_module_print_what_they_show(module):
    results = doctest.testmod(importlib.import_module(module), optionflags=doctest.ELLIPSIS)
    assert results.attempted > 0
    assert results.failed == 0


def test_the_parameters_of_a_run_are_those_that_it_takes():
    from daebench.methods.plan import arguments

    names = [*inspect.signature(daebench.run).parameters]
    assert names == [*arguments().parameters]
    listed = inspect.getdoc(daebench.run)
    assert [name for name in names if f"\n{name} :" not in listed and f"{name}," not in listed and f", {name} :" not in listed] == []

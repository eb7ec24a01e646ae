"""Names of the release before: each old module name still imports, warns, and gives what the name of today gives."""

import importlib
import subprocess
import sys
import warnings

import pytest

import daebench
from daebench.systems.renamed_modules import MODULES


@pytest.mark.parametrize("old", sorted(MODULES))
def test_an_old_module_name_warns_and_gives_the_same_things(old, monkeypatch):
    monkeypatch.delitem(sys.modules, f"daebench.{old}", raising=False)
    with pytest.warns(FutureWarning, match=rf"daebench\.{old} is daebench\.{MODULES[old]} now"):
        module = importlib.import_module(f"daebench.{old}")
    today = importlib.import_module(f"daebench.{MODULES[old]}")
    names = [name for name in vars(today) if not name.startswith("__")]
    assert names
    assert all(vars(module)[name] is vars(today)[name] for name in names)


def test_a_name_that_was_never_one_of_ours_is_not_found():
    with pytest.raises(ModuleNotFoundError, match="no_such_module"):
        importlib.import_module("daebench.no_such_module")


def test_python_finds_the_command_line_without_a_warning():
    done = subprocess.run([sys.executable, "-W", "error", "-m", "daebench", "--version"], capture_output=True, text=True)
    assert (done.returncode, done.stderr) == (0, "")


@pytest.mark.parametrize(("package", "today"), [("problems", "list_problems"), ("methods", "list_methods")])
def test_the_package_is_still_called_as_the_function_that_had_its_name(package, today, monkeypatch):
    monkeypatch.setattr(daebench, today, lambda: "the table", raising=False)
    with pytest.warns(FutureWarning, match=rf"daebench\.{today}\(\)"):
        assert getattr(daebench, package)() == "the table"
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert getattr(daebench, package).__name__ == f"daebench.{package}"

"""Commands that are made of studies: options, help, JSON, output and exit status come from the function, its docstring and its result."""

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import daebench
from daebench.cli import commands as listed_commands
from daebench.cli.commands import lines
from daebench.cli.listed import listed
from daebench.cli.signature import command_of

ROOT = Path(daebench.__file__).parent

TOY = '''"""``daebench.toy``: the length of the start of a problem."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from daebench.methods.initial_value_problem import initial_value_problem
from daebench.runs.result import Result


@dataclass(frozen=True)
class Toy(Result):
    """A length."""

    ivp: Any
    length: float

    fails_if: ClassVar[str] = "the length is not above the limit"

    @property
    def status(self) -> int:
        return int(self.length <= 0.5)

    def summary(self) -> dict[str, Any]:
        return {"problem": self.ivp.problem, "length": self.length}

    def printed(self) -> Iterator[str]:
        yield f"length {self.length:g}"


def toy(problem: Any, *, case: str | None = None, parameters: Mapping[str, float] | None = None, factor: float = 2.0) -> Toy:
    """Measure the length of the positions at the start.

    Parameters
    ----------
    factor : float
        Factor of the length.
    """
    ivp = initial_value_problem(problem, case, parameters)
    return Toy(ivp, factor * float(np.linalg.norm(ivp.q0)))
'''
"""A new study, as one file."""


@pytest.fixture
def house(tmp_path):
    """Return a copy of the package with one more study: a file, and a line among the public names."""
    folder = tmp_path / "house"
    shutil.copytree(ROOT, folder / "daebench", ignore=shutil.ignore_patterns("__pycache__"))
    (folder / "daebench" / "studies" / "toy.py").write_text(TOY)
    with (folder / "daebench" / "__init__.pyi").open("a") as stub:
        stub.write("\nfrom .studies.toy import toy as toy\n")
    return folder


def called(house, *words, **more):
    """Return what is printed by a process of Python that imports the house."""
    environment = os.environ | {"PYTHONPATH": str(house)} | more
    return subprocess.run([sys.executable, *words], cwd=house, env=environment, capture_output=True, text=True, check=False)


CALLS = """
import contextlib, io, json, sys
import daebench
from daebench.cli.app import main

found = []
for words in json.loads(sys.argv[1]):
    sys.argv[1:] = words
    with contextlib.redirect_stdout(io.StringIO()) as out:
        try:
            main()
        except SystemExit as stop:
            found.append([stop.code, out.getvalue()])
print(json.dumps([*found, daebench.toy("planar_pendulum", factor=4.0).length]))
"""


@pytest.mark.slow
def test_a_new_study_is_one_file_and_is_found_in_python_and_on_the_command_line(house):
    assert called(house, "-m", "daebench.cli.listed").returncode == 0
    assert "toy             Measure the length" in called(house, "-m", "daebench", "--help").stdout
    asked = ["toy", "planar_pendulum", "--param", "gravity=3", "--factor", "4"]
    calls = [["toy", "--help"], asked, [*asked, "--json"], [*asked, "--factor", "0.1"]]
    made = called(house, "-c", CALLS, json.dumps(calls))
    (_, told), plain, (_, printed), (status, _), in_python = json.loads(made.stdout)
    assert "--factor" in told
    assert plain == [0, "length 4\n"]
    assert json.loads(printed) == {"problem": "planar_pendulum", "length": 4.0}
    assert (status, in_python) == (1, 4.0)
    completed = {"_DAEBENCH_COMPLETE": "complete_bash", "COMP_WORDS": "daebench to", "COMP_CWORD": "1"}
    code = "import sys; sys.argv[0] = 'daebench'; from daebench.cli.__main__ import main; main()"
    shell = called(house, "-c", code, **completed)
    assert sorted(shell.stdout.split()) == ["tolerance-for", "toy"]


def test_the_list_of_commands_is_that_of_the_docstrings():
    assert listed() == (ROOT / "cli" / listed_commands.LIST).read_text(encoding="utf-8")


LOADED = """
import sys
sys.argv[1:] = ["--help"]
try:
    from daebench.cli.__main__ import main; main()
finally:
    print({"numpy", "sympy", "llvmlite", "pandas"} & set(sys.modules), [name for name in sys.modules if "studies" in name])
"""


EACH = """
import sys
from daebench.cli.commands import lines, loaded
for name in lines():
    loaded(name)
    print(name, {"sympy", "pandas", "matplotlib", "jinja2"} & set(sys.modules))
"""


def test_the_help_of_a_command_imports_none_of_what_takes_long():
    out = subprocess.run([sys.executable, "-c", EACH], capture_output=True, text=True, check=True).stdout
    assert out.splitlines() == [f"{name} set()" for name in lines()]


def test_help_of_all_commands_loads_none():
    out = subprocess.run([sys.executable, "-c", LOADED], capture_output=True, text=True, check=False).stdout
    assert out.strip().endswith("set() []")
    assert all(name in out for name in lines())


def test_a_default_of_numbers_is_that_of_the_study_to_the_last_digit():
    command = command_of(daebench.baumgarte)
    parameters = command.__signature__.parameters
    assert parameters["values"].default is None
    assert "[16 from 0.001 to 5.62341]" in parameters["values"].annotation.__metadata__[0].help
    assert parameters["t_end"].default == 10.0

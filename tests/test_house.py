"""The house: links, layers, package lists and CONTRIBUTING say what is there, and imports are light."""

import importlib
import os
import re
import subprocess
import sys
import tomllib
from importlib.util import find_spec
from pathlib import Path

import imports

import daebench
from daebench.methods.registry import registry

ROOT = Path(__file__).parent.parent


def test_the_links_into_the_package_are_relative_and_lead_to_the_folders():
    for folder in ("problems", "reference", "reports"):
        link = ROOT / "daebench" / folder
        assert link.is_symlink()
        assert str(link.readlink()) == f"../{folder}"
        assert (link / "__init__.py").is_file()


def test_every_folder_with_python_in_it_is_a_listed_package():
    listed = set(tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["setuptools"]["packages"])
    folders = (Path(folder) for folder, _, files in os.walk(ROOT / "daebench", followlinks=True) if "__init__.py" in files)
    assert listed == {".".join(folder.relative_to(ROOT).parts) for folder in folders}


def test_every_file_of_the_package_that_is_no_code_is_in_the_wheel():
    data = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["setuptools"]["package-data"]
    packed = {
        file for package, patterns in data.items() for pattern in patterns for file in (ROOT / package.replace(".", "/")).glob(pattern)
    }
    files = (Path(folder) / name for folder, _, names in os.walk(ROOT / "daebench", followlinks=True) for name in names)
    rest = {file for file in files if file.suffix not in (".py", ".pyc")} - packed
    assert {file for file in rest if file.parent.name != "gallery"} == set()  # stored pages are of the repository alone


CONTRIBUTING = (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8")


def test_no_module_imports_another_in_a_circle():
    assert imports.circles(imports.imports()) == []


def test_a_circle_of_imports_is_found_where_there_is_one():
    graph = {"a": {"b"}, "b": {"c"}, "c": {"b"}, "d": {"a"}}
    assert imports.circles(graph) == [["b", "c"], ["c", "b"]]


def test_the_picture_of_the_packages_has_the_arrows_that_the_code_has():
    drawn = set(re.findall(r"^    (\w+) --> (\w+)$", CONTRIBUTING, re.MULTILINE))
    assert drawn == imports.reduced(imports.rooms(imports.imports()))


def test_the_package_has_at_most_eighteen_entries_in_at_most_fourteen_layers():
    entries = [path for path in (ROOT / "daebench").iterdir() if not path.name.startswith("__") and (path.suffix == ".py" or path.is_dir())]
    (contract,) = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["importlinter"]["contracts"]
    assert len(entries) <= 18
    assert len(contract["layers"]) <= 14


def test_every_file_that_contributing_names_is_there():
    named = set(re.findall(r"`((?:\w+/)+(?:\w+\.py)?)`", CONTRIBUTING))
    missing = [name for name in named if "my_" not in name and not any((ROOT / place / name).exists() for place in ("", "daebench"))]
    assert missing == []
    assert len(named) > 40


def test_a_scheme_file_says_what_it_is_and_where_it_is_from():
    for file, member in registry().values():
        text = (ROOT / "daebench" / "schemes" / f"{file}.py").read_text(encoding="utf-8")
        assert text.startswith('"""'), file
        assert "::\n" in text or file == "seproj"
        assert any(words in member.claims.source for words in ("HLW", "(19", "(20")), file


def test_schemes_have_names_of_their_own():
    names = [name for file in sorted({file for file, _ in registry().values()}) for name in _names(file)]
    assert len(names) == len(set(names)) == len(registry())


def _names(file):
    module = importlib.import_module(f"daebench.schemes.{file}")
    return list(getattr(module, "MEMBERS", {file: None}))


def test_editing_a_problem_or_a_helper_beside_it_makes_other_kernels(tmp_path):
    from daebench.methods.catalogue import _read

    text = (ROOT / "problems" / "planar_pendulum.py").read_text(encoding="utf-8")
    (tmp_path / "mine.py").write_text(text)
    digests = [_read(tmp_path / "mine.py").digest]
    (tmp_path / "_helper.py").write_text("G = 9.81\n")
    digests.append(_read(tmp_path / "mine.py").digest)
    (tmp_path / "mine.py").write_text(text.replace("q[1]", "q[0]"))
    digests.append(_read(tmp_path / "mine.py").digest)
    assert len(set(digests)) == 3


def test_no_public_name_is_that_of_a_module_which_would_hide_it_once_it_is_imported():
    assert [name for name in daebench.__all__ if find_spec(f"daebench.{name}")] == ["joints", "methods", "problems"]


def test_importing_the_diagnostics_imports_neither_sympy_nor_llvmlite_nor_pandas():
    names = ["consistency", "energy", "growth", "integrals", "manifold", "metric", "order", "reversibility", "symplecticity"]
    code = "import sys\n" + "".join(f"import daebench.diagnostics.{name}\n" for name in names)
    code += "print([name for name in ('sympy', 'llvmlite', 'pandas', 'scipy') if name in sys.modules])"
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout.strip() == "[]"

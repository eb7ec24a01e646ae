"""Problems that other packages bring: listed without an import, used by name, and mistakes named with the package."""

import json
import sys

import pytest
from own_files import HELPED, RING
from refusals import refused, unsaid

import daebench as package
from daebench.errors import InvalidProblem
from daebench.methods.catalogue import find_problem
from daebench.methods.initial_value_problem import initial_value_problem
from daebench.systems.files.plugins import plugins


@pytest.fixture
def install(tmp_path, monkeypatch):
    """Return a function that puts a package with a problem where Python finds it, as an installer does."""
    monkeypatch.syspath_prepend(str(tmp_path))

    def installed(package_name, entry_points, **files):
        (tmp_path / package_name).mkdir(exist_ok=True)
        for name, text in {"__init__": "raise RuntimeError('imported too early')\n", **files}.items():
            (tmp_path / package_name / f"{name}.py").write_text(text)
        info = tmp_path / f"{package_name}-1.2.dist-info"
        info.mkdir()
        (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {package_name}\nVersion: 1.2\n")
        lines = "\n".join(f"{name} = {value}" for name, value in entry_points.items())
        (info / "entry_points.txt").write_text(f"[daebench.problems]\n{lines}\n")
        plugins.cache_clear()

    yield installed
    plugins.cache_clear()
    for name in list(sys.modules):
        if name.partition(".")[0].startswith("plugged"):
            del sys.modules[name]


def test_a_problem_of_another_package_is_listed_without_importing_it_and_used_by_name(daebench, install, monkeypatch):
    install("plugged", {"plugged_ring": "plugged.ring"}, ring=RING)
    status, out, err = daebench("list", "problems", "--json")
    rows = {row["name"]: row for row in json.loads(out)["problems"]}
    assert (status, err) == (0, "")
    assert rows["plugged_ring"]["about"] == "A bead on a ring, free to slide."
    assert (rows["plugged_ring"]["package"], rows["planar_pendulum"]["package"]) == ("plugged 1.2", "daebench")
    assert "did you mean plugged_ring or " in daebench("show", "pluged_ring")[2]
    (find_problem("plugged_ring").path.parent / "__init__.py").write_text("")
    assert initial_value_problem("plugged_ring", "turning").p0.tolist() == [6.0, 0.0]
    monkeypatch.setattr("daebench.methods.catalogue.problems", dict)
    assert package.list_problems().to_dict("list") == {
        "problem": ["plugged_ring"],
        "kind": ["constrained"],
        "summary": ["A bead on a ring, free to slide."],
        "parameters": [{"mass": 2.0, "radius": 1.5}],
        "cases": [["turning", "resting"]],
    }


def test_a_mistake_in_a_problem_of_another_package_is_named(daebench, install, monkeypatch):
    install("plugged2", {"plugged_wrong": "plugged2.ring:problem"}, ring=RING.replace("    turn =", "    1 / 0\n    turn ="), __init__="")
    status, _, err = daebench("show", "plugged_wrong")
    assert (status, daebench.error.code) == (2, "user-file-raises")
    assert unsaid(["plugged_wrong, in ring.py, line 14", "ZeroDivisionError"], err) == []
    monkeypatch.setattr("daebench.methods.catalogue.problems", dict)
    with pytest.warns(UserWarning, match="plugged_wrong of plugged2 1.2 .* line 14"):
        assert package.list_problems().empty


@pytest.fixture
def install_module(install, tmp_path):
    """Return a function that installs a problem as a module that is in no package, with modules beside it."""

    def installed(name, **files):
        install(f"{name}_dist", {f"{name}_problem": name})
        for each, text in files.items():
            (tmp_path / f"{each}.py").write_text(text)

    return installed


def test_a_problem_in_a_module_of_its_own_depends_on_the_modules_that_it_imports(install_module, tmp_path):
    install_module("plugged7", plugged7=HELPED.replace("helper_of_ring", "plugged7_helper"), plugged7_helper="SPEED = 3\n")
    before = find_problem("plugged7_problem").digest
    plugins.cache_clear()
    assert find_problem("plugged7_problem").digest == before
    (tmp_path / "plugged7_helper.py").write_text("SPEED = 4\n")
    plugins.cache_clear()
    assert find_problem("plugged7_problem").digest != before


def test_the_place_of_a_mistake_in_a_module_of_its_own_is_in_no_other_package(install_module):
    hidden = '__import__("importlib").import_module("plugged8_other")'
    text = RING.replace("    turn =", f"    {hidden}.break_down()\n    turn =", 1)
    install_module("plugged8", plugged8=text, plugged8_other="def break_down():\n    raise ValueError('too much')\n")
    with refused("user-file-raises", InvalidProblem, ["plugged8_problem, in plugged8.py, line 14", "ValueError: too much"]):
        initial_value_problem("plugged8_problem")


BROKEN = {
    "no module": ({"plugged_b": "plugged3.nothing"}, ["plugged_b", "plugged3 1.2", "plugged3.nothing"]),
    "no package": ({"plugged_b": "plugged_nowhere"}, ["plugged_nowhere"]),
    "no problem": ({"plugged_b": "plugged3.empty"}, ["empty.py"]),
    "not Python": ({"plugged_b": "plugged3.bad"}, ["line 1"]),
    "other attribute": ({"plugged_b": "plugged3.ring:scene"}, ["'plugged3.ring:scene'"]),
    "name of daebench's own": ({"planar_pendulum": "plugged3.ring"}, ["planar_pendulum", "plugged3 1.2"]),
    "name of a file": ({"a/b": "plugged3.ring"}, ["'a/b'"]),
}


@pytest.mark.parametrize(("entry_points", "names"), BROKEN.values(), ids=BROKEN)
def test_a_broken_entry_point_is_named_and_does_not_spoil_the_list(daebench, install, entry_points, names):
    install("plugged3", entry_points, ring=RING, empty="", bad="def (")
    status, out, err = daebench("list", "problems", "--json")
    assert (status, unsaid(names, err), err.count("\n")) == (0, [], 1)
    assert "planar_pendulum" in [row["name"] for row in json.loads(out)["problems"]]
    if "plugged_b" in entry_points:
        assert unsaid(names, daebench("show", "plugged_b")[2]) == []


def test_a_name_that_two_packages_bring_is_refused(daebench, install):
    for name in ("plugged4", "plugged5"):
        install(name, {"plugged_twice": f"{name}.ring"}, ring=RING)
    for words, status in ((("list", "problems"), 0), (("show", "plugged_twice"), 2)):
        found, _, err = daebench(*words)
        assert (found, unsaid(["plugged_twice", "plugged4 1.2", "plugged5 1.2"], err)) == (status, [])

"""A problem file that gives another system each time it is read is refused, and one that gives the same is taken."""

import os

import pytest
import sympy as sp
from own_files import ORBIT, RING
from refusals import refused
from sympy.core.cache import clear_cache

import daebench
from daebench.errors import InvalidProblem
from daebench.methods.catalogue import find_problem, problems

CHANGES = {
    "clock": ("import time", "sp.Rational(time.perf_counter_ns())"),
    "random": ("import random", "sp.Rational(random.getrandbits(60))"),
    "numpy": ("import numpy", "sp.Rational(int(numpy.random.default_rng().integers(2**60)))"),
    "system": ("import os", "sp.Rational(int.from_bytes(os.urandom(8)))"),
    "identity": ("", "sp.Rational(id(object()) + next(COUNT))"),
    "counter": ("", "next(COUNT)"),
    "module": ("import time; NOW = time.perf_counter_ns()", "sp.Rational(NOW)"),
}
"""What is imported, and the weight of the bead, another one each time."""


def changing(name, text=RING):
    """Return the ring's file with one of the changes."""
    imported, weight = CHANGES[name]
    start = f"import sympy as sp\nimport itertools\n{imported}\nCOUNT = itertools.count(1)\n"
    return text.replace("import sympy as sp\n", start, 1).replace("U=sp.S.Zero", f"U=({weight}) * q[1]", 1)


@pytest.fixture
def written(tmp_path):
    def write(text, name="own.py"):
        path = tmp_path / name
        path.write_text(text)
        return path

    return write


@pytest.mark.parametrize("change", CHANGES)
def test_a_file_that_gives_another_system_each_time_is_refused(written, change):
    path = written(changing(change))
    with refused("definition-changes-on-reading", kind=InvalidProblem):
        daebench.compare(path, methods=["rattle", "lobatto2"], h=0.1, t_end=0.2)


@pytest.mark.parametrize("part", ["case", "parameter", "potential"])
def test_what_changes_between_two_processes_is_refused_in_the_second(written, monkeypatch, part):
    by = 'sp.Integer(os.environ["DAEBENCH_TEST_TURN"])'
    lines = {
        "case": ('"resting": Case(q=(r, 0), p=(0, 0))', f'"resting": Case(q=(r, 0), p=(0, {by}))'),
        "parameter": ("parameters={m: mass, r: radius}", f"parameters={{m: mass, r: float({by})}}"),
        "potential": ("U=sp.S.Zero", f"U={by} * q[1]"),
    }
    path = written(RING.replace("import sympy as sp\n", "import os\n\nimport sympy as sp\n", 1).replace(*lines[part], 1))
    monkeypatch.setenv("DAEBENCH_TEST_TURN", "1")
    find_problem(str(path)).define()
    find_problem(str(path)).define()
    monkeypatch.setenv("DAEBENCH_TEST_TURN", "2")
    with refused("definition-changes-on-reading", kind=InvalidProblem):
        find_problem(str(path)).define()
    assert os.environ["DAEBENCH_TEST_TURN"] == "2"


def test_files_that_give_the_same_system_are_taken(written):
    seeded = changing("random").replace("random.getrandbits(60)", "random.Random(3).randint(1, 3)")
    dummies = RING.replace('sp.symbols("rate angle", real=True)', 'sp.Dummy("rate", real=True), sp.Dummy("angle", real=True)')
    assert dummies != RING
    for k, text in enumerate((RING, ORBIT, seeded, dummies)):
        path = written(text, f"same{k}.py")
        for _ in range(3):
            find_problem(str(path)).define()


def test_a_file_is_taken_after_another_that_declares_its_symbols_in_other_words(written):
    path = written(RING, "again.py")
    names = [str(symbol) for symbol in find_problem(str(path)).define().q]
    clear_cache()
    elsewhere = [sp.Symbol(name, real=True, finite=True) ** power for name in names for power in (1, 2)]
    assert find_problem(str(path)).define().q[0] ** 2 in elsewhere


@pytest.mark.exhaustive
def test_texts_of_the_catalogue_do_not_depend_on_what_was_read_before():
    def texts(name):
        definition = find_problem(name).define()
        return definition.fingerprint, definition.mathematics

    alone = {}
    for name in problems():
        clear_cache()
        alone[name] = texts(name)
    clear_cache()
    assert [name for name in problems() if texts(name) != alone[name]] == []

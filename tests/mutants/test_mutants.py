"""Planted faults: each is caught by two tests of the gate that do not share a file nor an oracle, or the data say why by one only."""

import mechanical
import planting
import pytest
from reached import Calls

FAULTS = planting.faults()
SAMPLE = planting.drawn(FAULTS, planting.digest(), planting.SAMPLE)
"""The faults that the gate plants: others after each change, the same for the same tree."""


@pytest.fixture(scope="module")
def tree(tmp_path_factory):
    """A copy of the tree to plant faults in."""
    return planting.copy_tree(tmp_path_factory.mktemp("planted") / "tree")


@pytest.mark.parametrize("name", [pytest.param(name, marks=[] if name in SAMPLE else [pytest.mark.exhaustive]) for name in FAULTS])
def test_a_planted_fault_is_caught_by_each_of_its_tests(name, tree):
    fault = FAULTS[name]
    text = planting.with_fault((tree / fault.file).read_text(encoding="utf-8"), fault)
    with planting.replaced(tree, fault.file, text):
        assert planting.outcomes(tree, fault.killers) == dict.fromkeys(fault.killers, "failed"), fault.words


KILLERS = sorted({test for fault in FAULTS.values() for test in fault.killers})
PARTS = 8
"""Runs among which the tests are divided, so that several processes can take them."""


@pytest.mark.exhaustive
@pytest.mark.parametrize("part", range(PARTS))
def test_these_tests_pass_without_a_fault(part, tree):
    tests = KILLERS[part::PARTS]
    assert planting.outcomes(tree, tests, longest=10 * planting.LONGEST) == dict.fromkeys(tests, "passed")


def test_a_fault_is_at_one_place_and_changes_it():
    for fault in FAULTS.values():
        text = (planting.ROOT / fault.file).read_text(encoding="utf-8")
        assert planting.with_fault(text, fault) != text, fault.name
        compile(planting.with_fault(text, fault), fault.file, "exec")


def test_a_fault_has_tests_of_two_files_or_a_reason():
    for fault in FAULTS.values():
        files = {test.partition("::")[0] for test in fault.killers}
        assert files, fault.name
        assert len(files) > 1 or fault.only_one, fault.name


def test_the_tests_of_faults_are_there():
    for test in KILLERS:
        file, _, name = test.partition("::")
        assert f"def {name.partition('[')[0]}(" in (planting.ROOT / file).read_text(encoding="utf-8"), test


def test_a_stale_fault_is_an_error():
    fault = planting.Fault(name="twice", words="", file="x.py", old="a", new="b", killers=())
    with pytest.raises(LookupError, match="stands 2 times"):
        planting.with_fault("a + a", fault)


def test_the_sample_depends_on_the_seed_alone():
    names = [f"fault {k}" for k in range(100)]
    assert planting.drawn(names, "tree", 8) == planting.drawn(reversed(names), "tree", 8)
    assert planting.drawn(names, "tree", 8) != planting.drawn(names, "another tree", 8)


def test_a_mutant_meets_the_tests_that_call_its_function_quickest_first(tmp_path, monkeypatch):
    monkeypatch.setattr(planting, "ROOT", tmp_path)
    monkeypatch.setattr(mechanical, "BUDGET", 3.5)
    (tmp_path / "a.py").write_text("LIMIT = 1\n\n@cache\ndef outer():\n    def inner():\n        return 2\n    return inner() + 3\n")
    by_line = {mutant.line: mutant for mutant in mechanical.mutants("a.py", (tmp_path / "a.py").read_text())}
    seconds = {"slow": 3.0, "quick[1]": 1.0, "quick[2]": 1.0, "other": 2.0, "none": 0.1}
    tests = {"a.py:3": ["slow", "quick[2]", "quick[1]"], "a.py:5": ["other"], "b.py:3": ["none"]}
    assert mechanical.asked(by_line[7], seconds, tests) == ["quick[1]"]  # with the next of other tests it is over the limit
    assert mechanical.asked(by_line[6], seconds, tests) == ["other"]
    assert mechanical.asked(by_line[1], seconds, tests) == ["quick[1]", "other"]
    assert mechanical.asked(by_line[1], seconds, {}) == []


def test_the_functions_that_a_test_calls_are_noted(request):
    calls, item = Calls(("tests/mutants",)), request.node
    noting = calls.pytest_runtest_protocol(item)
    next(noting)
    mechanical.another(3)
    with pytest.raises(StopIteration):
        noting.send(True)
    line = mechanical.another.__code__.co_firstlineno
    assert calls.tests[f"tests/mutants/mechanical.py:{line}"] == [item.nodeid]
    assert calls.seconds[item.nodeid] >= 0

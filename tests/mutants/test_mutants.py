"""Planted faults: each is caught by two tests of the gate that do not share a file nor an oracle, or the data say why by one only."""

import planting
import pytest

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

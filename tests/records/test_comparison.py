"""Comparison of records: which values are equal to the bit, within rounding, or different, and seals that reveal a change."""

import math

import pytest

from daebench.records.comparison import DIFFERS, EQUAL, WITHIN, compare, is_number, same_sentence
from daebench.records.seals import checksum, digests, is_inside, of_another_version, sealed


def close(place, old, new):
    """Rounding that makes differences of a millionth, of numbers alone."""
    return is_number(old) and is_number(new) and abs(old - new) <= 1e-6


def verdicts(old, new):
    return [pair.verdict for pair in compare({"x": old}, {"x": new}, close)]


@pytest.mark.parametrize(
    ("old", "new", "verdict"),
    [
        (1.0, 1.0, EQUAL),
        (1, 1.0, EQUAL),
        (math.nan, math.nan, EQUAL),
        (math.inf, math.inf, EQUAL),
        (None, None, EQUAL),
        (1.0, 1.0 + 1e-9, WITHIN),
        (1.0, 1.1, DIFFERS),
        (1, True, DIFFERS),
        (0.0, None, DIFFERS),
        (1.0, math.nan, DIFFERS),
        (1.0, math.inf, DIFFERS),
        ("a", "b", DIFFERS),
        ([1.0], [1.0, 1.0], DIFFERS),
    ],
    ids=repr,
)
def test_two_values_are_equal_within_or_different_from_either_side(old, new, verdict):
    assert verdicts(old, new) == verdicts(new, old) == [verdict]


def test_without_rounding_nothing_is_within_and_infinite_differences_never_are():
    assert [pair.verdict for pair in compare([1.0], [1.0 + 1e-15])] == [DIFFERS]
    assert [pair.verdict for pair in compare([1.0], [math.inf], lambda *_: True)] == [DIFFERS]
    assert [pair.verdict for pair in compare({"x": None}, {}, lambda *_: True)] == [DIFFERS]


def test_a_pair_has_its_place_and_its_relative_difference():
    pairs = [*compare({"a": {"b": [1.0, 2.0]}, "c": 1}, {"a": {"b": [1.0, 4.0]}, "d": 2})]
    assert {pair.place: pair.difference for pair in pairs if pair.is_number} == {("a", "b", 0): 0.0, ("a", "b", 1): 0.5}
    assert {pair.place: (pair.old, pair.new) for pair in pairs if not pair.is_number} == {("c",): (1, None), ("d",): (None, 2)}


def test_sentences_are_the_same_but_for_numbers_and_paths():
    assert same_sentence("stopped at t = 1.5 in ./ring.py", "stopped at t = 2e-3 in elsewhere/ring.py")
    assert not same_sentence("stopped at t = 1.5", "stopped at x = 1.5")
    assert not same_sentence("v1", "v2")


def test_a_change_breaks_the_seal():
    whole = sealed({"a": [1.0, 2.0], "b": "text"})
    assert whole["checksum"] == checksum(whole) == checksum(dict(reversed(whole.items())))
    assert checksum(whole | {"a": [1.0, 2.5]}) != whole["checksum"]
    assert digests({"a": b"1"}) != digests({"a": b"2"})


def test_a_file_of_another_version_is_told_apart(tmp_path):
    assert of_another_version(tmp_path, 1, 1, 2) == of_another_version(tmp_path, 2, 1, 2) == ""
    assert "a newer daebench (format 3, here 2)" in of_another_version(tmp_path, 3, 1, 2)
    assert "another daebench (format 0, here 2)" in of_another_version(tmp_path, 0, 1, 2)
    assert "another daebench (format True, here 1)" in of_another_version(tmp_path, True, 1)


@pytest.mark.parametrize("name", ["", "/etc/passwd", "../x", "a/../../x", "C:x", "a\\b", "a\0b"], ids=repr)
def test_a_path_that_leads_out_is_seen(name):
    assert not is_inside(name)
    assert is_inside("code/1/mine.py")

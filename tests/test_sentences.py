"""Errors: each has a code, and their sentences are listed to be read."""

import pickle
import re

import pytest
from refusals import refused
from sentences import CODE, LISTED, listed, raised

from daebench.errors import BadInput, InvalidProblem, positive
from daebench.methods.outside.process import told


def test_every_error_has_a_code_of_words_and_a_code_one_sentence():
    places = raised()
    assert len(places) > 800
    assert [place for place in places if not re.fullmatch(CODE, place.code)] == []
    sentences = {}
    for place in places:
        sentences.setdefault(place.code, set()).add(place.sentence)
    assert {code: several for code, several in sentences.items() if len(several) > 1} == {}


def test_the_list_of_sentences_is_that_of_the_source():
    assert LISTED.read_text(encoding="utf-8") == listed(), "run python tests/support/sentences.py, and read the change as English"


def test_an_error_has_its_code_and_fields_when_it_is_caught_pickled_or_told_by_another_process():
    with refused("not-positive", name="h", value=-1.0) as caught:
        positive("h", -1)
    again = pickle.loads(pickle.dumps(caught.value))
    assert (str(again), again.code, again.fields) == (str(caught.value), "not-positive", {"name": "h", "value": -1.0})
    assert told({"error": "BadInput", "text": "no.", "code": "not-so"}).code == "not-so"
    assert BadInput("of somebody else.").code == ""


@pytest.mark.parametrize(
    ("code", "kind", "fields"),
    [("not-whole", BadInput, {}), ("not-positive", InvalidProblem, {}), ("not-positive", BadInput, {"name": "k"})],
)
def test_another_code_kind_or_field_is_not_passed(code, kind, fields):
    with pytest.raises((AssertionError, BadInput)), refused(code, kind, **fields):
        positive("h", -1)


def test_a_command_is_ended_by_an_error_with_a_code(daebench):
    assert daebench("show", "double_pendulu")[0] == 2
    assert (daebench.error.code, daebench.error.fields["name"]) == ("unknown-name", "double_pendulu")
    assert daebench("show", "double_pendulum")[0] == 0
    assert daebench.error is None

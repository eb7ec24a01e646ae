"""Agreement of a user's file with a reference: digits, when it leaves, in which component, and what is refused."""

import json

import numpy as np
import pytest
from refusals import refused
from rotating import COMPONENTS, NAME, texts
from tampered import nudged

from daebench.reference.check.file_agreement import Place, agreement
from daebench.reference.keep import store
from daebench.reference.keep.trajectory_file import read
from daebench.runs.state import CONSTRAINED

pytestmark = pytest.mark.usefixtures("plain_functions")


@pytest.fixture
def file(tmp_path):
    """Write a file and return its path."""

    def write(rows, header=("t", *COMPONENTS), separator=","):
        path = tmp_path / "own.csv"
        path.write_text("".join(separator.join(row) + "\n" for row in [header, *rows]), encoding="utf-8")
        return path

    return write


def stored(references):
    text = store.load(NAME, references).text
    return [list(row) for row in zip(*text.values(), strict=True)]


def moved(rows, column, by, start=0):
    """Return rows with a number added to one column from a row on."""
    text = dict(zip(("t", *COMPONENTS), map(list, zip(*rows, strict=True)), strict=True))
    for k in range(start, len(rows)):
        nudged(column, by, k)(text)
    return list(zip(*text.values(), strict=True))


def test_the_stored_digits_agree_as_far_as_their_bound_and_as_far_as_a_run_in_doubles_could_is_said(references, file):
    found = agreement(file(stored(references)), NAME, references)
    assert (found.rows, found.compared, found.passed_over, found.beyond) == (33, 33, 0, 0)
    assert 31 < found.digits < 33.5
    assert (found.left, {*found.lost.values()}) == (None, {None})
    assert all(column.error == 0 and column.digits == column.allowed for column in found.columns)
    half = agreement(file(stored(references)[:17]), NAME, references)
    assert half.t_end == 2.0
    assert half.possible == pytest.approx(-np.log10(2.0**-53 * store.load(NAME, references).worst_amplification[16]))


@pytest.mark.parametrize("by", ["3e-5", "-3e-14", "3e-25"], ids=["single", "double", "quadruple"])
def test_a_known_error_is_found_in_its_column_to_any_digit(references, file, by):
    reference, rows, error = store.load(NAME, references), stored(references), abs(float(by))
    for column in COMPONENTS:
        found = agreement(file(moved(rows, column, by, start=9)), NAME, references)
        assert (found.worst.name, found.worst.t) == (column, pytest.approx(9 / 8))
        assert found.digits == pytest.approx(-np.log10(error / np.abs(getattr(reference, column[:-1])).max()), abs=1e-6)
        assert found.worst.error == pytest.approx(error, rel=1e-6, abs=0)
        assert all(each.digits > 31 for each in found.columns if each.name != column)


def test_when_it_leaves_and_when_digits_are_lost_in_units_of_the_motion_are_the_first_times(references, file):
    rows = stored(references)
    assert np.abs(store.load(NAME, references).p).max() == 2.5  # of which 2e-9 is less than 1e-9
    for column, by, start in (("p2", "2e-9", 4), ("q1", "1e-2", 10), ("lam1", "1", 20)):
        rows = moved(rows, column, by, start)
    found = agreement(file(rows), NAME, references)
    assert found.lost == {12: Place(0.5, "p2")} | dict.fromkeys((9, 6, 3), Place(1.25, "q1"))
    assert found.left == Place(2.5, "lam1")
    assert agreement(file(rows), NAME, references, within=0.005).left == Place(1.25, "q1")
    assert agreement(file(rows), NAME, references, within=0.5).left is None


@pytest.mark.parametrize(("written", "least", "most"), [("{:.6f}", 6, 7), ("{:.9e}", 9, 10.5), ("{!r}", 15.5, 17.5)], ids=str)
def test_digits_are_not_more_than_the_file_has(references, file, written, least, most):
    reference = store.load(NAME, references)
    columns = [reference.t, *reference.q.T, *reference.p.T, *reference.lam.T]
    rows = [[repr(float(row[0])), *(written.format(float(x)) for x in row[1:])] for row in zip(*columns, strict=True)]
    for each in agreement(file(rows), NAME, references).columns:
        assert least < each.digits <= each.allowed < most


def test_between_stored_times_the_closed_form_agrees_to_double_precision(references, file):
    exact = [[repr(float(t)), *texts(float(t), 40)] for t in np.linspace(0, 4, 24)]
    found = agreement(file(exact), NAME, references)
    assert (found.compared, found.passed_over) == (24, 0)
    for each in found.columns:
        assert 11 < each.digits == each.allowed < 16
        assert each.error <= 10**-each.allowed * each.size
    wrong = agreement(file(moved(exact, "q2", "1e-7", start=5)), NAME, references)
    assert (wrong.worst.name, wrong.worst.error) == ("q2", pytest.approx(1e-7, rel=1e-4))
    assert wrong.lost[9] == Place(pytest.approx(20 / 23), "q2")


def test_of_very_many_rows_all_stored_ones_and_an_even_choice_of_the_others_are_compared(references, file):
    fine = file([[repr(k / 1000), "1.0"] for k in range(4001)], ("t", "q1"))
    found = agreement(fine, NAME, references, between=10)
    assert (found.rows, found.compared, found.passed_over, found.t_end) == (4001, 33 + 10, 4001 - 43, 4.0)
    assert agreement(fine, NAME, references, between=0).compared == 33
    for settings, code in (({"within": 0}, "not-positive"), ({"between": -1}, "below-least")):
        with refused(code):
            agreement(fine, NAME, references, **settings)


def test_one_component_in_any_order_is_enough_and_columns_that_are_absent_or_unknown_are_named(references, file):
    rows = [[row[5], "x", row[0], row[2]] for row in stored(references)]
    found = agreement(file(rows, (" lam1", "note", "t", "q2 ")), NAME, references)
    assert ([each.name for each in found.columns], found.ignored, found.missing) == (["lam1", "q2"], ("note",), ("q1", "p1", "p2"))
    assert found.digits > 31


def test_rows_beyond_the_horizon_are_counted_and_not_compared(references, file):
    rows = [*stored(references), ["4.125", *["1e9"] * 5], ["5", *["1e9"] * 5]]
    found = agreement(file(rows), NAME, references)
    assert (found.rows, found.compared, found.beyond, found.horizon) == (35, 33, 2, 4.0)
    assert found.left is None


def test_a_column_of_zeros_is_taken_as_exact(references, file):
    found = agreement(file([["0", "0.0"], ["1", "0"]], ("t", "q1")), NAME, references)
    assert found.columns[0].error == pytest.approx(abs(store.load(NAME, references).q[8, 0]))
    assert found.columns[0].allowed > 32


NO_FILES = {
    "empty": ("", "csv-empty", ()),
    "no rows": ("t,q1\n", "csv-without-rows", ()),
    "no t": ("time,q1\n0,1\n", "csv-without-time", ("line 1",)),
    "semicolons": ("t;q1\n0;1\n", "csv-without-time", ("commas",)),
    "no component": ("t,x,y\n0,1,2\n", "csv-without-component", ("line 1",)),
    "twice": ("t,q1,q1\n0,1,2\n", "csv-column-twice", ("line 1", "q1")),
    "size": ("t,q1,q3\n0,1,2\n", "column-not-in-reference", ("line 1", "q3")),
    "long row": ("t,q1\n0,1\n\n0.5,1,2\n", "csv-row-length", ("line 4", "3")),
    "short row": ("t,q1\n0,1\n0.5\n", "csv-row-length", ("line 3", "1")),
    "infinite": ("t,q1\n0,1\ninf,1\n", "csv-number-not-finite", ("line 3", "t")),
    "descending": ("t,q1\n0,1\n0.5,1\n0.25,1\n", "csv-times-out-of-order", ("line 4", "0.25")),
    "negative": ("t,q1\n-0.5,1\n0,1\n", "csv-time-negative", ("line 2",)),
    "beyond": ("t,q1\n5,1\n", "first-time-beyond-horizon", ("5", "4")),
}
NO_FILES |= {
    text: (f"t,q1\n0,1\n0.5,{text}\n", "csv-number-not-finite", ("line 3", "q1")) for text in ("one", "nan", "", "1e999", "1_0", "\u0661")
}


def test_a_file_that_cannot_be_compared_is_refused_with_the_line(references, tmp_path):
    path, binary = tmp_path / "own.csv", tmp_path / "binary.csv"
    for content, code, names in NO_FILES.values():
        path.write_text(content)
        with refused(code, says=(*names, str(path))):
            agreement(path, NAME, references)
    binary.write_bytes(bytes(range(128, 256)))
    for place, code in ((tmp_path, "csv-not-a-file"), (tmp_path / "none.csv", "no-such-csv-file"), (binary, "csv-malformed")):
        with refused(code):
            agreement(place, NAME, references)


def test_a_mark_of_byte_order_and_the_line_ends_of_windows_are_read(tmp_path):
    path = tmp_path / "own.csv"
    path.write_bytes(b"\xef\xbb\xbft,q1\r\n0,1\r\n0.5,2.50\r\n")
    found = read(path, CONSTRAINED)
    assert found.values["q1"].tolist() == [1, 2.5]
    assert found.half_unit("q1") == pytest.approx(0.005)


def test_the_command_gives_one_json_object(references, file, daebench):
    rows = [*moved(stored(references), "p2", "0.05", start=20), ["9", *["1"] * 5]]
    words = ("reference", "compare", file(rows), "--with", NAME, "--folder", references, "--within", 0.5)
    found = json.loads(daebench(*words, "--json")[1])
    assert (found["worst"], found["left"], found["within"], found["beyond"]) == ("p2", None, 0.5, 1)
    assert found["lost"]["12"] == {"t": 2.5, "column": "p2"}
    status, out, err = daebench(*words)
    assert (status, "1.7 digits, least in p2" in out, err) == (0, True, "")

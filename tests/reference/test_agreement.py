"""Agreement of a user's file with a reference: digits, when it leaves, in which component, and what is refused."""

import json
from decimal import Decimal, localcontext

import mpmath as mp
import numpy as np
import pytest
from refusals import refused

from daebench.reference.check.file_agreement import BETWEEN, Place, agreement
from daebench.reference.keep import store
from daebench.reference.keep.definition import define
from daebench.reference.keep.trajectory_file import read
from daebench.runs.state import CONSTRAINED

NAME = "planar_pendulum-rotating"
COMPONENTS = ("q1", "q2", "p1", "p2", "lam1")

pytestmark = pytest.mark.usefixtures("plain_functions")


def exact(times, digits=40):
    """Return rows of decimal strings of the closed form: t, q1, q2, p1, p2, lam1."""
    with mp.workdps(digits + 10):
        definition = define("planar_pendulum", "rotating")
        q0, p0 = definition.start_numbers()
        values = {str(symbol): mp.mpf(value.p) / value.q for symbol, value in definition.parameters.items()}
        rows = []
        for t in times:
            q, p = definition.derivation.problem.closed_form(mp.mpf(float(t)), q0, p0, values)
            rows.append([repr(float(t)), *(mp.nstr(x, digits) for x in (*q, *p, (p[0] ** 2 + p[1] ** 2 - q[1]) / 2))])
        return rows


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
    j = ("t", *COMPONENTS).index(column)
    with localcontext(prec=60):
        return [row if k < start else [*row[:j], str(Decimal(row[j]) + Decimal(by)), *row[j + 1 :]] for k, row in enumerate(rows)]


def test_the_stored_digits_agree_as_far_as_their_bound(references, file):
    found = agreement(file(stored(references)), NAME, references)
    assert (found.rows, found.compared, found.passed_over, found.beyond) == (33, 33, 0, 0)
    assert 31 < found.digits < 33.5
    assert found.left is None
    assert set(found.lost.values()) == {None}
    assert all(column.error == 0 and column.digits == column.allowed for column in found.columns)


@pytest.mark.parametrize("by", ["3e-5", "-3e-14", "3e-25"], ids=["single", "double", "quadruple"])
def test_a_known_error_is_found_in_its_column_to_any_digit(references, file, by):
    reference, rows = store.load(NAME, references), stored(references)
    for column in COMPONENTS:
        found = agreement(file(moved(rows, column, by, start=9)), NAME, references)
        size = np.abs(getattr(reference, column[:-1])).max()
        assert found.worst.name == column
        assert found.digits == pytest.approx(-np.log10(abs(float(by)) / size), abs=1e-6)
        assert found.worst.error == pytest.approx(abs(float(by)), rel=1e-6, abs=0)
        assert found.worst.t == pytest.approx(9 / 8)
        assert all(each.digits > 31 for each in found.columns if each.name != column)


def test_when_it_leaves_and_when_digits_are_lost_are_the_first_times(references, file):
    rows = stored(references)
    for column, by, start in (("p2", "1e-8", 4), ("q1", "1e-2", 10), ("lam1", "1", 20)):
        rows = moved(rows, column, by, start)
    found = agreement(file(rows), NAME, references)
    assert found.lost == {12: Place(0.5, "p2"), 9: Place(0.5, "p2"), 6: Place(1.25, "q1"), 3: Place(1.25, "q1")}
    assert found.left == Place(2.5, "lam1")
    assert agreement(file(rows), NAME, references, within=0.005).left == Place(1.25, "q1")
    assert agreement(file(rows), NAME, references, within=0.5).left is None


def test_digits_are_lost_in_units_of_the_motion(references, file):
    assert np.abs(store.load(NAME, references).p).max() == 2.5
    found = agreement(file(moved(stored(references), "p2", "2e-9", start=4)), NAME, references)
    assert (found.lost[12], found.lost[9]) == (Place(0.5, "p2"), None)


@pytest.mark.parametrize(("written", "least", "most"), [("{:.6f}", 6, 7), ("{:.9e}", 9, 10.5), ("{!r}", 15.5, 17.5)], ids=str)
def test_digits_are_not_more_than_the_file_has(references, file, written, least, most):
    reference = store.load(NAME, references)
    columns = [reference.t, *reference.q.T, *reference.p.T, *reference.lam.T]
    rows = [[repr(float(row[0])), *(written.format(float(x)) for x in row[1:])] for row in zip(*columns, strict=True)]
    for each in agreement(file(rows), NAME, references).columns:
        assert least < each.digits <= each.allowed < most


def test_between_stored_times_the_closed_form_agrees_to_double_precision(references, file):
    found = agreement(file(exact(np.linspace(0, 4, 24))), NAME, references)
    assert (found.compared, found.passed_over) == (24, 0)
    for each in found.columns:
        assert 11 < each.digits == each.allowed < 16
        assert each.error <= 10**-each.allowed * each.size
    wrong = agreement(file(moved(exact(np.linspace(0, 4, 24)), "q2", "1e-7", start=5)), NAME, references)
    assert (wrong.worst.name, wrong.worst.error) == ("q2", pytest.approx(1e-7, rel=1e-4))
    assert wrong.lost[9] == Place(pytest.approx(20 / 23), "q2")


def test_of_very_many_rows_all_stored_ones_and_an_even_choice_of_the_others_are_compared(references, file):
    fine = [[repr(k / 1000), "1.0"] for k in range(4001)]
    found = agreement(file(fine, ("t", "q1")), NAME, references, between=10)
    assert (found.rows, found.compared, found.passed_over) == (4001, 33 + 10, 4001 - 43)
    assert found.t_end == 4.0
    none = agreement(file(fine, ("t", "q1")), NAME, references, between=0)
    assert none.compared == 33
    assert BETWEEN >= 100


def test_one_component_in_any_order_is_enough_and_other_columns_are_named(references, file):
    rows = [[row[5], "x", row[0], row[2]] for row in stored(references)]
    found = agreement(file(rows, (" lam1", "note", "t", "q2 ")), NAME, references)
    assert ([each.name for each in found.columns], found.ignored) == (["lam1", "q2"], ("note",))
    assert found.digits > 31


def test_rows_beyond_the_horizon_are_counted_and_not_compared(references, file):
    rows = [*stored(references), ["4.125", *["1e9"] * 5], ["5", *["1e9"] * 5]]
    found = agreement(file(rows), NAME, references)
    assert (found.rows, found.compared, found.beyond, found.horizon) == (35, 33, 2, 4.0)
    assert found.left is None


def test_what_a_run_in_double_precision_can_keep_is_told(references, file):
    reference = store.load(NAME, references)
    found = agreement(file(stored(references)[:17]), NAME, references)
    assert found.t_end == 2.0
    assert found.possible == pytest.approx(-np.log10(2.0**-53 * reference.worst_amplification[16]))


def test_components_that_the_file_has_not_are_named(references, file):
    found = agreement(file([["0", "0"], ["1", "0.5"]], ("t", "q1")), NAME, references)
    assert found.missing == ("q2", "p1", "p2", "lam1")


@pytest.mark.parametrize("text", ["1_0", "\u0661"], ids=["underscore", "Arabic digit"])
def test_what_only_python_takes_for_a_number_is_none(references, file, text):
    with refused("csv-number-not-finite", says=("line 2",)):
        agreement(file([["0", text]], ("t", "q1")), NAME, references)


def test_a_column_of_zeros_is_taken_as_exact(references, file):
    found = agreement(file([["0", "0.0"], ["1", "0"]], ("t", "q1")), NAME, references)
    assert found.columns[0].error == pytest.approx(abs(store.load(NAME, references).q[8, 0]))
    assert found.columns[0].allowed > 32


NO_FILES = {
    "empty": ("", "csv-empty", ()),
    "no rows": ("t,q1\n", "csv-without-rows", ()),
    "no t": ("time,q1\n0,1\n", "csv-without-time", ("line 1",)),
    "no header": ("0,1\n0.5,1\n", "csv-without-time", ("line 1",)),
    "semicolons": ("t;q1\n0;1\n", "csv-without-time", ("commas",)),
    "no component": ("t,x,y\n0,1,2\n", "csv-without-component", ("line 1",)),
    "twice": ("t,q1,q1\n0,1,2\n", "csv-column-twice", ("line 1", "q1")),
    "size": ("t,q1,q3\n0,1,2\n", "column-not-in-reference", ("line 1", "q3")),
    "long row": ("t,q1\n0,1\n\n0.5,1,2\n", "csv-row-length", ("line 4", "3")),
    "short row": ("t,q1\n0,1\n0.5\n", "csv-row-length", ("line 3", "1")),
    "word": ("t,q1\n0,1\n0.5,one\n", "csv-number-not-finite", ("line 3", "q1")),
    "nan": ("t,q1\n0,1\n0.5,nan\n", "csv-number-not-finite", ("line 3", "q1")),
    "blank": ("t,q1\n0,1\n0.5,\n", "csv-number-not-finite", ("line 3", "q1")),
    "overflow": ("t,q1\n0,1\n0.5,1e999\n", "csv-number-not-finite", ("line 3", "q1")),
    "infinite": ("t,q1\n0,1\ninf,1\n", "csv-number-not-finite", ("line 3", "t")),
    "descending": ("t,q1\n0,1\n0.5,1\n0.25,1\n", "csv-times-out-of-order", ("line 4", "0.25")),
    "negative": ("t,q1\n-0.5,1\n0,1\n", "csv-time-negative", ("line 2",)),
    "beyond": ("t,q1\n5,1\n", "first-time-beyond-horizon", ("5", "4")),
}


def test_a_file_that_cannot_be_compared_is_refused_with_the_line(references, tmp_path):
    path = tmp_path / "own.csv"
    for content, code, names in NO_FILES.values():
        path.write_text(content)
        with refused(code, says=(*names, str(path))):
            agreement(path, NAME, references)


def test_what_is_no_text_file_is_refused(references, tmp_path):
    binary = tmp_path / "binary.csv"
    binary.write_bytes(bytes(range(128, 256)))
    for path, code in ((tmp_path, "csv-not-a-file"), (tmp_path / "none.csv", "no-such-csv-file"), (binary, "csv-malformed")):
        with refused(code):
            agreement(path, NAME, references)


def test_settings_out_of_range_are_refused(references, file):
    path = file([["0", *["1"] * 5]])
    for settings, code in (({"within": 0}, "not-positive"), ({"between": -1}, "below-least")):
        with refused(code):
            agreement(path, NAME, references, **settings)


def test_a_mark_of_byte_order_and_the_line_ends_of_windows_are_read(tmp_path):
    path = tmp_path / "own.csv"
    path.write_bytes(b"\xef\xbb\xbft,q1\r\n0,1\r\n0.5,2.50\r\n")
    found = read(path, CONSTRAINED)
    assert found.values["q1"].tolist() == [1, 2.5]
    assert found.half_unit("q1") == pytest.approx(0.005)


def test_the_command_says_digits_component_and_time(references, file, daebench):
    rows = moved(stored(references), "p2", "0.05", start=20)
    status, out, err = daebench("reference", "compare", file(rows), "--with", NAME, "--folder", references)
    assert (status, err) == (0, "")
    assert "Agrees to 1.7 digits, least in p2; leaves at t = 2.5 in p2, by more than 0.01 of the motion." in out
    assert "Compared: 33 of 33 rows." in out


def test_the_command_gives_one_json_object(references, file, daebench):
    rows = [*moved(stored(references), "p2", "0.05", start=20), ["9", *["1"] * 5]]
    words = ("reference", "compare", file(rows), "--with", NAME, "--folder", references, "--within", 0.5, "--json")
    status, out, _ = daebench(*words)
    found = json.loads(out)
    assert (status, found["worst"], found["left"], found["within"], found["beyond"]) == (0, "p2", None, 0.5, 1)
    assert found["lost"]["12"] == {"t": 2.5, "column": "p2"}
    assert [each["name"] for each in found["columns"]] == list(COMPONENTS)


def test_the_command_refuses_in_one_sentence(references, tmp_path, daebench):
    status, out, err = daebench("reference", "compare", tmp_path / "none.csv", "--with", NAME, "--folder", references)
    assert (status, out, err.count("\n")) == (2, "", 1)
    assert "there is no such file" in err

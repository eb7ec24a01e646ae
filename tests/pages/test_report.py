"""Reports: numbers in words, files written whole, and a page whose sentences are tested on the numbers before it is written."""

import math
import platform
import re
from dataclasses import replace
from types import SimpleNamespace
from xml.etree import ElementTree

import numpy as np
import pandas as pd
import pytest
from pages import standalone
from refusals import refused
from reported import require_figure

from daebench.draw.figures import STROKES, drawing, grid_of_axes, save
from daebench.errors import DaebenchError
from daebench.pages.report import (
    at_least,
    at_most,
    build,
    count,
    inline_svg,
    listing,
    number,
    percent,
    power_of_ten,
    table,
    with_error,
)
from daebench.pages.report.claims import ClaimRefuted, require
from daebench.reports import index_reduction
from daebench.reports.index_reduction import check
from daebench.reports.index_reduction.schemes import check_symplecticity
from daebench.runs.machine import machine
from daebench.runs.provenance import versions

FIGURES = ("energy", "two_motions", "drift", "swing", "symplecticity", "two_form", "ida")
SIGNS = str.maketrans("\N{NARROW NO-BREAK SPACE}\N{NO-BREAK SPACE}\N{MINUS SIGN}\N{MULTIPLICATION SIGN}", "  -x")


def plain(html):
    return re.sub(r"<sup>(.*?)</sup>", r"^\1", str(html)).translate(SIGNS)


@pytest.mark.parametrize(
    ("value", "digits", "text"),
    [
        (1.23e-5, 2, "1.2 x 10^-5"),
        (-0.0123, 2, "-0.012"),
        (9.996e-4, 2, "1.0 x 10^-3"),
        (123.4, 2, "123"),
        (-2.5e7, 3, "-2.50 x 10^7"),
        (1e-16, 1, "1 x 10^-16"),
        (0.0, 2, "0"),
        (math.nan, 2, "\N{EN DASH}"),
        (math.inf, 2, "\N{EN DASH}"),
    ],
)
def test_a_number_is_written_as_a_person_would(value, digits, text):
    assert plain(number(value, digits)) == text


@pytest.mark.parametrize("digits", [1, 2, 3, 4])
def test_at_most_is_an_upper_bound_and_at_least_a_lower_one(digits, random):
    values = 10.0 ** random.uniform(-16, 4, 200)
    for value in (*values, *(float(f"{value:.{digits - 1}e}") for value in values)):
        above, below = (float(plain(each(value, digits)).replace(" x 10^", "e")) for each in (at_most, at_least))
        assert below <= value * (1 + 1e-11)
        assert above >= value * (1 - 1e-11)
        assert above - below <= 1.0001 * 10.0 ** (math.floor(math.log10(value)) + 1 - digits)


def test_at_most_of_a_decimal_number_is_that_number():
    said = [plain(at_most(value)) for value in (0.1, 0.12, 1.3e-7, 0.0, math.nan, 1.2001, 123.4)]
    assert said == ["0.10", "0.12", "1.3 x 10^-7", "0", "\N{EN DASH}", "1.3", "124"]


@pytest.mark.parametrize(
    ("value", "error", "text"),
    [
        (1.0356, 0.0454, "1.04 ± 0.05"),
        (1.00061, 0.000143, "1.00061 ± 0.00014"),
        (8.001e-7, 2.3e-8, "(8.00 ± 0.23) x 10^-7"),
        (-1.05e-10, 1.7e-10, "(-1.1 ± 1.7) x 10^-10"),
        (123.0, 45.0, "123 ± 45"),
        (math.nan, 0.1, "\N{EN DASH}"),
        (0.5, math.nan, "0.500"),
    ],
)
def test_a_value_and_its_error_end_at_the_same_digit(value, error, text):
    assert plain(with_error(value, error)) == text


def test_counts_shares_powers_and_lists_read_well():
    assert plain(count(33333)) == "33 333"
    assert plain(percent(0.30001)) == "30.0 %"
    assert plain(percent(0.000239)) == "0.024 %"
    assert plain(power_of_ten(1e-12)) == "10^-12"
    assert str(listing(["a", "b", "c<"])) == "a, b and c&lt;"
    assert str(listing(["a"])) == "a"


def test_a_table_sets_numbers_to_the_right_and_escapes_text():
    frame = pd.DataFrame({"name": ["a<b"], "size": [1.5], "kept out": [0]})
    root = ElementTree.fromstring(table("sizes", frame, {"name": str, "size": number}, {}, "Sizes"))
    header, cell = root.find(".//tbody//th"), root.find(".//tbody//td")
    assert (header.text, header.get("scope")) == ("a<b", "row")
    assert (cell.text, cell.get("class")) == ("1.5", "n")
    assert "kept out" not in "".join(root.itertext())


def drawn(directory):
    with drawing():
        figure, axes = grid_of_axes(1, 1, 2.0)
        axes[0, 0].plot([0, 1], [0, 1], label=r"$x$", **STROKES[0].points())
        axes[0, 0].legend()
    return save(figure, directory, "line", {"x": [0.1, 1.0], "y": [1 / 3, 1.0]})


FILES = ["line.csv", "line.csv.txt", "line.png", "line.svg"]


def test_a_figure_is_saved_the_same_each_time_as_svg_png_and_csv_with_a_text_and_nothing_else(tmp_path, monkeypatch):
    svg = drawn(tmp_path / "made")
    before = svg.read_bytes()
    assert drawn(tmp_path / "again").read_bytes() == before
    assert sorted(path.name for path in svg.parent.iterdir()) == FILES
    assert ElementTree.parse(svg).getroot().tag == "{http://www.w3.org/2000/svg}svg"
    assert "<text" not in svg.read_text()
    assert (svg.parent / "line.csv").read_text().splitlines() == ["x,y", "0.1,0.333333333333", "1,1"]

    def broken(self, path, **settings):
        path.write_text("half of")
        raise OSError("disk full")

    monkeypatch.setattr("matplotlib.figure.Figure.savefig", broken)
    with refused("file-not-writable", DaebenchError):
        drawn(tmp_path / "made")
    assert svg.read_bytes() == before
    assert sorted(path.name for path in svg.parent.iterdir()) == FILES


def test_two_drawings_in_a_page_share_no_names(tmp_path):
    texts = [inline_svg(drawn(tmp_path).read_text(), stem, 'a "line" & more') for stem in ("one", "two")]
    names = []
    for root in map(ElementTree.fromstring, texts):
        assert (root.get("width"), root.get("aria-label")) == (None, 'a "line" & more')
        names.append({each.get("id") for each in root.iter() if each.get("id")})
        assert {link[1:] for each in root.iter() for key, link in each.items() if key.endswith("href")} <= names[-1]
    assert names[0]
    assert not names[0] & names[1]
    assert {*re.findall(r"url\(#(.*?)\)", "".join(texts))} <= names[0] | names[1]


def test_a_claim_that_fails_says_what_was_claimed_and_measured():
    require(True, "all is well", 1)
    with refused("claim-of-report-refuted", DaebenchError, says=("pigs fly", "0")):
        require(np.bool_(False), "pigs fly", 0)


SYMPLECTIC = {"se": False, "seproj": False, "rattle": True}
DEFECTS = {"se": [1e-16] + [1e-6] * 29, "seproj": [1e-5] * 30, "rattle": [1e-15] * 30}
FAULTS = {
    "se is symplectic": {"se": [1e-16] * 30},
    "se is not even in its first step": {"se": [1e-6] * 30},
    "seproj is symplectic in its first step": {"seproj": [1e-16] + [1e-5] * 29},
    "rattle is not symplectic": {"rattle": [1e-15] * 29 + [1e-8]},
    "a value is missing": {"rattle": [math.nan] * 30},
    "projection helps": {"seproj": [1e-8] * 30},
}


def symplecticity_of(defects):
    table = pd.DataFrame({"claimed_symplectic": SYMPLECTIC, "symplecticity": {name: values[9] for name, values in defects.items()}})
    check_symplecticity(SimpleNamespace(defects=pd.DataFrame(defects)), table)


@pytest.mark.parametrize("fault", FAULTS.values(), ids=FAULTS)
def test_a_planted_fault_in_the_two_form_refutes_the_story(fault):
    symplecticity_of(DEFECTS)
    with pytest.raises(ClaimRefuted):
        symplecticity_of(DEFECTS | fault)


def built(out):
    """Build the report; return its page, and what it measured."""
    measured = {}

    def keeping(name):
        original = getattr(index_reduction, name)
        return lambda tell: measured.setdefault(name, original(tell))

    with pytest.MonkeyPatch.context() as patch:
        for name in ("measure", "measure_ida"):
            patch.setattr(index_reduction, name, keeping(name))
        return build("index-reduction", out), measured["measure"], measured["measure_ida"]


def with_cell(frame, method, **values):
    frame = frame.copy()
    for name, value in values.items():
        frame.loc[frame["method"] == method, name] = value
    return frame


TAMPERED = {
    "se is symplectic": lambda n: replace(n, defects=n.defects.assign(se=1e-16)),
    "rattle is not reversible": lambda n: replace(n, table=with_cell(n.table, "rattle", reversibility=1e-6)),
    "seproj does not drift": lambda n: replace(n, table=with_cell(n.table, "seproj", kind="bounded")),
    "implicit Euler loses nothing": lambda n: replace(n, swing=n.swing.assign(energy_implicit_euler=n.swing["energy_symplectic_euler"])),
    "se gets through fig1.2": lambda n: replace(n, facts={**n.facts, "se_stops": False}),
}


@pytest.mark.exhaustive
def test_the_report_on_index_reduction_is_made_whole_and_tampered_numbers_stop_it(tmp_path, looks_right, monkeypatch):
    page, numbers, ida = built(tmp_path)
    standalone(page)
    looks_right(page)
    source = page.read_text(encoding="utf-8")
    assert source.count("<svg") == len(FIGURES) == len(re.findall(r'<svg[^>]* aria-label="[^"]{40,}"', source))
    for stem in FIGURES:
        require_figure(page.parent / "figures" / f"{stem}.svg", 30)
        data = pd.read_csv(page.parent / "figures" / f"{stem}.csv", keep_default_na=False)
        assert np.isfinite(data.select_dtypes("number").to_numpy()).all()
    found = {path.stem: pd.read_csv(path) for path in (page.parent / "tables").glob("*.csv")}
    assert {name: len(frame) for name, frame in found.items()} == {"schemes": 7, "orders": 42, "ida": 72}
    check(numbers, ida)
    for tamper in TAMPERED.values():
        with pytest.raises(ClaimRefuted):
            check(tamper(numbers), ida)
    monkeypatch.setattr(index_reduction, "measure", lambda tell: TAMPERED["se is symplectic"](numbers))
    monkeypatch.setattr(index_reduction, "measure_ida", lambda tell: ida)
    with pytest.raises(ClaimRefuted):
        build("index-reduction", tmp_path)
    assert page.read_text(encoding="utf-8") == source


def test_the_machine_is_described_without_names_and_paths():
    assert "cores" in machine()
    assert platform.node() not in machine()
    assert all("/" not in value for value in versions().values())

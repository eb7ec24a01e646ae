"""Each report as it is measured: its page is made and loads nothing. Others are made of fewer runs by tests of their own."""

import pytest
from pages import standalone
from reported import require_figure

from daebench.pages.report import build
from daebench.pages.report.index import THUMBNAIL

pytestmark = pytest.mark.exhaustive


ROWS = {"tolerances": 100, "poisson": 100, "work-precision": 50, "extremes": 10, "molecules": 15, "nonholonomic": 80, "ensembles": 20}
"""Reports, and the least rows of data beside a figure."""


@pytest.mark.parametrize(("name", "rows"), ROWS.items(), ids=ROWS)
def test_the_whole_report_is_made_and_its_page_loads_nothing(name, rows, tmp_path, looks_right):
    told = []
    page = build(name, tmp_path, lambda fraction, label: told.append(fraction))
    standalone(page)
    looks_right(page)
    for svg in {*(page.parent / "figures").glob("*.svg")} - {page.parent / "figures" / f"{THUMBNAIL}.svg"}:
        require_figure(svg, rows)
    assert page.read_text(encoding="utf-8").count("<figure") > 1
    assert (told[0], told[-1]) == (0.0, 1.0)
    assert told == sorted(told)

"""Each report as it is measured: its page is made and loads nothing. Others are made of fewer runs by tests of their own."""

import pytest
from pages import standalone
from reported import require_figure

from daebench.pages.report import build
from daebench.pages.report.index import THUMBNAIL

pytestmark = pytest.mark.exhaustive


@pytest.mark.parametrize("name", ["tolerances", "poisson", "work-precision", "extremes", "molecules", "nonholonomic", "ensembles"])
def test_the_whole_report_is_made_and_its_page_loads_nothing(name, tmp_path, looks_right):
    told = []
    page = build(name, tmp_path, lambda fraction, label: told.append(fraction))
    standalone(page)
    looks_right(page)
    for svg in {*(page.parent / "figures").glob("*.svg")} - {page.parent / "figures" / f"{THUMBNAIL}.svg"}:
        require_figure(svg)
    assert page.read_text(encoding="utf-8").count("<figure") > 1
    assert (told[0], told[-1]) == (0.0, 1.0)
    assert told == sorted(told)

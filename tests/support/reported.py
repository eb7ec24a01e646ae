"""What every report does with its numbers: tables as CSV and HTML, figures with their data beside them, and no page where a claim fails."""

import numpy as np
import pandas as pd
import pytest
from pages import standalone

from daebench.draw.figures import drawing
from daebench.pages.report import build
from daebench.pages.report.claims import ClaimRefuted
from daebench.pages.report.index import THUMBNAIL
from daebench.pages.report.tables import write_tables


def rows_of(tables, folder):
    """Return the rows of each CSV file by its name, once the HTML of tables has rows, no NaN and no tag that is escaped."""
    for name, make in write_tables(folder, tables).items():
        html = str(make("A caption"))
        assert html.count("<tr>") >= 6, name
        assert "nan" not in html
        assert "&lt;" not in html
    return {path.stem: len(pd.read_csv(path)) for path in folder.glob("*.csv")}


def page_of(report, name, numbers, figures, folder, monkeypatch):
    """Return the page of a report that is made of these numbers, without its figures, and the rows of the tables beside it."""
    monkeypatch.setattr(report, "draw", lambda numbers, findings, folder: [folder / f"{stem}.svg" for stem in figures])
    monkeypatch.setattr("daebench.pages.report.page.picture", lambda *arguments: "")
    monkeypatch.setattr(report, "measure", lambda tell: numbers)
    page = build(name, folder)
    standalone(page)
    return page.read_text(encoding="utf-8"), {path.stem: len(pd.read_csv(path)) for path in (page.parent / "tables").glob("*.csv")}


def require_refused(report, name, numbers, words, folder, monkeypatch):
    """Require that a report ends at a claim that its numbers refute, and leaves no page."""
    monkeypatch.setattr(report, "measure", lambda *_: numbers)
    with pytest.raises(ClaimRefuted, match=words):
        build(name, folder)
    assert not (folder / name / "index.html").exists()


def stems_of(paths):
    """Return the names of figures, once they are drawn."""
    with drawing():
        return {path.stem for path in paths} - {THUMBNAIL}


def require_figures(stems, folder):
    """Require that figures show something, have their data beside them and need no font."""
    from matplotlib.image import imread

    for stem in stems:
        assert np.std(imread(folder / f"{stem}.png")[..., :3]) > 0.02
        assert len(pd.read_csv(folder / f"{stem}.csv")) >= 100
        assert "<text" not in (folder / f"{stem}.svg").read_text()

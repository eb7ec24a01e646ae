"""What every report does with its numbers: tables as CSV and HTML, figures with their data beside them, and no page where a claim fails."""

import numpy as np
import pandas as pd
from matplotlib.image import imread
from pages import standalone

from daebench.pages.report import build
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


def require_figure(svg):
    """Require that a figure shows something, has its data beside it and needs no font."""
    assert np.std(imread(svg.with_suffix(".png"))[..., :3]) > 0.02
    assert len(pd.read_csv(svg.with_suffix(".csv"))) > 0
    assert "<text" not in svg.read_text()

"""What every report does with its numbers: a page with tables, and figures with their data beside them."""

import numpy as np
import pandas as pd
from matplotlib.image import imread
from pages import standalone

from daebench.pages.report import build


def tables_of_page(report, name, numbers, figures, folder, monkeypatch):
    """Return how many rows the tables beside a page have that is made of these numbers, without its figures, and stands alone."""
    monkeypatch.setattr(report, "draw", lambda numbers, findings, folder: [folder / f"{stem}.svg" for stem in figures])
    monkeypatch.setattr("daebench.pages.report.page.picture", lambda *arguments: "")
    monkeypatch.setattr(report, "measure", lambda tell: numbers)
    page = build(name, folder)
    standalone(page)
    return {path.stem: len(pd.read_csv(path)) for path in (page.parent / "tables").glob("*.csv")}


def require_figure(svg, rows):
    """Require that a figure shows something, has so many rows of data beside it, or more, and needs no font."""
    assert np.std(imread(svg.with_suffix(".png"))[..., :3]) > 0.02
    assert len(pd.read_csv(svg.with_suffix(".csv"))) >= rows
    assert "<text" not in svg.read_text()

"""Accuracy against evaluations on the even transmission."""

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pandas as pd

from daebench.pages.report import count, power_of_ten
from daebench.pages.report.claims import require
from daebench.pages.report.tables import Table, code
from daebench.reports.nonholonomic.motions import METHODS, TRANSMISSION
from daebench.studies.work_precision.figure import draw
from daebench.studies.work_precision.run import FromOneStart, work_precision
from daebench.studies.work_precision.study import costs_at

CASE, T_COST = "even", 20.0
LEVELS = (1e-2, 1e-4, 1e-6, 1e-8)
ERROR, PRICE = "error_q", "evaluations"


def errors() -> pd.DataFrame:
    """Return errors and evaluations, one row a method and step or tolerance."""
    study = work_precision(TRANSMISSION, case=CASE, methods=METHODS, t_end=T_COST, repeat=0)
    assert isinstance(study, FromOneStart)
    return study.frame


def check_cost(frame: pd.DataFrame) -> SimpleNamespace:
    """Return the evaluations for each accuracy, one row a method, and which method needs the fewest."""
    prices = pd.DataFrame({level: {name: at[0] for name, at in costs_at(frame, ERROR, PRICE, level).items()} for level in LEVELS})
    prices, level = prices.reindex(METHODS), LEVELS[1]
    least, price = prices.idxmin(), prices[level] / prices[level].min()
    require(price["dla"] > 1 and price["spark_lobatto3"] > 1, "schemes that bound the energy are not the cheapest", price.to_dict())
    found = {"best": least[level], "always": least.nunique() == 1, "dla": price["dla"], "spark": price["spark_lobatto3"]}
    return SimpleNamespace(prices=prices, level=level, **found)


def draw_cost(frame: pd.DataFrame, folder: Path) -> Path:
    """Draw the error against evaluations."""
    return draw(folder, frame, ERROR, "position error", stem="cost", against=[PRICE])


def table(prices: pd.DataFrame) -> Table:
    """Return the evaluations by method and accuracy."""
    columns: dict[str, Any] = {"method": (code, "method")} | {str(level): (count, power_of_ten(level)) for level in LEVELS}
    frame = prices.rename(columns=str).rename_axis("method").reset_index()
    return Table(frame, columns)

"""Medians and deciles of errors over the starts of a system, by formulation and tolerance."""

import numpy as np
import pandas as pd

from daebench.reports.tolerances.runs import REACHED

LOW, HIGH = 0.1, 0.9
"""Quantiles over the starts at the lower and upper edge of a band."""


def typical(runs: pd.DataFrame) -> pd.DataFrame:
    """Return one row for each problem, formulation and tolerance: medians over the starts, and deciles of the error.

    A run that did not reach its end counts as an infinite error; a median or a decile among such runs is NaN.

    Returns
    -------
    DataFrame
        ``error``, ``low`` and ``high``, m; ``residuals``, the median; ``floor``, the largest; ``done``, the fraction of the starts from
        which the end was reached.
    """
    keys = ["scene", "formulation", "tol"]
    groups = runs.assign(error=runs["error"].fillna(np.inf)).groupby(keys, sort=False)
    quantiles = {
        name: groups["error"].quantile(part, interpolation="lower") for name, part in (("low", LOW), ("error", 0.5), ("high", HIGH))
    }
    frame = pd.DataFrame(quantiles | {"residuals": groups["residuals"].median(), "floor": groups["floor"].max()})
    frame["done"] = (runs["end"] == REACHED).groupby([runs[key] for key in keys], sort=False).mean()
    bands: pd.DataFrame = frame.replace(np.inf, np.nan).reset_index()
    return bands

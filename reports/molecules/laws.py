"""Laws of the report on molecules: powers of the tolerance and of the step, fitted to changes that are clear of their own scatter."""

from dataclasses import dataclass

import numpy as np
import pandas as pd

CLEAR = 4.0
"""A change is clear where its mean over the starts is more than so many of its standard errors."""

LOST = 1.0
"""From this change on, in standard deviations of the kinetic energy, a motion is another one and no law is looked for."""

FEWEST = 3
"""Fewest clear changes of a fit."""

NAN = float("nan")


@dataclass(frozen=True)
class Law:
    """A law |mean change| = c tolerance^a h^b.

    Parameters
    ----------
    a, a_error, b, b_error : float
        Exponents and their standard errors; NaN where too few changes are clear, or all have the same tolerance or the same step.
    points : int
        Changes that were used.
    tightest : float
        The tightest tolerance among them.
    """

    a: float
    a_error: float
    b: float
    b_error: float
    points: int
    tightest: float


def clear(rows: pd.DataFrame) -> pd.DataFrame:
    """Return the rows whose mean is clear of its standard error, and whose motion is not lost."""
    moduli = rows["mean"].abs()
    return rows[(moduli > CLEAR * rows["error"]) & (moduli < LOST)]


def fit(rows: pd.DataFrame) -> Law:
    """Return the least-squares law of the logarithms, with the standard errors that the scatter about it gives.

    Parameters
    ----------
    rows : DataFrame
        Columns mean, error, h and tolerance, NaN where there is none.
    """
    used = clear(rows)
    tolerances = np.log(used["tolerance"].to_numpy(dtype=float))
    columns = {"a": tolerances, "b": np.log(used["h"].to_numpy(dtype=float))}
    varied = {name: x for name, x in columns.items() if len(np.unique(x[np.isfinite(x)])) > 1}
    tightest = float(used["tolerance"].min()) if len(used) else NAN
    if len(used) < FEWEST or not varied or len(used) <= len(varied) + 1:
        return Law(NAN, NAN, NAN, NAN, len(used), tightest)
    A = np.stack([np.ones(len(used)), *varied.values()], axis=1)
    y = np.log(used["mean"].abs().to_numpy())
    x, *_ = np.linalg.lstsq(A, y, rcond=None)
    variance = float(np.sum((y - A @ x) ** 2)) / (len(y) - len(x))
    errors = np.sqrt(variance * np.diag(np.linalg.inv(A.T @ A)))
    found = {name: (float(x[k]), float(errors[k])) for k, name in enumerate(varied, start=1)}
    (a, a_error), (b, b_error) = (found.get(name, (NAN, NAN)) for name in "ab")
    return Law(a, a_error, b, b_error, len(used), tightest)

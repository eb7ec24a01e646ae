"""Errors along a run: of the energy, and of the quantities that the structure of its problem conserves."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from daebench.diagnostics.energy_verdict import energy_error
from daebench.diagnostics.integrals import casimir_errors, integral_errors
from daebench.runs.ivp import Ivp
from daebench.runs.trajectory import Array

LABELS = {
    "energy_error": "|energy error|",
    "g": "|g(q)|",
    "Gv": "|G H_p|",
    "casimir_error": "|Casimir error|",
    "integral_error": "|integral error|",
}
"""Errors that can be measured along a run; a problem may have only some of them."""


MOST_POINTS = 2000
"""Approximate number of points of a curve; more cannot be seen."""


def thinned(t: Array, errors: Mapping[str, Array]) -> tuple[Array, dict[str, Array]]:
    """Return times and errors at :data:`MOST_POINTS` outputs at most, each the largest error of a group of neighbours."""
    starts = np.unique(np.linspace(0, len(t) - 1, MOST_POINTS).astype(int))
    # Maxima and not every n-th value: a picture that misses a peak shows an error that is too small.
    return t[starts], {name: np.maximum.reduceat(values, starts) for name, values in errors.items()}


def errors_along(ivp: Ivp, trajectory: Any) -> dict[str, Array]:
    """Return the errors along a run at its outputs, by name in :data:`LABELS`: largest moduli, shape(n,), where they are of several."""
    columns = {"energy_error": energy_error(ivp, trajectory)}
    if ivp.on_manifold:
        columns |= {"g": ivp.along("g", trajectory.position), "Gv": ivp.along("Gv", *trajectory.vectors)}
    else:
        several = {"casimir_error": casimir_errors(ivp, trajectory), "integral_error": integral_errors(ivp, trajectory)}
        columns |= {column: np.column_stack(list(errors.values())) for column, errors in several.items() if errors}
    moduli = {name: np.abs(rows) for name, rows in columns.items() if rows.size}  # without constraints g has no columns
    return {name: rows.max(axis=1) if rows.ndim == 2 else rows for name, rows in moduli.items()}

"""When the energy of a run drifts, by its row in a study."""

from typing import Any

from daebench.diagnostics.energy import DRIFTS


def drifts(row: dict[str, Any]) -> bool:
    """Return whether the energy of a run drifts, by its verdict."""
    return bool(row["energy_verdict"] == DRIFTS)

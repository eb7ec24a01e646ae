"""Sentences of the documentation of engines, in own words, and what is measured of them."""

import importlib
from typing import Any

HOLDS, NOT, PART = "holds", "does not hold here", "in part"
"""Verdicts on a sentence."""

CHECKED = {"MuJoCo": "mujoco", "EXUDYN": "exudyn", "OpenMM": "openmm", "Mici": "mici", "jax-md": "jax_md", "CasADi": "casadi"}
"""Engines with sentences that can be measured here, and the files beside this one that measure them."""


def sentences_of(engine: str) -> list[dict[str, Any]]:
    """Return one row a sentence: engine, place, sentence, measured and verdict, as HTML; none of an engine that has none."""
    if engine not in CHECKED:
        return []
    rows = importlib.import_module(f"{__name__}.{CHECKED[engine]}").check()
    return [{"engine": engine} | row for row in rows]


def row(place: str, sentence: str, measured: str, verdict: bool | str) -> dict[str, str]:
    """Return a row; a verdict that is not text says whether the sentence holds."""
    words = verdict if isinstance(verdict, str) else HOLDS if verdict else NOT
    return {"place": place, "sentence": sentence, "measured": measured, "verdict": words}

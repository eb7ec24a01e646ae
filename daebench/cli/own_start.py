"""A start of one's own as commands show it: which coordinate is which point, and how far it was moved to the manifold."""

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from daebench.methods.initial_value_problem import initial_value_problem
from daebench.runs.ivp import Ivp
from daebench.runs.own_start import PROJECT, given, parted
from daebench.runs.result import Table

MOST = 24
"""Largest number of coordinates in a table; JSON has all."""

POSED = ("problem", "case", "parameters", "algebra", "on_singular")
"""Arguments of a study that decide its initial value problem, beside a start."""


class Shown(NamedTuple):
    """A start: its entries for JSON, and what is printed of it."""

    plain: dict[str, Any]
    printed: list[str | Table]


def own_start_of(asked: Mapping[str, Any]) -> Shown | None:
    """Return the start among the arguments of a study; None where it starts as its case, which no projection moves."""
    start, others = parted(asked)
    vectors, project = given(start), bool(start.get(PROJECT))
    if not (vectors or project) or not others.get("problem"):
        return None
    posed: dict[str, Any] = {name: others[name] for name in POSED if others.get(name) is not None}
    if not project:
        return shown(initial_value_problem(**posed, **vectors, consistent=False))
    ivp, v0 = initial_value_problem(**posed, **start), vectors.pop("v0", None)
    before = initial_value_problem(**posed, **vectors, consistent=False)
    if v0 is not None:  # which are taken at the positions after their projection
        before = before.at(initial_value_problem(**posed, q0=ivp.start[1], v0=v0, consistent=False).start[0], before.start[1])
    return shown(ivp, before)


def shown(ivp: Ivp, before: Ivp | None = None) -> Shown:
    """Return a start as it is shown, and how far a projection moved it, of its numbers before."""
    vectors = {f"{name}0": x for name, x in zip(ivp.state.vectors, ivp.start, strict=True)}
    if "q0" in vectors:
        vectors = {"q0": vectors["q0"], "v0": ivp.value("H_p", *ivp.start), "p0": vectors["p0"]}
    vectors = {name: x[: ivp.moving] for name, x in vectors.items()}
    rows = [[name, *(f"{x[k]:.15g}" for x in vectors.values())] for k, name in enumerate(ivp.coordinates[:MOST])]
    printed: list[str | Table] = [f"Start: {ivp.case}", Table(["coordinate", *vectors], rows)]
    plain: dict[str, Any] = {"start": {"coordinates": ivp.coordinates, **vectors}}
    if before is not None:
        plain["projected"] = moved(before, ivp)
        printed.append(f"Moved to the manifold by {', '.join(f'{x:.3g} in {name}' for name, x in plain['projected'].items())}.")
    return Shown(plain, printed)


def moved(before: Ivp, ivp: Ivp) -> dict[str, float]:
    """Return by how much the projection moved the initial values."""
    return {name: float(np.linalg.norm(getattr(ivp, name) - getattr(before, name))) for name in ("q0", "p0")}

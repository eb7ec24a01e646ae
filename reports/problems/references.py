"""The certified reference of a case in short, and the numbers that others published of its motion beside it."""

import tomllib
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from importlib import resources
from typing import Any

from daebench.reference.keep import store
from daebench.reference.keep.dense_evaluation import states_at
from daebench.reference.keep.form import DATA
from daebench.reference.keep.record import Reference

DIGITS, COMPONENTS = 16, 6
"""Digits of a number that is shown, and most components of a state."""


@dataclass(frozen=True)
class Certified:
    """A certified reference in short.

    Parameters
    ----------
    name : str
        PROBLEM-CASE.
    end : float
        Its last time.
    times : int
        Number of its times.
    bound : float
        Largest error of any position, or coordinate.
    double : float
        Time up to which a run in double precision can follow it; infinite if to the end.
    last : list of (str, str)
        Names and leading digits of the first positions, or coordinates, at the end.
    """

    name: str
    end: float
    times: int
    bound: float
    double: float
    last: list[tuple[str, str]]


def certified(problem: str, case: str) -> Certified | None:
    """Return the certified reference of a case in short, None if there is none."""
    name = f"{problem}-{case}"
    if name not in store.names(DATA):
        return None
    reference = store.load(name, DATA)
    part = "q" if "q" in reference.bound else "y"
    last = [(column, shortened(reference.text[column][-1])) for column in reference.text if column[0] == part][:COMPONENTS]
    return Certified(name, reference.horizon, len(reference.t), float(reference.bound[part].max()), reference.double_horizon, last)


def shortened(digits: str) -> str:
    """Return a decimal number with its first digits, cut off and not rounded, and an ellipsis for those that are left out."""
    number, _, power = digits.partition("e")
    significant = 0
    for k, sign in enumerate(number):
        significant += sign.isdigit() and (significant > 0 or sign != "0")
        if significant == DIGITS and k + 1 < len(number):
            return f"{number[: k + 1]}…{'e' + power if power else ''}"
    return digits


@cache
def entries() -> list[dict[str, Any]]:
    """Return the published numbers: problem, case, source, and at each time t some components of the state by name."""
    text = (resources.files(__package__) / "published.toml").read_text(encoding="utf-8")
    return list(tomllib.loads(text)["entries"])


def published(problem: str) -> list[dict[str, Any]]:
    """Return a row for each published number of a problem: source, t, name, value, and its difference from the certified reference."""
    return [
        row for entry in entries() if entry["problem"] == problem for row in _rows(entry, store.load(f"{problem}-{entry['case']}", DATA))
    ]


def _rows(entry: dict[str, Any], reference: Reference) -> Iterator[dict[str, Any]]:
    for at in entry["at"]:
        states = states_at(reference, [at["t"]]).states
        for name, value in at["state"].items():
            exact = float(states[name.rstrip("0123456789")][0, int(name.lstrip("qplam")) - 1])
            yield {"source": entry["source"], "t": at["t"], "name": name, "published": value, "certified": exact, "off": abs(value - exact)}

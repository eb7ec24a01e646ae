"""The index of a gallery: a card for each page that is there, with its first picture, and what failed."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from html import unescape
from pathlib import Path
from typing import Any

from daebench.pages.report import build_stamp
from daebench.pages.report.page import write_page

KINDS = {"report": "Reports", "lesson": "Lessons", "reference": "Reference"}
"""Kinds of pages in the order of the index, and their headings."""


@dataclass(frozen=True)
class Card:
    """What the index shows of a page.

    Parameters
    ----------
    name, kind, about, command, day : str
        As in its build stamp.
    title : str
        Title of the page.
    picture : str
        Path of its first picture from the index, or nothing.
    alt : str
        What that shows, in words.
    failure : str
        Why it could not be made the last time, or nothing.
    """

    name: str
    kind: str
    about: str
    command: str
    day: str
    title: str
    picture: str
    alt: str
    failure: str


def write_index(out: Path, names: Sequence[str], failures: Mapping[str, str]) -> Path:
    """Write ``out/index.html`` for pages with build stamps, in this order; return its path.

    Parameters
    ----------
    out : Path
        Folder of the gallery.
    names : sequence of str
        Pages that are there.
    failures : mapping of str to str
        Why a page could not be made the last time, by name; it is not linked to then.
    """
    cards = [card(out, name, failures.get(name, "")) for name in dict.fromkeys([*names, *failures])]
    groups: dict[str, list[Any]] = {heading: [] for heading in KINDS.values()}
    for each in cards:
        groups.setdefault(KINDS.get(each.kind, KINDS["report"]), []).append(each)
    return write_page("index.html", out / "index.html", "daebench report all", groups={key: own for key, own in groups.items() if own})


def card(out: Path, name: str, failure: str) -> Card:
    """Return what the index shows of a page."""
    stamp, page = build_stamp.read(out / name), out / name / "index.html"
    text = page.read_text(encoding="utf-8") if page.is_file() else ""
    title = re.search(r"<title>(.*?)</title>", text, re.DOTALL)
    picture, alt = first_picture(out, name, text)
    told = (stamp.kind, stamp.about, stamp.command, stamp.day) if stamp else ("report", "", f"daebench report {name}", "")
    return Card(name, *told, title=unescape(title[1]).strip() if title else name, picture=picture, alt=alt, failure=failure)


def first_picture(out: Path, name: str, text: str) -> tuple[str, str]:
    """Return path and words of the first figure of a page that has its PNG beside it; nothing where there is none."""
    for stem, alt in re.findall(r'<figure id="figure-([^"]+)">.*?aria-label="([^"]*)"', text, re.DOTALL):
        path = f"{name}/figures/{stem}.png"
        if (out / path).is_file():
            return path, unescape(alt)
    return "", ""

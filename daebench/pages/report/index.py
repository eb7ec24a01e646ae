"""The index of a gallery: a card for each page that is there, with its first picture, and what failed."""

import re
from collections.abc import Mapping, Sequence
from html import unescape
from pathlib import Path
from typing import Any

from daebench.pages.report import build_stamp
from daebench.pages.report.page import write_page

KINDS = {"report": "Reports", "lesson": "Lessons", "reference": "Reference"}
"""Kinds of pages in the order of the index, and their headings."""


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
    for entry in cards:
        groups.setdefault(KINDS.get(entry["kind"], KINDS["report"]), []).append(entry)
    return write_page(
        "index.html", out / "index.html", "daebench report all", groups={key: entries for key, entries in groups.items() if entries}
    )


def card(out: Path, name: str, failure: str) -> dict[str, str]:
    """Return what the index shows of a page: what its build stamp says, title, its first picture, and why it failed."""
    stamp, page = build_stamp.read(out / name), out / name / "index.html"
    text = page.read_text(encoding="utf-8") if page.is_file() else ""
    title = re.search(r"<title>(.*?)</title>", text, re.DOTALL)
    shown = {"name": name, "kind": "report", "about": "", "command": f"daebench report {name}", "day": ""}
    if stamp:
        shown |= {"kind": stamp.kind, "about": stamp.about, "command": stamp.command, "day": stamp.day}
    return shown | {"title": unescape(title[1]).strip() if title else name, "picture": first_picture(out, name, text), "failure": failure}


def first_picture(out: Path, name: str, text: str) -> str:
    """Return the path of the first figure of a page that has its PNG beside it; nothing where there is none."""
    for stem in re.findall(r'<figure id="figure-([^"]+)">', text):
        path = f"{name}/figures/{stem}.png"
        if (out / path).is_file():
            return path
    return ""

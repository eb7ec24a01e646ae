"""The index of a gallery: a card for each page that is there, with its first picture, and what failed."""

import re
from collections.abc import Mapping, Sequence
from html import unescape
from pathlib import Path
from typing import Any

from markupsafe import Markup

from daebench.pages.report import build_stamp
from daebench.pages.report.page import write_page

KINDS = {"report": "Reports", "lesson": "Lessons"}
"""Kinds of pages in the order of the index, and their headings."""


PATH = (
    ("Why do constraints need care?", ("lesson-why-symplectic", "index-reduction")),
    ("Which methods are there, and what does each conserve?", ("methods", "lesson-shake-to-lobatto")),
    ("What accuracy does the tolerance of a solver give?", ("tolerances", "molecules", "lesson-tolerance")),
    ("Which method is the cheapest for an accuracy?", ("work-precision", "ensembles")),
    ("Which problems are there?", ("problems", "poisson", "nonholonomic", "lesson-nonholonomic")),
    ("Where do methods and programs fail?", ("extremes", "engines")),
)
"""Questions in the order in which a reader has them, and the pages that answer."""

THUMBNAIL = "thumbnail"
"""Stem of the figure that a report draws for the index, in the size in which it is shown there."""


def write_index(out: Path, names: Sequence[str], failures: Mapping[str, str]) -> Path:
    """Write ``out/index.html`` for pages with build stamps, in this order; return its path."""
    cards = [card(out, name, failures.get(name, "")) for name in dict.fromkeys([*names, *failures])]
    groups: dict[str, list[Any]] = {heading: [] for heading in KINDS.values()}
    for entry in cards:
        groups.setdefault(KINDS.get(entry["kind"], KINDS["report"]), []).append(entry)
    there = {entry["name"]: entry for entry in cards if not entry["failure"]}
    steps = [(question, [there[name] for name in names if name in there]) for question, names in PATH]
    return write_page(
        "index.html",
        out / "index.html",
        "daebench report all",
        groups={key: entries for key, entries in groups.items() if entries},
        steps=[(question, pages) for question, pages in steps if pages],
        lead=lead(out, names),
    )


LEAD = "lead.html"
"""File of a page's folder that has a picture and a sentence for the index: a piece of HTML."""


def lead(out: Path, names: Sequence[str]) -> Markup:
    """Return the picture and the sentence of the first page that has them, for the index to begin with; nothing where there is none."""
    files = [out / name / LEAD for name in names]
    return Markup(next((path.read_text(encoding="utf-8") for path in files if path.is_file()), ""))


def card(out: Path, name: str, failure: str) -> dict[str, str]:
    """Return the content of a card of the index: build stamp, title and first picture of a page, and why it failed."""
    stamp, page = build_stamp.read(out / name), out / name / "index.html"
    text = page.read_text(encoding="utf-8") if page.is_file() else ""
    title = re.search(r"<title>(.*?)</title>", text, re.DOTALL)
    shown = {"name": name, "kind": "report", "about": "", "command": f"daebench report {name}", "day": ""}
    if stamp:
        shown |= {"kind": stamp.kind, "about": stamp.about, "command": stamp.command, "day": stamp.day}
    return shown | {"title": unescape(title[1]).strip() if title else name, "picture": first_picture(out, name, text), "failure": failure}


def first_picture(out: Path, name: str, text: str) -> str:
    """Return the path of a page's thumbnail, or of its first figure that has its PNG beside it; nothing where there is none."""
    for stem in [THUMBNAIL, *re.findall(r'<figure id="figure-([^"]+)">', text)]:
        path = f"{name}/figures/{stem}.png"
        if (out / path).is_file():
            return path
    return ""

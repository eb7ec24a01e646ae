"""All public names on one page, written from the docstrings: ``python docs/daebench_site/names.py`` writes ``docs/reference/names.md``.

The page is kept in the repository, so that it can be read without building the site.
"""

import doctest
import inspect
import re
import sys
import textwrap
from collections.abc import Iterator
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).parents[1]))

from daebench_site.api import chapter_names, kind, resolve, summary
from daebench_site.contents import TASKS

PAGE = Path(__file__).parents[1] / "reference" / "names.md"
LANGUAGE = "write-a-scheme"
"""Chapter whose names are the words of a language; they are on its own page."""

DOTS: Any = type("Dots", (), {"__repr__": lambda self: "..."})()
LETTERS = 25
BAR = r"\|"
"""A bar within a cell of a table."""

HEAD = """---
nosearch: true
---

# All public names

Each public function with its parameters and an example, and each class. The chapters of [Python](api/index.rst) describe parameters,
results and errors. This page is written from the docstrings by `python docs/daebench_site/names.py`.
"""


def page() -> str:
    """Return the text of the page."""
    return "\n".join([HEAD, *(line for task in TASKS if task.key != LANGUAGE for line in _chapter(task.key, task.title))])


def _chapter(key: str, title: str) -> Iterator[str]:
    yield f"## {title}\n"
    things = {name: resolve(name) for name in chapter_names(key) if kind(name) != "autodata"}
    for name, thing in things.items():
        if inspect.isroutine(thing):
            yield f"### {name.rpartition('.')[2]}\n\n```text\n{call(name, thing)}\n```\n\n{plain(summary(name))}\n"
            yield f"```pycon\n{example(thing)}```\n"
    if classes := [name for name, thing in things.items() if inspect.isclass(thing)]:
        yield "| class | |\n|---|---|"
        yield from (f"| `{name}` | {plain(summary(name)).replace('|', BAR)} |" for name in classes)
        yield ""


def call(name: str, function: Any) -> str:
    """Return how a function is called: its parameters with their defaults, without types; a default of many letters is three dots."""
    given = [parameter.replace(annotation=parameter.empty) for parameter in inspect.signature(function).parameters.values()]
    short = [parameter.replace(default=DOTS) if len(repr(parameter.default)) > LETTERS else parameter for parameter in given]
    return textwrap.fill(f"{name}{inspect.Signature(short)}", width=100, subsequent_indent="    ", break_on_hyphens=False)


def plain(text: str) -> str:
    """Return a sentence of a docstring in Markdown: names and code between single backquotes."""
    code = re.sub(r"``(.+?)``", r"`\1`", re.sub(r":\w+:`~?(.+?)`", r"`\1`", text))
    return code.replace("](", r"]\(")  # brackets of a formula are no link


def example(function: Any) -> str:
    """Return the example of a function as an interactive session."""
    lines = []
    for step in doctest.DocTestParser().get_examples(inspect.getdoc(function) or ""):
        first, *others = step.source.splitlines()
        lines += [f">>> {first}", *(f"... {other}" for other in others), *step.want.splitlines()]
    return "".join(f"{line}\n" for line in lines)


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")

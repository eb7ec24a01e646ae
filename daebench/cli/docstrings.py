"""Docstrings of studies as the help of their commands."""

import re
from collections.abc import Mapping
from types import MappingProxyType

SEE = re.compile(r"(?:[,;]\s+see|\.\s+See)\s+:\w+:`[^`]+`(?:(?=\.)|,)")
"""Where a docstring sends its reader."""

ROLE = re.compile(r":\w+:`~?([^`]+)`")
"""A reference to an object in a docstring."""


def plain(text: str, names: Mapping[str, str] = MappingProxyType({})) -> str:
    """Return sentences of a docstring without markup, with other names of arguments."""
    words = re.sub(r"``(\w+)``", lambda match: names.get(match[1], match[1]), ROLE.sub(r"\1", SEE.sub("", text)))
    return " ".join(words.replace("``", "").split())


def introduction(docstring: str, fails_if: str, options: Mapping[str, str]) -> str:
    """Return the text of a docstring before its sections, without examples, and with the condition of exit status 1."""
    before = re.split(r"\n\n\w+\n-{3,}\n", docstring)[0]
    paragraphs = [paragraph for paragraph in before.split("\n\n") if not paragraph.lstrip().startswith(">>>")]
    first, *rest = (re.sub(r"::$", ".", plain(paragraph, options)) for paragraph in paragraphs)
    return "\n\n".join([f"{first.rstrip('.')}; exit 1 if {fails_if}." if fails_if else first, *rest])


def descriptions(docstring: str, options: Mapping[str, str]) -> dict[str, str]:
    """Return the descriptions of parameters in a docstring of NumPy's form, by name."""
    section = re.search(r"\nParameters\n-+\n(.*?)(?:\n\n\w+\n-{3,}\n|$)", docstring, re.DOTALL)
    entries = re.findall(r"^(\S[^\n]*?) : [^\n]*\n((?:[ ]+[^\n]*\n?)+)", section[1] if section else "", re.MULTILINE)
    return {name.strip(): plain(text, options) for names, text in entries for name in names.split(",")}

"""An entry of the page: a signature, and a docstring in its sections, as HTML."""

import builtins
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

from markupsafe import Markup, escape

from daebench.errors import DaebenchError
from daebench.pages.api.markup import Link, blocks, inline
from daebench.pages.api.public import members

if TYPE_CHECKING:
    from griffe import DocstringSection, Object

LONGEST = 84
"""Letters of a signature that stands in one line."""


class Dangling(DaebenchError):
    """A docstring that refers to what the page does not have."""


@dataclass(frozen=True)
class Section:
    """A section of a docstring as a list of definitions.

    Parameters
    ----------
    title : str
        "Parameters", "Returns", "Raises", ...
    rows : sequence of (terms, type, Markup)
        Names, what they are, and what is said of them.
    """

    title: str
    rows: list[tuple[list[str], Markup, Markup]]


@dataclass(frozen=True)
class Entry:
    """What is said of one public thing.

    Parameters
    ----------
    anchor, name, kind : str
        Where it stands in the page, the dotted name it is imported by, and what it is.
    signature : Markup
        How it is called; of a constant its value; of a module nothing.
    text : Markup
        The docstring's prose.
    sections : list of Section
        Its lists.
    parts : list of Entry
        Methods and properties of a class.
    """

    anchor: str
    name: str
    kind: str
    signature: Markup
    text: Markup
    sections: list[Section]
    parts: list["Entry"]


class Index:
    """Where every name stands: by the name it is imported by, that of its home, and in its own module by its last part."""

    def __init__(self, public: "Mapping[str, Object]") -> None:
        self.anchors: dict[str, str] = {}
        for path, definition in public.items():
            described = {member.name for member in members(definition)} if definition.is_class else set()
            self.anchors[path] = self.anchors[definition.path] = path
            for name in definition.all_members if definition.is_class else ():
                self.anchors[f"{path}.{name}"] = self.anchors[f"{definition.path}.{name}"] = f"{path}.{name}" if name in described else path
        self.entries: dict[str, list[str]] = {}
        for path in public:
            self.entries.setdefault(path.rpartition(".")[2], []).append(path)
        self.classes = {candidate.name: path for path, candidate in public.items() if candidate.is_class}

    def link(self, home: "Object") -> Link:
        """Return what finds names as they are written in the docstring of ``home``; it raises Dangling on others."""

        def anchor(target: str) -> str:
            for scope in (f"{home.path}.", f"{home.path.rpartition('.')[0]}.", f"{home.module.path}.", "daebench.", ""):
                if path := self.anchors.get(scope + target):
                    return path
            same = self.entries.get(target, [])
            if len(same) == 1:
                return same[0]
            if hasattr(builtins, target):
                return ""
            raise Dangling(f"the docstring of {home.path} refers to {target}, which the page has {len(same)} times; give the full name.")

        return anchor

    def types(self, text: str, subject: str = "") -> Markup:
        """Return the text of a type or signature with links at the classes of the page but the one that is described."""

        def name(match: re.Match[str]) -> str:
            path = self.classes.get(match[0])
            return str(Markup('<a href="#{}">{}</a>').format(path, match[0])) if path and match[0] != subject else match[0]

        return Markup(re.sub(r"(?<![\w&#.])[A-Z]\w+", name, str(escape(text))))


def entry(path: str, definition: "Object", index: Index) -> Entry:
    """Return the entry of a public thing."""
    import griffe

    link = index.link(definition)
    sections = definition.docstring and griffe.Docstring(definition.docstring.value).parse("numpy", warnings=False)
    texts = [section.value for section in sections or () if section.kind.value == "text"]
    parts = members(definition) if definition.is_class else []
    return Entry(
        anchor=path,
        name=path,
        kind=_kind(definition),
        signature=index.types(_signature(definition), definition.name),
        text=blocks("\n\n".join(texts), link),
        sections=[_section(section, link, index.types) for section in sections or () if section.kind.value != "text"],
        parts=[entry(f"{path}.{part.name}", part, index) for part in parts],
    )


def _kind(definition: "Object") -> str:
    return "property" if "property" in definition.labels else {"attribute": "constant"}.get(definition.kind.value, definition.kind.value)


def _signature(definition: "Object") -> str:
    """Return how a thing is called, one parameter a line where it is long."""
    import griffe

    if isinstance(definition, griffe.Attribute):
        value = (
            f"{definition.name} = {definition.value}"
            if definition.value and "property" not in definition.labels
            else f"{definition.name}: {definition.annotation}"
        )
        return value if len(value) <= LONGEST else definition.name
    if isinstance(definition, griffe.Class):
        text = definition.signature() or definition.name
        bases = ", ".join(str(base) for base in definition.bases if "Protocol" not in str(base))
        return f"class {_laid_out(text)}" + (f"  # {bases}" if bases else "")
    return _laid_out(definition.signature(return_type=True)) if isinstance(definition, griffe.Function) else ""


def _laid_out(text: str) -> str:
    if len(text) <= LONGEST:
        return text
    head, _, rest = text.partition("(")
    parts, depth, last = [], 1, 0
    for k, letter in enumerate(rest):
        depth += (letter in "([{") - (letter in ")]}")
        if not depth or (letter == "," and depth == 1):
            parts.append(rest[last:k].strip())
            last = k + 1
        if not depth:
            break
    return "\n".join([f"{head}(", *(f"    {part}," for part in parts), f"){rest[last:]}"])


def _section(section: "DocstringSection", link: Link, types: Callable[[str], Markup]) -> Section:
    """Return a section's rows; names that share their type and description share a row."""
    rows: list[tuple[list[str], Markup, Markup]] = []
    for element in section.value:
        row = (types(str(element.annotation or "")), inline(element.description, link))
        name = getattr(element, "name", "")
        if rows and name and rows[-1][1:] == row:
            rows[-1][0].append(name)
        else:
            rows.append(([name] if name else [], *row))
    return Section(section.title or section.kind.value.capitalize(), rows)

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
        for path, each in public.items():
            described = {member.name for member in members(each)} if each.is_class else set()
            self.anchors[path] = self.anchors[each.path] = path
            for name in each.all_members if each.is_class else ():
                self.anchors[f"{path}.{name}"] = self.anchors[f"{each.path}.{name}"] = f"{path}.{name}" if name in described else path
        self.entries: dict[str, list[str]] = {}
        for path in public:
            self.entries.setdefault(path.rpartition(".")[2], []).append(path)
        self.classes = {each.name: path for path, each in public.items() if each.is_class}

    def link(self, home: "Object") -> Link:
        """Return what finds names as they are written in the docstring of ``home``; it raises Dangling on others."""

        def anchor(target: str) -> str:
            for scope in (f"{home.path}.", f"{home.path.rpartition('.')[0]}.", f"{home.module.path}.", "daebench.", ""):
                if found := self.anchors.get(scope + target):
                    return found
            same = self.entries.get(target, [])
            if len(same) == 1:
                return same[0]
            if hasattr(builtins, target):
                return ""
            raise Dangling(f"the docstring of {home.path} refers to {target}, which the page has {len(same)} times; give the full name.")

        return anchor

    def types(self, text: str, own: str = "") -> Markup:
        """Return the text of a type or signature with links at the classes of the page but the one that is described."""

        def name(found: re.Match[str]) -> str:
            path = self.classes.get(found[0])
            return str(Markup('<a href="#{}">{}</a>').format(path, found[0])) if path and found[0] != own else found[0]

        return Markup(re.sub(r"(?<![\w&#.])[A-Z]\w+", name, str(escape(text))))


def entry(path: str, each: "Object", index: Index) -> Entry:
    """Return the entry of a public thing."""
    import griffe

    link = index.link(each)
    sections = each.docstring and griffe.Docstring(each.docstring.value).parse("numpy", warnings=False)
    texts = [section.value for section in sections or () if section.kind.value == "text"]
    parts = members(each) if each.is_class else []
    return Entry(
        anchor=path,
        name=path,
        kind=_kind(each),
        signature=index.types(_signature(each), each.name),
        text=blocks("\n\n".join(texts), link),
        sections=[_section(section, link, index.types) for section in sections or () if section.kind.value != "text"],
        parts=[entry(f"{path}.{part.name}", part, index) for part in parts],
    )


def _kind(each: "Object") -> str:
    return "property" if "property" in each.labels else {"attribute": "constant"}.get(each.kind.value, each.kind.value)


def _signature(each: "Object") -> str:
    """Return how a thing is called, one parameter a line where it is long."""
    import griffe

    if isinstance(each, griffe.Attribute):
        value = f"{each.name} = {each.value}" if each.value and "property" not in each.labels else f"{each.name}: {each.annotation}"
        return value if len(value) <= LONGEST else each.name
    if isinstance(each, griffe.Class):
        text = each.signature() or each.name
        bases = ", ".join(str(base) for base in each.bases if "Protocol" not in str(base))
        return f"class {_laid_out(text)}" + (f"  # {bases}" if bases else "")
    return _laid_out(each.signature(return_type=True)) if isinstance(each, griffe.Function) else ""


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
    for each in section.value:
        row = (types(str(each.annotation or "")), inline(each.description, link))
        name = getattr(each, "name", "")
        if rows and name and rows[-1][1:] == row:
            rows[-1][0].append(name)
        else:
            rows.append(([name] if name else [], *row))
    return Section(section.title or section.kind.value.capitalize(), rows)

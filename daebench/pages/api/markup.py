"""Docstrings' markup as HTML: paragraphs, lists, literal blocks, ``names``, emphasis and references to other entries."""

import re
import textwrap
from collections.abc import Callable

from markupsafe import Markup, escape

Link = Callable[[str], str]
"""Returns the anchor of a name, or "" for one of Python's own."""

INLINE = re.compile(
    r":(?P<role>func|class|meth|attr|data|mod|exc):`(?P<target>[^`]+)`"
    r"|``(?P<code>.+?)``"
    r"|(?<!`)`(?P<name>[^`]+)`(?!`)"
    r"|(?<![\w*])\*(?P<emphasis>[^\s*](?:[^*]*[^\s*])?)\*(?![\w*])",
    re.DOTALL,
)


def inline(text: str, link: Link) -> Markup:
    """Return a line of text as HTML."""
    parts, end = [], 0
    for found in INLINE.finditer(text):
        parts += [escape(text[end : found.start()]), _marked(found, link)]
        end = found.end()
    return Markup("").join([*parts, escape(text[end:])])


def _marked(found: re.Match[str], link: Link) -> Markup:
    if target := found["target"]:
        shown = target if found["role"] == "mod" else target.rpartition(".")[2]
        return linked(shown, link(target))
    if emphasis := found["emphasis"]:
        return Markup("<i>{}</i>").format(emphasis)
    return Markup("<code>{}</code>").format(found["code"] or found["name"])


def linked(shown: str, anchor: str) -> Markup:
    """Return a name as code, as a link where it has an anchor."""
    code = Markup("<code>{}</code>").format(shown)
    return Markup('<a href="#{}">{}</a>').format(anchor, code) if anchor else code


def blocks(text: str, link: Link) -> Markup:
    """Return text of several paragraphs as HTML: what is indented after ``::`` stands as it is, lines that begin with "-" are a list."""
    written: list[Markup] = []
    literal = False
    for block in _merged(re.split(r"\n[ \t]*\n", text.strip("\n"))):
        if literal and block.startswith(" "):
            written.append(Markup("<pre><code>{}</code></pre>").format(textwrap.dedent(block)))
            continue
        said = block.rstrip()
        literal = said.endswith("::")
        said = said.removesuffix(":") if literal else said
        if said != ":":
            written.append(_listed(said, link) if said.startswith("- ") else Markup("<p>{}</p>").format(inline(said, link)))
    return Markup("\n").join(written)


def _merged(blocks: list[str]) -> list[str]:
    """Return the blocks, those of one literal block that has empty lines in it as one."""
    found: list[str] = []
    for block in blocks:
        if block.startswith(" ") and found and found[-1].startswith(" "):
            found[-1] += f"\n\n{block}"
        else:
            found.append(block)
    return found


def _listed(block: str, link: Link) -> Markup:
    items = re.split(r"\n(?=- )", block)
    said = (" ".join(item.removeprefix("- ").split()) for item in items)
    return Markup("<ul>{}</ul>").format(Markup("").join(Markup("<li>{}</li>").format(inline(item, link)) for item in said))

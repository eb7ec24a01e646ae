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
    for match in INLINE.finditer(text):
        parts += [escape(text[end : match.start()]), _marked(match, link)]
        end = match.end()
    return Markup("").join([*parts, escape(text[end:])])


def _marked(match: re.Match[str], link: Link) -> Markup:
    if target := match["target"]:
        shown = target if match["role"] == "mod" else target.rpartition(".")[2]
        return linked(shown, link(target))
    if emphasis := match["emphasis"]:
        return Markup("<i>{}</i>").format(emphasis)
    return Markup("<code>{}</code>").format(match["code"] or match["name"])


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
        paragraph = block.rstrip()
        literal = paragraph.endswith("::")
        paragraph = paragraph.removesuffix(":") if literal else paragraph
        if paragraph != ":":
            written.append(_listed(paragraph, link) if paragraph.startswith("- ") else Markup("<p>{}</p>").format(inline(paragraph, link)))
    return Markup("\n").join(written)


def _merged(blocks: list[str]) -> list[str]:
    """Return the blocks, those of one literal block that has empty lines in it as one."""
    merged_blocks: list[str] = []
    for block in blocks:
        if block.startswith(" ") and merged_blocks and merged_blocks[-1].startswith(" "):
            merged_blocks[-1] += f"\n\n{block}"
        else:
            merged_blocks.append(block)
    return merged_blocks


def _listed(block: str, link: Link) -> Markup:
    items = re.split(r"\n(?=- )", block)
    lines = (" ".join(item.removeprefix("- ").split()) for item in items)
    return Markup("<ul>{}</ul>").format(Markup("").join(Markup("<li>{}</li>").format(inline(item, link)) for item in lines))

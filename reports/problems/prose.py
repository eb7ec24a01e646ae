"""The docstring of a problem as HTML: its coordinates, prose and formulas, none of which is left out."""

import inspect
import re

from markupsafe import Markup, escape


def description(doc: str) -> Markup:
    """Return a docstring up to its parameters as HTML: paragraphs, and formulas as they are written."""
    text = doc.partition("\nParameters\n")[0].removeprefix("Return ")
    blocks = [block for block in (text[:1].upper() + text[1:]).split("\n\n") if block.strip("\n :")]
    return Markup("\n").join(map(_block, blocks))


def _block(block: str) -> Markup:
    if block.startswith(" "):
        return Markup("<pre><code>{}</code></pre>").format(inspect.cleandoc(block))
    marked = re.sub(r"``(.+?)``", r"<code>\1</code>", str(escape(" ".join(block.split()))))
    return Markup("<p>{}</p>").format(Markup(re.sub(r"\*(\w[^*]*)\*", r"<cite>\1</cite>", marked)))

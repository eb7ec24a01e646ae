"""Figures in a page: the drawing, a description of it, and its files: drawing, data, code."""

import re
import sys
from pathlib import Path

from markupsafe import Markup, escape

from daebench.runs.files import atomic

SOURCE = re.compile(r"<dc:source>([\w.]+)</dc:source>")
"""Where a drawing says which module draws it."""


def picture(svg: Path, alt: str, caption: str) -> Markup:
    """Return a figure as HTML: the drawing itself, what it shows in words for those who cannot see it, and links to its files.

    Examples
    --------
    >>> from pathlib import Path
    >>> from tempfile import mkdtemp
    >>> from daebench.draw.figures import drawing, grid_of_axes, save
    >>> with drawing():
    ...     figure, axes = grid_of_axes(1, 1, 2.0)
    ...     svg = save(figure, Path(mkdtemp()), "empty", {"x": [1.0]})
    >>> html = picture(svg, "Empty axes.", "Nothing is drawn.")
    >>> "Empty axes." in html and "Nothing is drawn." in html
    True
    """
    text = svg.read_text(encoding="utf-8")
    links = {"SVG": f"{svg.parent.name}/{svg.name}", "data": f"{svg.parent.name}/{svg.stem}.csv", "code": _code(text, svg.parent.parent)}
    files = " · ".join(f'<a href="{link}">{words}</a>' for words, link in links.items() if link)
    drawing = inline_svg(text, svg.stem, alt)
    files = f'<span class="files">{files}</span>'
    return Markup(f'<figure id="figure-{svg.stem}"><div class="drawing">{drawing}</div><figcaption>{caption} {files}</figcaption></figure>')


def _code(text: str, folder: Path) -> str:
    """Write the source of the module that draws a figure beside its page, and return its path there; "" where none is known."""
    named = SOURCE.search(text)
    source = Path(getattr(sys.modules.get(named[1]), "__file__", None) or "") if named else Path()
    if not (named and source.is_file()):
        return ""
    path = folder / "code" / f"{named[1].removeprefix('daebench.')}.py"
    path.parent.mkdir(exist_ok=True)
    with atomic(path) as scratch:
        scratch.write_bytes(source.read_bytes())
    return f"code/{path.name}"


def inline_svg(text: str, prefix: str, alt: str) -> str:
    """Return a drawing to be put into a page: no prolog, no metadata, no fixed size, names that no other drawing has, and alt text.

    Examples
    --------
    >>> text = '<svg width="9pt" height="9pt" viewBox="0 0 9 9"><path id="a"/></svg>'
    >>> inline_svg(text, "first", "A dot.")
    '<svg role="img" aria-label="A dot." viewBox="0 0 9 9"><path id="first-a"/></svg>'
    """
    text = text[text.index("<svg") :]
    text = re.sub(r"<metadata>.*?</metadata>", "", text, flags=re.DOTALL)
    text = re.sub(r'(<svg[^>]*?) width="[^"]*"', r"\1", re.sub(r'(<svg[^>]*?) height="[^"]*"', r"\1", text, count=1), count=1)
    text = re.sub(r'\bid="([^"]+)"', rf'id="{prefix}-\1"', text)
    text = re.sub(r'href="#([^"]+)"', rf'href="#{prefix}-\1"', text).replace("url(#", f"url(#{prefix}-")
    return text.replace("<svg ", f'<svg role="img" aria-label="{escape(alt)}" ', 1)

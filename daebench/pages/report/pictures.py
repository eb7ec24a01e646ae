"""Figures in a page: the drawing itself, what it shows in words, and its files."""

import re
from pathlib import Path

from markupsafe import Markup, escape


def picture(svg: Path, alt: str, caption: str) -> Markup:
    """Return a figure as HTML: the drawing itself, what it shows in words for those who cannot see it, and links to its files."""
    files = ", ".join(f'<a href="{svg.parent.name}/{svg.stem}.{ending}">{ending.upper()}</a>' for ending in ("svg", "png", "csv"))
    drawing = inline_svg(svg.read_text(encoding="utf-8"), svg.stem, alt)
    files = f'<span class="files">{files}</span>'
    return Markup(f'<figure id="figure-{svg.stem}"><div class="drawing">{drawing}</div><figcaption>{caption} {files}</figcaption></figure>')


def inline_svg(text: str, prefix: str, alt: str) -> str:
    """Return a drawing to be put into a page: no prolog, no metadata, no fixed size, names that no other drawing has, and alt text."""
    text = text[text.index("<svg") :]
    text = re.sub(r"<metadata>.*?</metadata>", "", text, flags=re.DOTALL)
    text = re.sub(r'(<svg[^>]*?) width="[^"]*"', r"\1", re.sub(r'(<svg[^>]*?) height="[^"]*"', r"\1", text, count=1), count=1)
    text = re.sub(r'\bid="([^"]+)"', rf'id="{prefix}-\1"', text)
    text = re.sub(r'href="#([^"]+)"', rf'href="#{prefix}-\1"', text).replace("url(#", f"url(#{prefix}-")
    return text.replace("<svg ", f'<svg role="img" aria-label="{escape(alt)}" ', 1)

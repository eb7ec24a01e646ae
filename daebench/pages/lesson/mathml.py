"""Markdown's HTML as marimo makes it, turned into HTML that any browser shows by itself: formulas as MathML."""

import html
import re

FORMULA = re.compile(r"<marimo-tex[^>]*>\s*\|\|(\(|\[)(.*?)\|\|(?:\)|\])\s*</marimo-tex>", re.DOTALL)
NUMBER = re.compile(r"\\tag\{(.*?)\}")


def static_html(text: str) -> str:
    """Return what marimo makes of Markdown without anything that only marimo's own page understands."""
    text = FORMULA.sub(lambda match: formula(html.unescape(match[2]), display=match[1] == "["), text)
    text = re.sub(r'<span class="paragraph">(.*?)</span>', r"<p>\1</p>", text, flags=re.DOTALL)
    text = re.sub(r'<p>\s*(<div class="equation">.*?</div>)\s*</p>', r"\1", text, flags=re.DOTALL)
    text = re.sub(
        r"<table>.*?</table>", r'<div class="scroll" tabindex="0" role="region" aria-label="table">\g<0></div>', text, flags=re.DOTALL
    )
    return re.sub(r'^<span class="markdown[^"]*">(.*)</span>\s*$', r"\1", text, flags=re.DOTALL)


def formula(latex: str, *, display: bool) -> str:
    r"""Return a formula as MathML; one that stands alone has its number, written \\tag{...}, at the side."""
    from latex2mathml.converter import convert

    number = NUMBER.search(latex)
    mathml: str = convert(NUMBER.sub("", latex).strip(), display="block" if display else "inline")
    mathml = mathml.replace(' xmlns="http://www.w3.org/1998/Math/MathML"', "")
    if not display:
        return mathml
    side = f'<span class="no">({html.escape(number[1])})</span>' if number else ""
    return f'<div class="equation">{mathml}{side}</div>'

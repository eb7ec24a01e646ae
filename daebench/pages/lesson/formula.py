"""A formula as MathML, which any browser shows by itself."""

import html
import re

from latex2mathml.converter import convert

NUMBER = re.compile(r"\\tag\{(.*?)\}")


def formula(latex: str, *, display: bool = False) -> str:
    r"""Return a formula as MathML; one that stands alone has its number, written \\tag{...}, at the side."""
    number = NUMBER.search(latex)
    mathml: str = convert(NUMBER.sub("", latex).strip(), display="block" if display else "inline")
    mathml = mathml.replace(' xmlns="http://www.w3.org/1998/Math/MathML"', "")
    if not display:
        return mathml
    side = f'<span class="no">({html.escape(number[1])})</span>' if number else ""
    return f'<div class="equation">{mathml}{side}</div>'

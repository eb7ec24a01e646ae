"""Formulas as MathML, which browsers show without a script."""

import re
from typing import Any

from docutils import nodes
from latex2mathml.converter import convert

NAMESPACE = ' xmlns="http://www.w3.org/1998/Math/MathML"'
NUMBER = re.compile(r"\\tag\{(.*?)\}")


def inline(self: Any, node: nodes.math) -> None:
    """Write a formula in a line."""
    self.body.append(convert(node.astext()).replace(NAMESPACE, ""))
    raise nodes.SkipNode


def display(self: Any, node: nodes.math_block) -> None:
    r"""Write a formula of its own line, with its number, written ``\tag{...}``, at the side."""
    latex = node.astext()
    number = NUMBER.search(latex)
    side = f'<span class="number">({number[1]})</span>' if number else ""
    mathml = convert(NUMBER.sub("", latex).strip(), display="block").replace(NAMESPACE, "")
    self.body.append(f'<div class="equation">{mathml}{side}</div>')
    raise nodes.SkipNode


def setup(app: Any) -> None:
    """Have formulas of HTML pages written so."""
    app.add_html_math_renderer("mathml", (inline, None), (display, None))
    app.config.html_math_renderer = "mathml"

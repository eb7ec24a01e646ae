"""Formulas as they are set in print: parentheses as tall as what they hold."""

import re

FORMULA = re.compile(r"<math\b.*?</math>", re.DOTALL)
PARENTHESIS = re.compile(r"<mo>([()])</mo>")
TALL = ("<mfrac", "<mtable", "<munderover")
"""What parentheses grow around."""


def set_parentheses(page: str) -> str:
    """Return a page whose MathML has parentheses of the height of the line, but for those that hold something tall.

    Browsers stretch each to all that stands beside it in its row, a superscript over a parenthesis included, to thrice the height of a
    letter. One that says by itself whether it stretches is left alone, and so is one without its other half.
    """
    return FORMULA.sub(lambda formula: _set(formula[0]), page)


def _set(formula: str) -> str:
    opened: list[re.Match[str]] = []
    flat: set[int] = set()
    for sign in PARENTHESIS.finditer(formula):
        if sign[1] == "(":
            opened.append(sign)
        elif opened:
            first = opened.pop()
            held = formula[first.end() : sign.start()]
            if not any(tall in held for tall in TALL):
                flat |= {first.start(), sign.start()}
    return PARENTHESIS.sub(lambda sign: f'<mo stretchy="false">{sign[1]}</mo>' if sign.start() in flat else sign[0], formula)

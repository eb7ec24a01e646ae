"""Formulas: parentheses are as tall as what they hold, and all else is left as it was."""

import re

import pytest

from daebench.pages.report.formulas import set_parentheses

Q, FRACTION = "<mi>q</mi>", "<mfrac><mi>h</mi><mn>2</mn></mfrac>"


def braces(inside, **attributes):
    more = "".join(f' {name}="{value}"' for name, value in attributes.items())
    return f"<mo{more}>(</mo>{inside}<mo{more}>)</mo>"


def formula(body):
    return f'<math display="block">{body}</math>'


@pytest.mark.parametrize(
    ("body", "expected"),
    [
        (braces(Q), braces(Q, stretchy="false")),
        (braces(FRACTION), braces(FRACTION)),
        (FRACTION + braces(Q), FRACTION + braces(Q, stretchy="false")),
        (braces(FRACTION + braces(Q)), braces(FRACTION + braces(Q, stretchy="false"))),
        (braces(Q + braces(FRACTION)), braces(Q + braces(FRACTION))),
        (braces(Q) + braces(FRACTION), braces(Q, stretchy="false") + braces(FRACTION)),
        (braces(Q, stretchy="true"), braces(Q, stretchy="true")),
        ("<mo>)</mo>" + Q + "<mo>(</mo>", "<mo>)</mo>" + Q + "<mo>(</mo>"),
        ("<mo>(</mo>" + braces(Q), "<mo>(</mo>" + braces(Q, stretchy="false")),
    ],
)
def test_parentheses_stretch_around_what_is_tall_alone(body, expected):
    assert set_parentheses(formula(body)) == formula(expected)


def test_what_is_no_formula_is_left_alone_and_formulas_do_not_see_each_other():
    text = "<p>(1.9) <code><mo>(</mo></code></p>"
    assert set_parentheses(text) == text
    two = formula(braces(Q)) + text + formula(braces(FRACTION))
    assert set_parentheses(two) == formula(braces(Q, stretchy="false")) + text + formula(braces(FRACTION))
    assert re.sub(r' stretchy="false"', "", set_parentheses(two)) == two

"""Formulas: parentheses are as tall as what they hold, and all else is left as it was."""

import pytest

from daebench.pages.report.formulas import set_parentheses

Q, FRACTION = "<mi>q</mi>", "<mfrac><mi>h</mi><mn>2</mn></mfrac>"


def braces(inside, **attributes):
    more = "".join(f' {name}="{value}"' for name, value in attributes.items())
    return f"<mo{more}>(</mo>{inside}<mo{more}>)</mo>"


def formula(body):
    return f'<math display="block">{body}</math>'


SMALL, TALL = braces(Q, stretchy="false"), braces(FRACTION)
SET = {
    braces(Q): SMALL,
    TALL: TALL,
    FRACTION + braces(Q): FRACTION + SMALL,
    braces(FRACTION + braces(Q)): braces(FRACTION + SMALL),
    braces(Q + TALL): braces(Q + TALL),
    braces(Q) + TALL: SMALL + TALL,
    braces(Q, stretchy="true"): braces(Q, stretchy="true"),
    f"<mo>)</mo>{Q}<mo>(</mo>": f"<mo>)</mo>{Q}<mo>(</mo>",
    "<mo>(</mo>" + braces(Q): "<mo>(</mo>" + SMALL,
}


@pytest.mark.parametrize(("body", "expected"), SET.items())
def test_parentheses_stretch_around_what_is_tall_alone(body, expected):
    assert set_parentheses(formula(body)) == formula(expected)


def test_what_is_no_formula_is_left_alone_and_formulas_do_not_see_each_other():
    text = "<p>(1.9) <code><mo>(</mo></code></p>"
    assert set_parentheses(text) == text
    assert set_parentheses(formula(braces(Q)) + text + formula(TALL)) == formula(SMALL) + text + formula(TALL)

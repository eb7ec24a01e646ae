"""Copies of syntax are whole, and share nothing with the original that somebody may change."""

import ast
import inspect

import pytest

from daebench.compiler import link, specialise, syntax
from daebench.compiler.syntax import copied

ODD = "def f(x: int = 3, *a, k=None, **m):\n    x[1:2, ...] += (yield)\n    return lambda z: f'{z!r:>3}' if z is not a else {1: x.y, **m}"


@pytest.mark.parametrize("text", [ODD, *map(inspect.getsource, (link, specialise, syntax))], ids=["odd", "link", "specialise", "syntax"])
def test_a_copy_is_the_same_and_shares_nothing_with_fields(text):
    tree = ast.parse(text)
    copy = copied(tree)
    assert ast.dump(copy, include_attributes=True) == ast.dump(tree, include_attributes=True)
    ours, theirs = ({id(node) for node in ast.walk(whole) if node._fields} for whole in (copy, tree))
    assert not ours & theirs


def test_a_change_of_a_copy_leaves_the_original_alone():
    (original,) = ast.parse("def f(x):\n    y = x\n    return y").body
    copy = copied(original)
    copy.name, copy.args.args[0].arg, copy.body[0].value.id = "g", "z", "z"
    copy.body.pop()
    assert ast.unparse(original) == "def f(x):\n    y = x\n    return y"

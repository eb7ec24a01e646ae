"""Text of LLVM: the installed release takes every operation that is printed, and each gives what Python gives."""

import math
import operator

import llvmlite.binding as llvm
import pytest
from recorded import compiled

from daebench.compiler.print.llvm import Text
from daebench.compiler.print.llvm_operations import FORMATS, INTRINSIC
from daebench.compiler.trace.code import Code
from daebench.compiler.trace.ir import FLOATS, TRUTH, Function
from daebench.compiler.trace.names import MATHEMATICS


def taken(op, kinds, result):
    """Have LLVM read and verify the text of one operation on numbers of these kinds."""
    code, made = Code(), Function("f")
    made.parameters = [code.effect("parameter", kind, ()) for kind in kinds]
    with code.apart(made):
        made.results = [code.emit(op, result, tuple(made.parameters))]
    text = Text()
    text.add(made)
    llvm.parse_assembly(text.whole()).verify()


@pytest.mark.parametrize("length", ["", "4", "16"])
def test_operations_are_taken_by_the_installed_release(length):
    for op, kind in FORMATS:
        converts = op[1:3] == "to"
        result = TRUTH if op in ("lt", "le", "gt", "ge", "eq", "ne") else op[-1] if converts else kind
        taken(op, [kind + length] * (3 if op == "select" else 1 if converts or op == "neg" else 2), result + length)


TAKEN = "select b d d d,select b8 d8 d8 d8,select b d8 d8 d8,select b8 i8 i8 i8,not b b,not b4 b4,splat d d16,any b4 b,vset d d d2"


def test_a_negation_a_spread_number_and_the_truth_of_one_of_several_are_taken():
    for words in TAKEN.split(","):
        op, *kinds, result = words.split()
        taken(op, kinds, result)


@pytest.mark.parametrize("length", ["", "8"])
def test_functions_are_taken_by_the_installed_release(length):
    for op in {*MATHEMATICS.values(), *INTRINSIC, "abs"} - {"fabs"}:
        for kind in FLOATS:
            taken(op, [kind + length] * (2 if op in ("pow", "atan2", "hypot") else 1), kind + length)


WHOLE = {"+": operator.add, "-": operator.sub, "*": operator.mul, "//": operator.floordiv, "%": operator.mod}


@pytest.mark.parametrize("sign", WHOLE)
def test_whole_numbers_are_those_of_python(sign):
    root = compiled(f"def root(x, y):\n    return x {sign} y")
    assert [root(x, y) for x in (0, 1, 7, 12) for y in (1, 3, 5)] == [WHOLE[sign](x, y) for x in (0, 1, 7, 12) for y in (1, 3, 5)]


@pytest.mark.parametrize("x", [0.0, -0.0, 0.3, -2.7, 5e-324, 1e308, math.inf, math.nan])
def test_signs_and_roots_are_those_of_python(x):
    root = compiled("def root(x):\n    return -x, abs(x), sqrt(abs(x)), x == x, x != x, x < 1.0, not x < 1.0")
    told = root(x)
    assert repr(told[:3]) == repr((-x, abs(x), math.sqrt(abs(x))))
    assert told[3:] == (x == x, x != x, x < 1.0, not x < 1.0)

"""The type of an operation on numbers is found once, is the one that numba finds, and is used by all that is compiled."""

import operator

import numba
import numpy as np
import pytest
from numba import types
from numba.core.errors import TypingError
from numba.core.registry import cpu_target

from daebench.compiler import pipeline
from daebench.compiler.linked_only import linked_only
from daebench.compiler.machine_code import callback, njit
from daebench.compiler.pipeline import MemoisedContext

NUMBERS = (types.float64, types.float32, types.complex128, types.int64, types.boolean, types.literal(2))


class Counted:
    """numba's own context, which counts what it is asked."""

    def __init__(self):
        self.asked = 0

    def __getattr__(self, name):
        return getattr(cpu_target.typing_context, name)

    def resolve_function_type(self, *call):
        self.asked += 1
        return cpu_target.typing_context.resolve_function_type(*call)


@pytest.fixture
def counted(monkeypatch):
    monkeypatch.setattr("daebench.compiler.pipeline.SIGNATURES", {})
    cpu_target.typing_context.refresh()
    return Counted()


@pytest.mark.parametrize("function", [operator.add, operator.mul, operator.truediv, operator.eq, np.sqrt, np.sin], ids=lambda f: f.__name__)
def test_every_combination_of_numbers_has_the_signature_that_numba_gives(counted, function):
    known, own = cpu_target.typing_context.resolve_value_type(function), cpu_target.typing_context
    for a in NUMBERS:
        for arguments in [(a,)] if isinstance(function, np.ufunc) else [(a, b) for b in NUMBERS]:
            expected = own.resolve_function_type(known, arguments, {})
            for _ in range(2):
                assert MemoisedContext(counted).resolve_function_type(known, arguments, {}) == expected
    assert counted.asked == (len(NUMBERS) if isinstance(function, np.ufunc) else len(NUMBERS) ** 2)


def test_what_is_no_number_is_asked_for_each_time(counted):
    known = cpu_target.typing_context.resolve_value_type(operator.add)
    vectors = types.UniTuple(types.float64, 2), types.UniTuple(types.float64, 3)
    for _ in range(2):
        assert MemoisedContext(counted).resolve_function_type(known, vectors, {}).return_type == types.UniTuple(types.float64, 5)
    assert counted.asked == 2


def test_what_cannot_be_resolved_is_not_remembered(counted):
    known = cpu_target.typing_context.resolve_value_type(operator.lt)
    for _ in range(2):
        with pytest.raises(TypingError):
            MemoisedContext(counted).resolve_function_type(known, (types.float64, types.complex128), {})
    assert counted.asked == 2


def squared(x):
    return x * x


def called(function, compiled):
    """Compile a function for a float in one of the ways in which functions of generated modules are compiled."""
    if compiled == "callback":
        return callback("float64(float64)")(function).address
    if compiled == "linked_only":
        inner = linked_only(function)
        return numba.njit(lambda x: inner(x))(3.0)
    return njit()(function)(3.0)


@pytest.mark.parametrize("compiled", ["njit", "callback", "linked_only"])
def test_all_ways_to_compile_a_function_use_it(counted, compiled):
    assert called(squared, compiled)
    product = cpu_target.typing_context.resolve_value_type(operator.mul)
    assert pipeline.SIGNATURES[product, (types.float64, types.float64)].return_type == types.float64

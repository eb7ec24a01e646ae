"""Functions that are only linked into their callers have no machine code of their own, and give the same numbers."""

import numba

from daebench.compiler.linked_only import linked_only


def squared(x):
    return x * x


def test_its_callers_give_the_same_numbers_and_it_has_no_address():
    inner = linked_only(squared)

    @numba.njit
    def outer(x):
        return inner(x) + inner(x + 1.0)

    assert outer(3.0) == squared(3.0) + squared(4.0)
    (made,) = inner.overloads.values()
    assert made.library.get_pointer_to_function(made.fndesc.llvm_func_name) == 0
    (called,) = outer.overloads.values()
    assert called.library.get_pointer_to_function(called.fndesc.llvm_func_name) != 0

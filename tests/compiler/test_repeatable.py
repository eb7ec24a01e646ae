"""What SymPy chooses at random while it factors is the same each time, and the random numbers of others go on as they would have."""

import sympy as sp
from sympy.core.random import rng

from daebench.compiler import expressions
from daebench.compiler.expressions import shortened


def test_factors_are_found_with_the_same_random_numbers_and_no_others_are_drawn(monkeypatch):
    drawn = []
    monkeypatch.setattr(expressions.sp, "factor", lambda expression: drawn.append(rng.random()) or expression)
    x, y = sp.symbols("x y")
    for seed in (5, 6):
        rng.seed(seed)
        state = rng.getstate()
        shortened(x**2 + 2 * x * y + y**2)
        assert rng.getstate() == state
    assert len(drawn) == 2
    assert drawn[0] == drawn[1]

"""The functions of dual numbers that linked modules call, see :mod:`daebench.compiler.trace.dual`, for numbers of a script."""

from collections.abc import Callable, Mapping
from typing import Any

from daebench.compiler.javascript.numbers import Arithmetic, Dual, Number, is_zero, value_of
from daebench.compiler.trace.dual import SETTLED, STALLED

INFINITY = float("inf")


def nested(function: Callable[..., Any], x: Any, *others: Any) -> Any:
    """Return the values of a function for each number of a nested tuple."""
    if isinstance(x, tuple):
        return tuple(nested(function, *entries) for entries in zip(x, *others, strict=True))
    return function(x, *others)


def functions(arithmetic: Arithmetic) -> Mapping[str, Callable[..., Any]]:  # noqa: C901 - five short functions
    """Return the functions by name."""

    def modulus(x: Number) -> Number:
        if not isinstance(x, Dual):
            return arithmetic.elementary("abs", x)
        return Dual(modulus(x.value), tuple(part if is_zero(part) else modulus(part) for part in x.parts))

    def with_tangents(x: Number, y: Number) -> Number:
        return Dual(value_of(x), y.parts) if isinstance(y, Dual) else x

    def unsettled(size: Number, scale: Number, last: Number) -> Number:
        if not isinstance(size, Dual):
            return size
        k, parts = len(size.parts), []
        scales = scale.parts if isinstance(scale, Dual) else (0.0,) * k
        before = last.parts if isinstance(last, Dual) else (0.0,) * k
        for change, part, earlier in zip(size.parts, scales, before, strict=True):
            settled = arithmetic.compare("<=", change, arithmetic.times(SETTLED, part))
            small = arithmetic.real("*", STALLED, arithmetic.sum("+", value_of(scale), part))
            still = (arithmetic.compare(">=", change, earlier), arithmetic.compare("<=", change, small))
            parts.append(arithmetic.chosen(arithmetic.logical("||", settled, arithmetic.logical("&&", *still)), -1.0, change))
        return Dual(size.value, tuple(parts))

    def below(x: Number, bound: float) -> Number:
        result: Number = True
        for part in x.parts if isinstance(x, Dual) else ():
            result = arithmetic.logical("&&", result, arithmetic.compare("<", part, bound))
        return result

    return {
        "modulus": modulus,
        "value": value_of,
        "values": lambda x: nested(value_of, x),
        "with_tangents": lambda x, y: nested(with_tangents, x, y),
        "unsettled": unsettled,
        "at_rest": lambda last: below(last, 0.0),
        "finite_tangents": lambda size: below(size, INFINITY),
        "select": arithmetic.chosen,
        "spread": lambda array, i, j, x: None,
    }

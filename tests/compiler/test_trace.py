"""Functions as machine code do what Python does with their text: over branches, loops, tuples, arrays, kinds of numbers."""

import inspect
import itertools
from functools import partial

import numpy as np
import on_arrays
import pytest
import steered
from recorded import compiled
from sympy.printing.numpy import NumPyPrinter

from daebench.errors import InvalidProblem


@pytest.fixture(params=[False, True], ids=["machine code", "Python"])
def native(request):
    """What makes a function of a text."""
    return partial(compiled, by_python=request.param)


def of(native, module, name):
    """Return a function of a file as it is recorded, and as Python has it."""
    return native(inspect.getsource(module), name), getattr(module, name)


def roots(module, arguments):
    """Return the names of the functions of a file with these arguments."""
    functions = inspect.getmembers(module, inspect.isfunction)
    return [name for name, function in functions if [*inspect.signature(function).parameters] == arguments and name != "least"]


def bits(x):
    """Return nested results with numbers by their bits, which tell -0 from 0 and have one NaN."""
    if isinstance(x, tuple):
        return tuple(map(bits, x))
    if isinstance(x, np.ndarray):
        return x.tolist()
    return "nan" if x != x else float(x).hex()


NUMBERS = (-2.5, -1.0, -0.3, -0.0, 0.0, 0.1, 0.3, 1.0, 1.7, 4.0, float("inf"), float("nan"))


@pytest.mark.parametrize("name", roots(steered, ["x", "y"]))
def test_machine_code_gives_the_bits_of_python(name, native):
    fast, slow = of(native, steered, name)
    compared = 0
    for x, y in itertools.product(NUMBERS, repeat=2):
        try:
            expected = slow(x, y)
        except (ZeroDivisionError, OverflowError, ValueError):
            continue  # where Python raises, machine code has infinity or NaN
        if name in ("functions_of_numbers", "powers"):  # whose bits are those of the platform, or of products
            assert np.allclose(fast(x, y), expected, rtol=1e-15, atol=0, equal_nan=True), (x, y)
        else:
            assert bits(fast(x, y)) == bits(expected), (x, y)
        compared += 1
    assert compared > 50


KINKED = {"ceil", "floor", "isinf", "isnan", "sign"}
PRINTED = {"sinc"} | {name.removeprefix("numpy.") for name in NumPyPrinter().known_functions.values() if name.startswith("numpy.")} - KINKED


@pytest.mark.parametrize("name", sorted(PRINTED))
def test_every_smooth_function_that_definitions_may_contain_is_that_of_numpy(name):
    function = getattr(np, name)
    arguments = ["x", "y"][: function.nin] if isinstance(function, np.ufunc) else ["x"]
    fast, compared = compiled(f"def root({', '.join(arguments)}):\n    return {name}({', '.join(arguments)})"), 0
    for numbers in itertools.product((-2.5, -0.4, 0.0, 0.3, 0.9, 1.7, 4.0, 8.5), repeat=len(arguments)):
        with np.errstate(all="ignore"):
            expected = function(*numbers)
        assert np.allclose(fast(*numbers), expected, rtol=4e-16, atol=1e-17, equal_nan=True), numbers
        compared += np.isfinite(expected)
    assert compared > 2
    fast(*map(np.float32, numbers))
    assert list(fast.kinds.values()) == ["d", "s"]


@pytest.mark.parametrize("name", roots(on_arrays, ["a", "n"]))
def test_machine_code_on_arrays_gives_the_bits_of_python(name, native):
    fast, slow = of(native, on_arrays, name)
    for n in (3, 4, 7):
        for shift in (0.5, -1.25):
            a = np.arange(n) * 0.7 + shift
            assert bits(fast(a.copy(), n)) == bits(slow(a.copy(), n)), n
            assert bits(fast(np.repeat(a, 2)[::2], n)) == bits(slow(a.copy(), n)), n


def test_numbers_of_single_precision_stay_single_and_whole_ones_widen_them(native):
    text = "def root(x, n):\n    return x * numpy.float32(0.1), x + x, n * x, sqrt(x), numpy.float64(x) * 0.1"
    fast, x = native(text), np.float32(0.3)
    expected = (x * np.float32(0.1), x + x, np.float64(3) * np.float64(x), np.sqrt(x), float(x) * 0.1)
    assert fast(x, 3) == tuple(map(float, expected))


def test_a_long_function_is_one_function_that_is_called(native):
    terms = [f"x * {k}.25 - y / (1.0 + {k}.0 * x * x)" for k in range(200)]
    lines = "\n".join(f"    t{k} = {term}" for k, term in enumerate(terms))
    total = " + ".join(f"t{k}" for k in range(200))
    long = f"def long(x, y):\n{lines}\n    s = 0.0\n    if x > y:\n        s = 1.0\n    return s + {total}"
    text = f"{long}\n\ndef root(x, y):\n    return long(x, y), long(y, x), long(x + y, x)"
    fast, space = native(text), {}
    exec(text, space)
    for x, y in itertools.product((-1.5, 0.2, 2.0), repeat=2):
        assert bits(fast(x, y)) == bits(space["root"](x, y))


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("def root(x, y):\n    a = x\n    if x > y:\n        a = (x, y)\n    return a", "of one form where one branch was taken"),
        ("def root(x, y):\n    a = x\n    for k in range(3):\n        a = (a, y)\n    return a", "of one form before a loop"),
        (
            "def root(x, y):\n    for z in (x, y):\n        if z > 0.0:\n            break\n    return x",
            "break or continue in a loop over a tuple",
        ),
        ("def root(x, y):\n    for k in range(3):\n        x = k\n    return k", "k is read behind the loop that binds it"),
        ("def root(x, y):\n    with x:\n        return y", "context manager"),
        ("def root(x, y):\n    return x + lost(y)", "name 'lost' is not defined"),
        ("def root(x, y):\n    return [x, y][int(x > y)]", "known at run time"),
    ],
    ids=["branches", "turns", "break", "index", "statement", "name", "subscript"],
)
def test_what_cannot_be_recorded_is_refused_in_one_sentence(text, said):
    with pytest.raises(InvalidProblem, match=said) as refused:
        compiled(text)(1.0, 2.0)
    assert "\n" not in str(refused.value)
    assert "root" in str(refused.value)

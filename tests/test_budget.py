"""What the house may hold: code tokens and files of each package, and habits of writing that only become rarer, as in ``budget.toml``."""

import ast
import tomllib
from pathlib import Path

import house

BUDGET = tomllib.loads((Path(__file__).parent / "budget.toml").read_text(encoding="utf-8"))
SLACK = 0.02
"""How far below its limit a package may be before the limit is to be lowered."""


LONGEST = 45
"""Most lines of code of a function, its docstring, comments and blank lines not counted."""


def test_each_package_has_the_code_and_the_files_that_it_may_have_and_no_function_is_too_long():
    sizes, limits = house.sizes(), BUDGET["packages"]
    assert set(limits) == set(sizes)
    larger = {name: sizes[name] for name in limits if sizes[name][0] > limits[name][0] or sizes[name][1] > limits[name][1]}
    assert larger == {}, "see what an old line can pay, or raise the limit and say for what"
    least = {name: ((1 - SLACK) * tokens - 100, files) for name, (tokens, files) in limits.items()}
    smaller = {name: sizes[name] for name in limits if sizes[name][0] < least[name][0] or sizes[name][1] < least[name][1]}
    assert smaller == {}, "lower the limit"
    counted = {f"{file}:{name}": n for file in house.files() for name, n in house.lengths(file.read_text(encoding="utf-8")).items()}
    assert len(counted) > 1000
    assert {name: n for name, n in counted.items() if n > LONGEST} == {}


def test_habits_become_rarer():
    assert house.habits() == BUDGET["habits"], "lower the number where there are fewer; write otherwise where there are more"


def test_a_function_is_as_long_as_its_lines_of_code():
    code = 'def f():\n    """One.\n\n    Two.\n    """\n    # three\n    x = 1\n\n    return """\n    text\n    """\n'
    assert house.lengths(code) == {"f:1": 5}


def test_tokens_are_those_of_code():
    text = '"""A docstring."""\nimport os\n\n# a comment\ndef f(x):\n    """Another."""\n    return x + 1\n'
    assert house.tokens(text) == len(["def", "f", "(", "x", ")", ":", "return", "x", "+", "1"])


def test_habits_are_counted():
    code = 'def f(own):\n    """Return what it is."""\n    import os\n    for each in own:\n        made = each\n'
    nodes = list(ast.walk(ast.parse(code)))
    assert (house.local_imports(nodes), house.vague_names(nodes), house.what_docstrings(nodes)) == (1, 3, 1)


def test_a_question_for_the_class_of_a_problem_is_found_where_there_is_one():
    for code, asks in (
        ("assert isinstance(ivp, A | PoissonIvp)", True),
        ("isinstance(ivp, (ConstrainedIvp, A))", True),
        ("isinstance(method, PoissonStep)", False),
        ("x: PoissonIvp = 1", False),
    ):
        assert house.asks_for_the_class_of_a_problem(list(ast.walk(ast.parse(code)))) == asks, code

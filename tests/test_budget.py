"""What the house may hold: code tokens and files of each package, and habits of writing that only become rarer, as in ``budget.toml``."""

import ast
import tomllib
from pathlib import Path

import house
import pytest

BUDGET = tomllib.loads((Path(__file__).parent / "budget.toml").read_text(encoding="utf-8"))
SLACK = 0.02
"""How far below its limit a package may be before the limit is to be lowered."""


def test_each_package_has_a_limit():
    assert set(BUDGET["packages"]) == set(house.sizes())


@pytest.mark.parametrize("package", BUDGET["packages"])
def test_a_package_has_the_code_and_the_files_that_it_may_have(package):
    most_tokens, most_files = BUDGET["packages"][package]
    tokens, files = house.sizes()[package]
    assert tokens <= most_tokens, f"{package} has {tokens} code tokens: see what an old line can pay, or raise the limit and say for what"
    assert files <= most_files
    assert tokens >= (1 - SLACK) * most_tokens - 100, f"{package} has {tokens} code tokens only: lower its limit"
    assert files == most_files, f"{package} has {files} files only: lower its limit"


@pytest.mark.parametrize("habit", BUDGET["habits"])
def test_a_habit_becomes_rarer(habit):
    assert house.habits()[habit] == BUDGET["habits"][habit], "lower the number where there are fewer; write otherwise where there are more"


def test_tokens_are_those_of_code():
    text = '"""A docstring."""\nimport os\n\n# a comment\ndef f(x):\n    """Another."""\n    return x + 1\n'
    assert house.tokens(text) == len(["def", "f", "(", "x", ")", ":", "return", "x", "+", "1"])


def test_habits_are_counted():
    tree = ast.parse('def f(own):\n    """Return what it is."""\n    import os\n    for each in own:\n        made = each\n')
    assert (house.local_imports(tree), house.vague_names(tree), house.what_docstrings(tree)) == (1, 3, 1)


@pytest.mark.parametrize(
    ("code", "asks"),
    [
        ("assert isinstance(ivp, A | PoissonIvp)", True),
        ("isinstance(ivp, (ConstrainedIvp, A))", True),
        ("isinstance(method, PoissonStep)", False),
        ("x: PoissonIvp = 1", False),
    ],
)
def test_a_question_for_the_class_of_a_problem_is_found_where_there_is_one(code, asks):
    assert house.asks_for_the_class_of_a_problem(ast.parse(code)) == asks

"""Sizes of the code as numbers that formatting cannot change, and habits of writing that are counted."""

import ast
import io
import re
import tokenize
from collections import Counter
from functools import cache
from pathlib import Path

ROOT = Path(__file__).parents[2]
FOLDERS = ("daebench", "problems", "reference", "reports")
LAYOUT = {
    tokenize.COMMENT,
    tokenize.NL,
    tokenize.NEWLINE,
    tokenize.INDENT,
    tokenize.DEDENT,
    tokenize.ENDMARKER,
    tokenize.ENCODING,
}
VAGUE = {"each", "found", "own", "kept", "made", "told"}
"""Words that name nothing, as names of variables."""


@cache
def files(*folders):
    """Return the files of Python below folders, each once: links into the package are left out."""
    found = []
    for folder in folders or FOLDERS:
        for file in sorted((ROOT / folder).rglob("*.py")):
            if not any(part.is_symlink() for part in (file, *file.parents) if part != ROOT):
                found.append(file)
    return tuple(found)


@cache
def parsed(text):
    """Return the tree of a text."""
    return ast.parse(text)


@cache
def lines_of_tokens(text):
    """Return the first and last line of each token that is neither comment nor layout."""
    tokens = tokenize.generate_tokens(io.StringIO(text).readline)
    return tuple((token.start[0], token.end[0]) for token in tokens if token.type not in LAYOUT)


def tokens(text):
    """Return the number of tokens of a text, without docstrings, comments, imports and layout."""
    without = set()
    for node in ast.walk(parsed(text)):
        is_text = isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant) and isinstance(node.value.value, str)
        if is_text or isinstance(node, ast.Import | ast.ImportFrom):
            without |= set(range(node.lineno, node.end_lineno + 1))
    return sum(first not in without for first, _ in lines_of_tokens(text))


def lengths(text):
    """Return the numbers of lines of code of the functions in a source, by name and line."""
    code = {line for first, last in lines_of_tokens(text) for line in range(first, last + 1)}
    functions = (node for node in ast.walk(parsed(text)) if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef))
    return {f"{node.name}:{node.lineno}": len(code & _body_lines(node)) for node in functions}


def _body_lines(function):
    lines = set(range(function.lineno, function.end_lineno + 1))
    if ast.get_docstring(function) is None:
        return lines
    return lines - set(range(function.body[0].lineno, function.body[0].end_lineno + 1))


def package(file):
    """Return the name of the package that a file counts for."""
    first, *rest = file.relative_to(ROOT).parts
    return f"daebench/{rest[0]}" if first == "daebench" and len(rest) > 1 else first


@cache
def sizes():
    """Return (tokens, files) of each package."""
    counted, numbers = Counter(), Counter()
    for file in files():
        counted[package(file)] += tokens(file.read_text(encoding="utf-8"))
        numbers[package(file)] += 1
    return {name: (counted[name], numbers[name]) for name in numbers}


def local_imports(nodes):
    """Return the number of imports within functions."""
    functions = (node for node in nodes if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef))
    inner = {id(node): node for function in functions for node in ast.walk(function) if isinstance(node, ast.Import | ast.ImportFrom)}
    return len(inner)


def vague_names(nodes):
    """Return the number of times that a name which names nothing is bound: by an assignment, a loop, or as an argument."""
    bound = (node.id for node in nodes if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store))
    arguments = (node.arg for node in nodes if isinstance(node, ast.arg))
    return sum(name in VAGUE for name in (*bound, *arguments))


WHAT = re.compile(r"^(?:\w+ )?what\b", re.IGNORECASE)
"""A first line such as "Return what ..." or "What ...", which says no noun."""


def what_docstrings(nodes):
    """Return the number of docstrings whose first line has "what" as its object or subject."""
    documented = (node for node in nodes if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef))
    return sum(bool(WHAT.match(ast.get_docstring(node) or "")) for node in documented)


CLASSES_OF_A_PROBLEM = {
    *("ConstrainedIvp", "PoissonIvp", "Trajectory", "PoissonTrajectory"),
    *("ConstrainedHamiltonian", "ConstrainedChain", "PoissonSystem", "PoissonLattice"),
}


def asks_for_the_class_of_a_problem(nodes):
    """Tell whether code asks for the class of a problem, an initial value problem or a trajectory: 1 or 0."""
    calls = (node for node in nodes if isinstance(node, ast.Call) and ast.unparse(node.func) == "isinstance")
    return int(any(CLASSES_OF_A_PROBLEM & {node.id for node in ast.walk(call.args[1]) if isinstance(node, ast.Name)} for call in calls))


def asks_for_the_kind_of_a_problem(nodes):
    """Tell whether code asks if states lie on a constraint manifold: 1 or 0."""
    return int(any(isinstance(node, ast.Attribute) and node.attr == "on_manifold" for node in nodes))


HABITS = {
    "local_imports": local_imports,
    "vague_names": vague_names,
    "what_docstrings": what_docstrings,
    "files_that_ask_for_the_class_of_a_problem": asks_for_the_class_of_a_problem,
    "files_that_ask_for_the_kind_of_a_problem": asks_for_the_kind_of_a_problem,
}


@cache
def habits():
    """Return how often each habit is met in the code."""
    trees = [list(ast.walk(parsed(file.read_text(encoding="utf-8")))) for file in files()]
    return {name: sum(map(count, trees)) for name, count in HABITS.items()}

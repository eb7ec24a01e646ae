"""The sentences of all errors, read from the source: run as a script, it writes tests/sentences.txt, to be read as English."""

import ast
import re
from functools import cache
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).parents[2]
CODE = r"[a-z0-9]+(-[a-z0-9]+)+"
LISTED = ROOT / "tests" / "sentences.txt"


class Raised(NamedTuple):
    """A place where an error is made; in the sentence a value is {name}."""

    module: str
    code: str
    sentence: str


@cache
def raised():
    """Return all places, but for those that pass on the code of another error, and for interruptions."""
    folders = ("daebench", "problems", "reference", "reports")
    trees = {path: ast.parse(path.read_bytes()) for folder in folders for path in sorted((ROOT / folder).rglob("*.py"))}
    classes = [node for tree in trees.values() for node in ast.walk(tree) if isinstance(node, ast.ClassDef)]
    kinds = {"DaebenchError"}
    while more := {node.name for node in classes if kinds & {_name(base) for base in node.bases}} - kinds:
        kinds |= more
    return [place for path, tree in trees.items() for place in _of_file(path, tree, kinds - {"Interrupted"})]


def _of_file(path, tree, kinds):
    nodes = list(ast.walk(tree))
    makers = dict.fromkeys(kinds, 0)  # what makes errors, and at which place among its arguments the sentence is
    makers |= {node.arg: 0 for node in nodes if isinstance(node, ast.arg) and node.annotation and _names(node.annotation) & kinds}
    makers |= {_name(node.targets[0]): 0 for node in nodes if isinstance(node, ast.Assign) and _names(node.value) & kinds}
    for node in nodes:
        if isinstance(node, ast.FunctionDef) and {"sentence", "code"} <= set(names := [arg.arg for arg in node.args.args]):
            makers[node.name] = names.index("sentence")
    for node in nodes:
        if isinstance(node, ast.Call) and _name(node.func) in makers:
            sentence, code, *_ = *node.args[makers[_name(node.func)] :], ast.Constant(""), ast.Constant("")
            if isinstance(code, ast.Constant):
                yield Raised(".".join(path.relative_to(ROOT).with_suffix("").parts), code.value, words(sentence))


def _name(node):
    return getattr(node, "id", getattr(node, "attr", None))


def _names(node):
    return {_name(part) for part in ast.walk(node)}


def words(node):
    """Return a text as it reads: a value is {name}, and the first of several texts stands for all."""
    match node:
        case ast.Constant(str(text)):
            return text
        case ast.JoinedStr(parts):
            return "".join(words(part.value) if isinstance(part, ast.FormattedValue) else part.value for part in parts)
        case ast.BinOp(left, ast.Add(), right):
            return words(left) + words(right)
        case ast.IfExp(body=body, orelse=other):
            return words(body) or words(other)
        case ast.Subscript(ast.Tuple([first, *_])):
            return words(first)
    left_out = r"'[^']*'|\bfor\b.*|\bif\b.*|\.\w+\(|\[.*?\]|\b(or|and|sorted|map|str|set|type|len|repr|list|__name__)\b"
    names = re.findall(r"[A-Za-z]\w*", re.sub(left_out, "(", ast.unparse(node)))
    return f"{{{names[-1] if names else 'value'}}}"


def listed():
    """Return the text of the file."""
    return "".join(f"{line}\n" for line in sorted({f"{place.code}: {place.sentence}" for place in raised()}))


if __name__ == "__main__":
    LISTED.write_text(listed(), encoding="utf-8")

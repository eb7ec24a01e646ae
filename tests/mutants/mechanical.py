"""Mechanical mutants, and the share of them that fast tests kill: ``python tests/mutants/mechanical.py output/reached.json --number 300``.

Operators, constants, comparisons, indices and statements are changed one at a time in a copy of the tree, drawn by a seed: as many of each
kind and package. A mutant meets fast tests for twenty seconds of CPU time, from an empty cache, until one fails: those that call the
function that is changed, or take its scheme, the quickest first, and one case of each test before the second of any. Which test calls what
is measured once, in one run of all fast tests, and kept in the file that is given.
"""

import argparse
import ast
import os
import signal
import sys
import tempfile
import time
from collections import Counter, defaultdict
from dataclasses import dataclass
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parents[1] / "support"))
import planting
from reached import OPTIONS, in_child, reached

PACKAGES = {
    "schemes": ("daebench/schemes",),
    "formulations": ("daebench/methods/formulations",),
    "diagnostics": ("daebench/diagnostics",),
    "ensembles": ("daebench/starts", "daebench/methods/ensemble", "daebench/studies/ensemble"),
    "records": ("daebench/records",),
}
"""Folders of code."""

KINDS = ("operator", "constant", "comparison", "index", "statement")
OPERATORS = {ast.Add: ("+", "-"), ast.Sub: ("-", "+"), ast.Mult: ("*", "/"), ast.Div: ("/", "*"), ast.Pow: ("**", "*")}
INEQUALITIES = {ast.Lt: ("<", "<="), ast.LtE: ("<=", "<"), ast.Gt: (">", ">="), ast.GtE: (">=", ">")}
COMPARISONS = INEQUALITIES | {ast.Eq: ("==", "!="), ast.NotEq: ("!=", "==")}
BUDGET = 20.0
"""Seconds of CPU time that a mutant meets tests for."""

LONGEST = 300
"""Seconds after which a mutant counts as killed: it does not end."""


@dataclass(frozen=True)
class Mutant:
    """A place in a file and what stands there instead."""

    file: str
    kind: str
    line: int
    begin: int
    end: int
    old: str
    new: str

    @property
    def name(self):
        return f"{self.file}:{self.line} {self.kind} at {self.begin}: {self.old} -> {self.new}"


class Places:
    """A text by the positions that its syntax tree has: lines, and columns in bytes."""

    def __init__(self, text):
        self.content = text.encode()
        lengths = [len(line) for line in self.content.splitlines(keepends=True)]
        self.starts = [sum(lengths[:k]) for k in range(len(lengths))]

    def of(self, node):
        return self.starts[node.lineno - 1] + node.col_offset, self.starts[node.end_lineno - 1] + node.end_col_offset

    def sign(self, left, right, sign):
        """Return begin and end of an operator between two operands."""
        begin, end = self.of(left)[1], self.of(right)[0]
        at = self.content.find(sign.encode(), begin, end)
        return (at, at + len(sign)) if at >= 0 else None


def left_out(tree):
    """Return the nodes that no mutant is made of: annotations, texts with values in them, and decorators."""
    roots = []
    for node in ast.walk(tree):
        roots += [getattr(node, name, None) for name in ("annotation", "returns")] + getattr(node, "decorator_list", [])
        roots += [node] if isinstance(node, ast.JoinedStr | ast.Import | ast.ImportFrom) else []
    return {id(inner) for root in roots if root is not None for inner in ast.walk(root)}


def mutants(file, text):
    """Give all mutants of a text."""
    tree, places = ast.parse(text), Places(text)
    without = left_out(tree)
    indices = {id(node.slice) for node in ast.walk(tree) if isinstance(node, ast.Subscript)}
    for node in ast.walk(tree):
        if id(node) in without:
            continue
        for kind, span, new in changes(node, places, id(node) in indices):
            if span is not None:
                old = places.content[slice(*span)].decode()
                yield Mutant(file, kind, node.lineno, *span, " ".join(old.split())[:60], new)


def changes(node, places, is_index):
    """Give the kind, the place and the new text of each change of one node."""
    if isinstance(node, ast.BinOp) and type(node.op) in OPERATORS:
        old, new = OPERATORS[type(node.op)]
        yield "operator", places.sign(node.left, node.right, old), new
    elif isinstance(node, ast.Compare) and len(node.ops) == 1 and type(node.ops[0]) in COMPARISONS:
        old, new = COMPARISONS[type(node.ops[0])]
        yield "comparison", places.sign(node.left, node.comparators[0], old), new
    elif isinstance(node, ast.Constant) and type(node.value) in (int, float):
        yield "index" if is_index else "constant", places.of(node), another(node.value)
    elif isinstance(node, ast.AugAssign) or (isinstance(node, ast.Expr) and isinstance(node.value, ast.Call)) or _is_stored(node):
        yield "statement", places.of(node), "pass"


def _is_stored(node):
    return isinstance(node, ast.Assign) and isinstance(node.targets[0], ast.Subscript | ast.Attribute)


def another(value):
    """Return another number as text: the next whole one, or twice as much."""
    return str(value + 1) if isinstance(value, int) else repr(2 * value or 1.0)


def drawn(package, number, seed):
    """Return so many mutants of a package: equal parts of each kind, and constants in the place of kinds that have fewer."""
    files = sorted(file for folder in PACKAGES[package] for file in (planting.ROOT / folder).rglob("*.py"))
    by_kind = defaultdict(dict)
    for file in files:
        for mutant in mutants(file.relative_to(planting.ROOT).as_posix(), file.read_text(encoding="utf-8")):
            by_kind[mutant.kind][mutant.name] = mutant
    share = {kind: min(number // len(KINDS), len(by_kind[kind])) for kind in KINDS}
    share["constant"] += number - sum(share.values())
    return [by_kind[kind][name] for kind in KINDS for name in planting.drawn(by_kind[kind], seed, share[kind])]


def asked(mutant, seconds, tests):
    """Return the tests that a mutant meets: those that call its function or take its scheme, or any of its file where it is in none."""
    tree = ast.parse((planting.ROOT / mutant.file).read_text(encoding="utf-8"))
    functions = [x for x in ast.walk(tree) if isinstance(x, ast.FunctionDef) and x.lineno <= mutant.line <= x.end_lineno]
    lines = {line for x in functions[-1:] for line in (x.lineno, *(decorator.lineno for decorator in x.decorator_list))}
    places = {f"{mutant.file}:{line}" for line in {0, *lines}} & tests.keys()
    places = places or {place for place in tests if place.startswith(f"{mutant.file}:")}
    calling = sorted({test for place in places for test in tests[place]}, key=lambda test: (seconds[test], test))
    seen, rank = Counter(), {}
    for test in calling:
        function = test.partition("[")[0]
        rank[test], seen[function] = seen[function], seen[function] + 1
    chosen, total = [], 0.0
    for test in sorted(calling, key=rank.__getitem__):
        if (total := total + seconds[test]) > BUDGET and chosen:
            break
        chosen.append(test)
    return chosen


class Failures:
    """A plugin of pytest that counts what fails, and stops after twice the time that the tests are to take."""

    def __init__(self):
        self.failed, self.began = 0, time.process_time()

    def pytest_runtest_logreport(self, report):
        self.failed += report.failed

    def pytest_collectreport(self, report):
        self.failed += report.failed

    @pytest.hookimpl(trylast=True)
    def pytest_runtest_teardown(self, item):
        if time.process_time() > self.began + 2 * BUDGET:
            item.session.shouldstop = "no time is left"


def fails(tree, tests):
    """Return whether a test fails in a copy of the tree, or none comes to an end: in a process of its own, with an empty cache."""
    with tempfile.TemporaryDirectory(prefix="daebench-mutant-") as kept:
        child = in_child(lambda: _status(tree, tests, Path(kept)))
        until = time.monotonic() + LONGEST
        while not (ended := os.waitpid(child, os.WNOHANG))[0] and time.monotonic() < until:
            time.sleep(0.02)
        if not ended[0]:
            os.killpg(child, signal.SIGKILL)
            os.waitpid(child, 0)
        return not ended[0] or os.waitstatus_to_exitcode(ended[1]) != 0


def _status(tree, tests, kept):
    output = os.open(kept / "output", os.O_WRONLY | os.O_CREAT)
    os.dup2(output, 1)
    os.dup2(output, 2)
    os.chdir(tree)
    os.environ |= {"DAEBENCH_CACHE": str(kept / "cache"), "PYTHONPATH": str(tree)}
    sys.path[:1] = [str(tree)]
    sys.dont_write_bytecode = False
    failures = Failures()
    status = pytest.main([*OPTIONS, "-x", *tests], plugins=[failures])
    return failures.failed > 0 or status not in (0, 2)  # 2: stopped for want of time


def is_killed(tree, mutant, seconds, tests):
    """Return whether one of the tests fails with a mutant, or does not end."""
    if not (chosen := asked(mutant, seconds, tests)):
        return False
    content = (tree / mutant.file).read_bytes()
    text = (content[: mutant.begin] + mutant.new.encode() + content[mutant.end :]).decode()
    with planting.replaced(tree, mutant.file, text):
        return fails(tree, chosen)


def measure(tree, package, number, seed, seconds, tests):
    """Plant the mutants of a package; print what becomes of each, and return the numbers of all and of those killed, by kind."""
    counts = {kind: [0, 0] for kind in KINDS}
    for mutant in drawn(package, number, seed):
        killed = is_killed(tree, mutant, seconds, tests)
        counts[mutant.kind][0] += 1
        counts[mutant.kind][1] += killed
        print(f"{'killed' if killed else 'survives'}: {mutant.name}", flush=True)
    return counts


def main():
    """Measure the packages that are named, and print a line for each."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("kept", type=Path, help="file of which test calls what; made if it is not there")
    parser.add_argument("packages", nargs="*", help=f"some of {', '.join(PACKAGES)}; all by default")
    parser.add_argument("--number", type=int, default=300, help="mutants of all five packages")
    parser.add_argument("--seed", default="1")
    given = parser.parse_args()
    seconds, tests = reached(given.kept.resolve(), tuple(folder for folders in PACKAGES.values() for folder in folders))
    with tempfile.TemporaryDirectory(prefix="daebench-mutants-") as folder:
        tree = planting.copy_tree(Path(folder) / "tree")
        for package in given.packages or PACKAGES:
            counts = measure(tree, package, given.number // len(PACKAGES), given.seed, seconds, tests)
            planted, killed = (sum(count[k] for count in counts.values()) for k in (0, 1))
            by_kind = ", ".join(f"{kind} {count[1]} of {count[0]}" for kind, count in counts.items())
            print(f"{package}: {killed} of {planted} killed, {100 * killed / planted:.0f} % ({by_kind})", flush=True)


if __name__ == "__main__":
    main()

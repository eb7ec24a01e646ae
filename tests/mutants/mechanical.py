"""Mechanical mutants, and the share of them that fast tests kill: ``python tests/mutants/mechanical.py --number 300``.

Operators, constants, comparisons, indices and statements are changed one at a time in a copy of the tree, drawn by a seed: as many of each
kind and package. A mutant meets the tests of its package that name its module, or all where none does, for ten seconds of CPU time,
from an empty cache, until one fails.
"""

import argparse
import ast
import os
import re
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

PACKAGES = {
    "schemes": (
        ["daebench/schemes"],
        [
            *(
                f"tests/schemes/test_{name}.py"
                for name in ("definitions", "multipliers", "newton", "splitting", "lobatto", "newer_schemes")
            ),
            *(f"tests/schemes/test_{name}.py" for name in ("poisson_schemes", "ode_schemes", "constraint_solvers", "named_branches")),
            *(f"tests/schemes/test_{name}.py" for name in ("tableaux", "slow_iteration", "solver_projection", "projections")),
            *("tests/compiler/test_functions_of_masses.py", "tests/systems/test_chains.py", "tests/methods/test_rank_loss.py"),
        ],
    ),
    "formulations": (
        ["daebench/methods/formulations"],
        [f"tests/methods/test_{name}.py" for name in ("formulations", "chain_ida", "poisson_solvers", "sensitivities", "gradient")],
    ),
    "diagnostics": (["daebench/diagnostics"], ["tests/diagnostics", "tests/studies/test_order_fit.py"]),
    "ensembles": (
        ["daebench/starts", "daebench/methods/ensemble", "daebench/studies/ensemble"],
        ["tests/starts", "tests/methods/test_ensemble_runs.py", "tests/studies/test_ensemble.py", "tests/studies/test_kept_ensembles.py"],
    ),
    "records": (
        ["daebench/records"],
        ["tests/records", *(f"tests/studies/test_{name}.py" for name in ("archive", "certificate", "foreign", "studies"))],
    ),
}
"""Folders of code, and the tests that are asked."""

KINDS = ("operator", "constant", "comparison", "index", "statement")
OPERATORS = {ast.Add: ("+", "-"), ast.Sub: ("-", "+"), ast.Mult: ("*", "/"), ast.Div: ("/", "*"), ast.Pow: ("**", "*")}
INEQUALITIES = {ast.Lt: ("<", "<="), ast.LtE: ("<=", "<"), ast.Gt: (">", ">="), ast.GtE: (">=", ">")}
COMPARISONS = INEQUALITIES | {ast.Eq: ("==", "!="), ast.NotEq: ("!=", "==")}
BUDGET = 10.0
"""Seconds of CPU time that a mutant meets tests for, one case of each function first."""

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
    files = sorted(file for folder in PACKAGES[package][0] for file in (planting.ROOT / folder).rglob("*.py"))
    by_kind = defaultdict(dict)
    for file in files:
        for mutant in mutants(file.relative_to(planting.ROOT).as_posix(), file.read_text(encoding="utf-8")):
            by_kind[mutant.kind][mutant.name] = mutant
    share = {kind: min(number // len(KINDS), len(by_kind[kind])) for kind in KINDS}
    share["constant"] += number - sum(share.values())
    return [by_kind[kind][name] for kind in KINDS for name in planting.drawn(by_kind[kind], seed, share[kind])]


class Budget:
    """A plugin of pytest that takes one case of each function before the second of any, and stops after so much CPU time."""

    def __init__(self, stem):
        self.stem, self.failed, self.began = stem, 0, 0.0

    def pytest_collection_modifyitems(self, items):
        seen, rank = Counter(), {}
        for item in items:
            function = item.nodeid.partition("[")[0]
            named = re.search(rf"\b{self.stem}\b", item.nodeid) is not None
            rank[item] = (not named, seen[function, named])
            seen[function, named] += 1
        items.sort(key=rank.__getitem__)
        self.began = time.process_time()

    def pytest_runtest_logreport(self, report):
        self.failed += report.failed

    def pytest_collectreport(self, report):
        self.failed += report.failed

    @pytest.hookimpl(trylast=True)
    def pytest_runtest_teardown(self, item):
        if time.process_time() > self.began + BUDGET:
            item.session.shouldstop = "no time is left"


def asked(mutant, package):
    """Return the files of tests of a package that name the module of a mutant; all where none does."""
    folders = [planting.ROOT / place for place in PACKAGES[package][1]]
    files = [file for place in folders for file in ([place] if place.suffix else sorted(place.glob("test_*.py")))]
    module = mutant.file.removesuffix(".py").replace("/", ".")
    naming = [file for file in files if re.search(rf"\b{module}\b", file.read_text(encoding="utf-8"))]
    return [file.relative_to(planting.ROOT).as_posix() for file in naming or files]


def fails(tree, tests, stem):
    """Return whether a test fails in a copy of the tree, or none comes to an end: in a process of its own, with an empty cache."""
    with tempfile.TemporaryDirectory(prefix="daebench-mutant-") as kept:
        child = os.fork()
        if not child:
            os.setsid()
            _in_child(tree, tests, stem, Path(kept))
        until = time.monotonic() + LONGEST
        while not (ended := os.waitpid(child, os.WNOHANG))[0] and time.monotonic() < until:
            time.sleep(0.02)
        if not ended[0]:
            os.killpg(child, signal.SIGKILL)
            os.waitpid(child, 0)
        return not ended[0] or os.waitstatus_to_exitcode(ended[1]) != 0


def _in_child(tree, tests, stem, kept):
    output = os.open(kept / "output", os.O_WRONLY | os.O_CREAT)
    os.dup2(output, 1)
    os.dup2(output, 2)
    os.chdir(tree)
    os.environ |= {"DAEBENCH_CACHE": str(kept / "cache"), "PYTHONPATH": str(tree)}
    sys.path[:1] = [str(tree)]
    sys.dont_write_bytecode = False
    budget = Budget(stem)
    status = pytest.main(
        ["-q", "-x", "-p", "no:xdist", "-p", "no:randomly", "-p", "no:cacheprovider", "-m", "not slow", *tests], plugins=[budget]
    )
    os._exit(int(budget.failed > 0 or status not in (0, 2, 5)))  # 2: stopped for want of time; 5: all of its tests are slow


def is_killed(tree, mutant, package):
    """Return whether one of the tests fails with a mutant, or does not end."""
    content = (tree / mutant.file).read_bytes()
    text = (content[: mutant.begin] + mutant.new.encode() + content[mutant.end :]).decode()
    with planting.replaced(tree, mutant.file, text):
        return fails(tree, asked(mutant, package), Path(mutant.file).stem)


def measure(tree, package, number, seed):
    """Plant the mutants of a package; print what becomes of each, and return the numbers of all and of those killed, by kind."""
    counts = {kind: [0, 0] for kind in KINDS}
    for mutant in drawn(package, number, seed):
        killed = is_killed(tree, mutant, package)
        counts[mutant.kind][0] += 1
        counts[mutant.kind][1] += killed
        print(f"{'killed' if killed else 'survives'}: {mutant.name}", flush=True)
    return counts


def main():
    """Measure the packages that are named, and print a line for each."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("packages", nargs="*", help=f"some of {', '.join(PACKAGES)}; all by default")
    parser.add_argument("--number", type=int, default=300, help="mutants of all five packages")
    parser.add_argument("--seed", default="1")
    given = parser.parse_args()
    with tempfile.TemporaryDirectory(prefix="daebench-mutants-") as folder:
        tree = planting.copy_tree(Path(folder) / "tree")
        for package in given.packages or PACKAGES:
            counts = measure(tree, package, given.number // len(PACKAGES), given.seed)
            planted, killed = (sum(count[k] for count in counts.values()) for k in (0, 1))
            by_kind = ", ".join(f"{kind} {count[1]} of {count[0]}" for kind, count in counts.items())
            print(f"{package}: {killed} of {planted} killed, {100 * killed / planted:.0f} % ({by_kind})", flush=True)


if __name__ == "__main__":
    main()

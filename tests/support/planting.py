"""Faults put one at a time into a copy of the tree, and what the tests say of each."""

import hashlib
import os
import re
import shutil
import subprocess
import sys
import tempfile
import tomllib
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cache
from pathlib import Path

ROOT = Path(__file__).parents[2]
FAULTS = ROOT / "tests" / "mutants"
CODE = ("daebench", "problems", "reference", "reports", "tests")
BESIDE = (".git", ".mypy_cache", ".ruff_cache", ".pytest_cache", ".hypothesis", "output", "build", "dist", ".venv")
"""Names at the top of the tree that no test reads."""

SAMPLE = 8
LONGEST = 300
"""Seconds after which a run of tests is given up."""


@dataclass(frozen=True, kw_only=True)
class Fault:
    """A fault as data: where it stands, its text, and the tests that fail with it."""

    name: str
    words: str
    file: str
    old: str
    new: str
    killers: tuple[str, ...]
    only_one: str = ""
    """Why no second test of another file and with another oracle fails; empty if there is one."""


@cache
def faults():
    """Return all faults by name."""
    rows = [row for file in sorted(FAULTS.glob("*.toml")) for row in tomllib.loads(file.read_text(encoding="utf-8"))["fault"]]
    return {row["name"]: Fault(**row | {"killers": tuple(row["killers"])}) for row in rows}


def with_fault(text, fault):
    """Return a text with a fault in it; raise if its old text does not stand there exactly once."""
    if text.count(fault.old) != 1:
        raise LookupError(f"{fault.name} is stale: its old text stands {text.count(fault.old)} times in {fault.file}")
    return text.replace(fault.old, fault.new)


def digest():
    """Return the hash of the tree's code and tests; it needs no git."""
    hashed = hashlib.sha256()
    for file in sorted(file for folder in CODE for ending in ("py", "toml") for file in (ROOT / folder).rglob(f"*.{ending}")):
        hashed.update(file.relative_to(ROOT).as_posix().encode() + b"\0" + file.read_bytes() + b"\0")
    return hashed.hexdigest()


def drawn(names, seed, number):
    """Return some of the names: the same ones for the same seed, whatever the order of the names."""
    return sorted(names, key=lambda name: hashlib.sha256(f"{seed} {name}".encode()).digest())[:number]


def copy_tree(folder):
    """Make a copy of the tree by hard links, or by copies of files where these are refused; links to folders remain links."""
    left_out = {str(ROOT): BESIDE}
    shutil.copytree(ROOT, folder, symlinks=True, copy_function=_linked, ignore=lambda place, names: {*left_out.get(place, ())} & {*names})
    return folder


def _linked(source, target):
    try:
        os.link(source, target)
    except OSError:
        shutil.copy2(source, target)
    return target


@contextmanager
def replaced(tree, file, text):
    """Have a file of a copy of the tree be another text, under a time of its own, so that no compiled one is taken for it."""
    path = tree / file
    original = tree / f"{file}.original"
    path.rename(original)
    path.write_text(text, encoding="utf-8")
    os.utime(path, (0, int(hashlib.sha256(text.encode()).hexdigest()[:7], 16)))
    try:
        yield
    finally:
        path.unlink()
        original.rename(path)


def outcomes(tree, tests, *options, longest=LONGEST):
    """Return the outcome of each of these tests in a copy of the tree: passed, failed, error, skipped; or none if it was not run.

    They start from an empty cache of their own: no number that the code without the fault has stored is of use to them.
    """
    with tempfile.TemporaryDirectory(prefix="daebench-mutant-") as kept:
        places = {"DAEBENCH_CACHE": f"{kept}/cache", "PYTHONPATH": str(tree), "COLUMNS": "1000"}
        surroundings = {name: value for name, value in os.environ.items() if not name.startswith(("PYTEST", "PYTHONDONTWRITE", "DAEBENCH"))}
        command = [sys.executable, "-m", "pytest", "-q", "-rA", "--tb=line", "-p", "no:xdist", "-p", "no:cacheprovider", "-m", "not slow"]
        try:
            run = subprocess.run(
                [*command, *options, *tests],
                cwd=tree,
                env=surroundings | places,
                capture_output=True,
                text=True,
                timeout=longest,
                check=False,
            )
        except subprocess.TimeoutExpired:
            return dict.fromkeys(tests, "too long")
    said = re.findall(r"^(PASSED|FAILED|ERROR|SKIPPED) (\S.*?)(?: - .*)?$", run.stdout, re.MULTILINE)
    states = {node: state.lower() for state, node in said}
    return {test: states.get(test, "none") for test in tests} if tests else states

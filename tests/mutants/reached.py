"""Which fast tests call a function, or take the scheme that it belongs to: measured once, in one run of all of them."""

import ast
import json
import os
import sys
import time
import traceback
from collections import defaultdict
from functools import cache

import planting
import pytest

OPTIONS = ("-q", "-p", "no:xdist", "-p", "no:randomly", "-p", "no:cacheprovider", "-m", "not slow")
"""Those of a run of fast tests in one process."""

LINKING = ("kernel", "read", "printable")
"""Methods of ``FixedStepMethod`` that take the text of a scheme: its functions are read and not called."""


class Calls:
    """A plugin of pytest that notes what each test calls of some folders, the files of the schemes that it takes, and its time."""

    def __init__(self, folders):
        self.folders, self.seconds, self.tests = folders, {}, defaultdict(list)

    @pytest.hookimpl(wrapper=True)
    def pytest_runtest_protocol(self, item):
        called, taken, began = set(), set(), time.process_time()

        def note(frame, *_):  # of calls alone: a function gets no tracer of its own
            called.add(frame.f_code)
            if frame.f_code.co_name in LINKING and frame.f_code.co_filename.endswith("/fixed_step/base.py"):
                taken.add(frame.f_locals["self"].scheme_module)

        before = sys.gettrace()
        sys.settrace(note)
        try:
            return (yield)
        finally:
            sys.settrace(before)
            self.seconds[item.nodeid] = round(time.process_time() - began, 3)
            read = {f"{file}:0" for module in taken for file in imported(module)}
            for place in read | {_place(code) for code in called}:
                if place.startswith(self.folders):
                    self.tests[place].append(item.nodeid)


def _place(code):
    return f"{code.co_filename.removeprefix(f'{planting.ROOT}/')}:{code.co_firstlineno}"


@cache
def imported(module):
    """Return the file of a scheme's module and those of all schemes and kernels that it imports."""
    file = f"{module.replace('.', '/')}.py"
    tree = ast.parse((planting.ROOT / file).read_text(encoding="utf-8"))
    names = {node.module for node in ast.walk(tree) if isinstance(node, ast.ImportFrom) and node.module}
    return {file}.union(*(imported(name) for name in names if name.startswith("daebench.schemes.")))


def reached(kept, folders):
    """Return how long each fast test takes, and the tests that call a function, by its file and first line; measured unless kept.

    The file of a scheme, with 0 for the line, has the tests that take the scheme.
    """
    if not kept.exists():
        kept.parent.mkdir(parents=True, exist_ok=True)
        files = sorted(file.relative_to(planting.ROOT).as_posix() for file in (planting.ROOT / "tests").rglob("test_*.py"))
        parts = [kept.with_suffix(f".{k}") for k in range(os.cpu_count() or 1)]
        children = [in_child(lambda part=part, k=k: _noted(part, files[k :: len(parts)], folders)) for k, part in enumerate(parts)]
        for child in children:
            os.waitpid(child, 0)
        seconds, tests = {}, defaultdict(list)
        for part in parts:
            own_seconds, own_tests = json.loads(part.read_text(encoding="utf-8"))
            seconds |= own_seconds
            for place, names in own_tests.items():
                tests[place] += names
            part.unlink()
        kept.write_text(json.dumps([seconds, tests]), encoding="utf-8")
    return json.loads(kept.read_text(encoding="utf-8"))


def _noted(part, files, folders):
    os.chdir(planting.ROOT)
    calls = Calls(folders)
    pytest.main([*OPTIONS, *files], plugins=[calls])
    part.write_text(json.dumps([calls.seconds, calls.tests]), encoding="utf-8")


def in_child(act):
    """Return the number of a process of its own, in a session of its own, that does something and ends with the status it gives."""
    child = os.fork()
    if not child:
        status = 1
        try:
            os.setsid()
            status = int(act() or 0)
        except BaseException:  # noqa: BLE001
            traceback.print_exc()
        finally:  # whatever happens, it must not go on as its parent
            os._exit(status)
    return child

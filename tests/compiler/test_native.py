"""Object files of machine code: read by a later process that needs no compiler, and never where anything that decides them differs."""

import gc
import json
import os
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from itertools import count

import numpy as np
import pytest
from refusals import refused

import daebench
from daebench.compiler import entry, machine, native, sealed
from daebench.compiler.cache import RECORDED, generated
from daebench.compiler.sealed import CacheWarning
from daebench.compiler.trace.program import LONG
from daebench.compiler.under_way import uncollected
from daebench.errors import RunFailed
from daebench.methods import plan

_count = count()

RUN = """
import json, sys
import daebench
run = daebench.run("planar_pendulum", method="rattle", h=0.01, steps=100)
needed = ("sympy", "daebench.compiler.trace.ir", "daebench.compiler.print.llvm")
print(json.dumps([run.q.tobytes().hex(), [name for name in needed if name in sys.modules]]))
"""


def in_a_process(folder, program=RUN):
    return subprocess.Popen(
        [sys.executable, "-c", program],
        env=os.environ | {"DAEBENCH_CACHE": str(folder)},
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )


def said(process):
    out, err = process.communicate()
    assert (process.returncode, err) == (0, "")
    return json.loads(out)


def test_processes_that_begin_at_once_agree_and_a_later_one_reads_object_files_and_imports_no_compiler(tmp_path):
    running = [in_a_process(tmp_path) for _ in range(2)]
    with ThreadPoolExecutor(2) as pool:
        (first, imported), (second, besides) = pool.map(said, running)
    assert first == second
    assert "daebench.compiler.trace.ir" in imported + besides  # where one is much quicker, the other reads what it has made
    files = {path: path.stat().st_mtime_ns for path in tmp_path.glob("*.o")}
    assert {path.name.split(".")[1] for path in files} == {"integrate", "first"}
    assert said(in_a_process(tmp_path)) == [first, []]
    assert {path: path.stat().st_mtime_ns for path in tmp_path.glob("*.o")} == files
    assert np.frombuffer(bytes.fromhex(first)).size > 100
    assert [path for path in tmp_path.iterdir() if path.suffix == ".tmp"] == []


def module(text):
    """Return the root function of a text as machine code in a module of its own."""
    source = f'"""A module."""\n\nNATIVE = ("root",)\n{RECORDED.lstrip()}\n\n{text}\n'
    return generated("own", f"{text} {next(_count)}", lambda: source).root


def cube(key):
    """Return x^3 + k x as machine code."""
    return module(f"def root(x):\n    return x**3 + {key} * x")


@pytest.fixture
def kept(tmp_path, monkeypatch):
    monkeypatch.setenv("DAEBENCH_CACHE", str(tmp_path))
    sealed.warn.cache_clear()
    return tmp_path


def compilations(monkeypatch):
    """Return a list to which each compilation adds."""
    made, compiled = [], native._Function._compiled

    def noted(self, form, letters):
        made.append(form)
        return compiled(self, form, letters)

    monkeypatch.setattr(native._Function, "_compiled", noted)
    return made


def again(root):
    """Return the same function as a later process has it: nothing of it is in memory."""
    return native.Native(root._function._module, root._function._source, root._function._name, cached=True)


CHANGES = {
    "a feature less": lambda features, cpu: (dict(list(features.items())[1:]), cpu),
    "another feature": lambda features, cpu: ({**features, "avx9000f": True}, cpu),
    "a feature off": lambda features, cpu: ({name: there and name != "sse2" for name, there in features.items()}, cpu),
    "another processor": lambda features, cpu: (features, f"{cpu}x"),
}


@pytest.mark.parametrize("change", CHANGES)
def test_a_file_of_another_processor_is_not_loaded(kept, monkeypatch, change):
    root = cube(2)
    assert root(2.0) == 12.0
    made = compilations(monkeypatch)
    assert (again(root)(2.0), len(made)) == (12.0, 0)
    features, cpu = CHANGES[change](dict(machine.llvm.get_host_cpu_features()), machine.llvm.get_host_cpu_name())
    forged = type(machine.llvm.get_host_cpu_features())(features)
    with monkeypatch.context() as patch:
        patch.setattr(machine.llvm, "get_host_cpu_features", lambda: forged)
        patch.setattr(machine.llvm, "get_host_cpu_name", lambda: cpu)
        there = machine.machine.__wrapped__()
    monkeypatch.setattr(machine, "machine", lambda: there)
    assert (again(root)(2.0), len(made)) == (12.0, 1)
    assert len(list(kept.glob("*.o"))) == 2


def test_new_arrays_that_need_more_memory_than_there_is_are_told_of(monkeypatch):
    text = "def root(a, n):\n    b = 2.0 * a\n    for k in range(n):\n        c = b + a\n        b = c - 1.0\n    return b"
    root, a = module(text), np.ones(1000)
    assert root(a, 10**5)[0] == 2.0  # memory is given back after each turn
    monkeypatch.setattr(entry, "LEAST", 2**13)
    monkeypatch.setattr(entry, "PARTS", 3)
    monkeypatch.setattr(entry, "_memories", type(entry._memories)())
    with refused("step-arrays-exceed-memory", kind=RunFailed):
        root(a, 10)


def test_a_loop_gives_back_what_a_long_function_allocates_that_an_earlier_loop_has_called(monkeypatch):
    long = f"def long(a):\n    # {'.' * LONG}\n" + "    a = a + 1.0\n    a = a - 1.0\n" * 16 + "    return a\n"
    loops = "".join(f"    for {k} in range(n):\n        total = total + long(a)[0]\n" for k in "ijk")
    root, a = module(f"{long}\n\ndef root(a, n):\n    total = 0.0\n{loops}    return total"), np.ones(1000)
    monkeypatch.setattr(entry, "LEAST", 2**21)
    monkeypatch.setattr(entry, "_memories", type(entry._memories)())
    assert root(a, 100) == 300.0


def test_each_call_has_memory_for_its_own_arrays(monkeypatch):
    root = module("def root(a):\n    return 2.0 * a")
    monkeypatch.setattr(entry, "LEAST", 2**10)
    monkeypatch.setattr(entry, "_memories", type(entry._memories)())
    for n in (10, 10**5, 10):
        a = np.arange(float(n))
        assert np.array_equal(root(a), 2.0 * a)
        assert np.array_equal(root.timed((a,))[0], 2.0 * a)


def test_garbage_is_collected_again_after_a_block_that_fails():
    def failing():
        with uncollected():
            collecting.append(gc.isenabled())
            raise KeyError

    collecting = []
    with pytest.raises(KeyError):
        failing()
    assert collecting == [False]
    assert gc.isenabled()


def begin_anew(monkeypatch, folder):
    """Forget generated modules, what is known of this computer, and what was said."""
    monkeypatch.setenv("DAEBENCH_CACHE", str(folder))
    monkeypatch.setattr(plan, "_plans", {})
    native.no_machine_code.cache_clear()
    sealed.warn.cache_clear()
    for name in [name for name in sys.modules if name.startswith("daebench_generated_")]:
        monkeypatch.delitem(sys.modules, name)


@pytest.fixture
def no_target(monkeypatch, tmp_path):
    """A computer for which LLVM has no target."""

    def missing():
        raise RuntimeError("No available targets are compatible with triple m68k-unknown-elf")

    begin_anew(monkeypatch, tmp_path / "python")
    monkeypatch.setattr(machine, "session", missing)
    yield
    native.no_machine_code.cache_clear()


SLOWER = (
    r"machine code cannot be made here \(RuntimeError: No available targets.*\); functions run as Python, a hundred to five hundred times"
)


@pytest.mark.parametrize("method", ["rattle", "ida:index2"])
def test_where_there_is_no_machine_code_methods_run_as_python_and_it_is_said(no_target, method):
    how = {"h": 0.01, "t_end": 0.1} if ":" not in method else {"tol": 1e-8, "t_end": 0.1}
    with pytest.warns(CacheWarning, match=SLOWER) as said:
        slow = daebench.run("double_pendulum", method=method, **how)
    assert len(said) == 1
    assert slow.failure is None


def test_what_only_machine_code_has_is_refused_in_a_sentence(no_target):
    said = r"^rattle on spherical_pendulum, dual.* needs machine code, which cannot be made here \(RuntimeError: No available"
    with pytest.warns(CacheWarning, match=SLOWER), pytest.raises(native.NoMachineCode, match=said):
        daebench.run("spherical_pendulum", method="rattle", h=0.01, steps=2, sensitivities=["gravity"])


def test_python_gives_what_machine_code_does(no_target, monkeypatch, tmp_path):
    with pytest.warns(CacheWarning, match=SLOWER):
        slow = daebench.run("spherical_pendulum", method="lobatto4", h=0.01, steps=20)
    monkeypatch.undo()
    begin_anew(monkeypatch, tmp_path / "machine")
    assert native.no_machine_code() == ""
    made = compilations(monkeypatch)
    fast = daebench.run("spherical_pendulum", method="lobatto4", h=0.01, steps=20)
    assert made
    assert np.array_equal(slow.q, fast.q)

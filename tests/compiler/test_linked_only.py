"""Functions that are only linked into their callers have no machine code of their own, and give the same numbers."""

import os
import subprocess
import sys

import numba
import numpy as np

from daebench.compiler.linked_only import linked_only


def squared(x):
    return x * x


def test_its_callers_give_the_same_numbers_and_it_has_no_address():
    inner = linked_only(squared)

    @numba.njit
    def outer(x):
        return inner(x) + inner(x + 1.0)

    assert outer(3.0) == squared(3.0) + squared(4.0)
    (made,) = inner.overloads.values()
    assert made.library.get_pointer_to_function(made.fndesc.llvm_func_name) == 0
    (called,) = outer.overloads.values()
    assert called.library.get_pointer_to_function(called.fndesc.llvm_func_name) != 0


def test_its_caller_can_be_stored_and_read_by_another_process(tmp_path):
    text = (
        "from daebench.methods.initial_value_problem import initial_value_problem\n"
        "from daebench.methods.names import parse\n"
        "from daebench.runs.request import Request\n"
        "run = parse('rattle').solve(initial_value_problem('planar_pendulum'), Request(value=0.01, steps=100))\n"
        "print(run.q.tobytes().hex())\n"
    )
    environment = os.environ | {"DAEBENCH_CACHE": str(tmp_path)}
    command, outputs, stored = [sys.executable, "-c", text], [], []
    for _ in range(2):
        outputs.append(subprocess.run(command, env=environment, capture_output=True, text=True, check=True).stdout)
        stored.append({path: path.stat().st_mtime_ns for path in tmp_path.glob("*.code")})
    assert outputs[0] == outputs[1]
    assert stored[0]
    assert stored[0] == stored[1]
    assert np.frombuffer(bytes.fromhex(outputs[0].strip())).size > 100

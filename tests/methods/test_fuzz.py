"""Nothing that is typed and nothing that is in a problem file brings a traceback, a hang, or NaN as success."""

import json
import math

import pytest
from fuzzed import called, command_lines, commands, problem_files, require_well_ended
from hypothesis import HealthCheck, Phase, given, settings
from hypothesis import strategies as st

from daebench.studies import ensemble_timing, gradient_timing, solver_timing

EXAMPLES = 300
"""In the gate, command lines and problem files together; ten times as many where it is exhaustive."""

FILES = 120
QUIET = {"deadline": None, "derandomize": True, "database": None, "suppress_health_check": list(HealthCheck)}
QUIET["phases"] = (Phase.explicit, Phase.generate, Phase.shrink)
NAMES = sorted(commands())
SHARE = -(-(EXAMPLES - FILES) // len(NAMES))


@pytest.fixture
def short(folder, uncompiled_schemes, plain_functions, references, monkeypatch):
    """A folder with problem files and a table, where schemes and equations run as Python: most calls are too short to compile for.

    What ``bench`` times with ``--ensemble``, ``--gradients`` and ``--solvers`` are compiled, which is left out.
    """
    monkeypatch.setattr(gradient_timing, "_row", lambda settings, *_: {"problem": settings["problem"]})
    monkeypatch.setattr(solver_timing, "measure_solvers", lambda **_: [{"tol": 1e-6}])
    monkeypatch.setattr(ensemble_timing, "_row", lambda problem, *_, **__: {"problem": problem})
    monkeypatch.setattr(ensemble_timing, "measure_heyoka", lambda **_: None)
    monkeypatch.setattr(ensemble_timing, "measure_narrow", lambda **_: None)
    (folder / "rows.csv").write_text("t,q1,q2,p1,p2\n0,1,0,0,0\n")
    return folder


def require_words(words):
    status, out, err = called(*words)
    require_well_ended(words, status, out, err)
    if status == 0 and "--json" in words and words[0] == "run":
        found = json.loads(out)
        assert found["failure"] is None, words
        assert all(math.isfinite(x) for x in found.get("q", found.get("y"))), words


def require_file(short, kind, text):
    (short / "mine.py").write_text(text, encoding="utf-8", errors="surrogateescape")
    method = ["midpoint", "--anyway"] if kind == "species" else ["rattle"]
    for words in (["check", "./mine.py"], ["run", "./mine.py", "--h", "0.01", "--steps", "2", "--json", "--method", *method]):
        status, out, err = called(*words)
        require_well_ended((words, text), status, out, err)
        if status == 0 and words[0] == "run":
            found = json.loads(out)
            assert found["failure"] is None
            assert all(x is not None and math.isfinite(x) for x in [*found.get("q", found.get("y")), found["energy"]]), text


@pytest.mark.parametrize("name", NAMES)
def test_no_command_line_brings_a_traceback(short, name):
    settings(max_examples=SHARE, **QUIET)(given(command_lines(name))(require_words))()


@pytest.mark.parametrize("part", [0, *(pytest.param(k, marks=[pytest.mark.slow, pytest.mark.exhaustive]) for k in (1, 2, 3))])
def test_no_problem_file_brings_a_traceback(short, part):
    tried = given(st.just(part), problem_files())(lambda _, each: require_file(short, *each))
    settings(max_examples=FILES // 4, **QUIET)(tried)()


@pytest.mark.slow
@pytest.mark.exhaustive
@pytest.mark.parametrize("name", NAMES)
def test_no_command_line_of_many_brings_a_traceback(short, name):
    settings(max_examples=10 * SHARE, **QUIET)(given(command_lines(name))(require_words))()


@pytest.mark.slow
@pytest.mark.exhaustive
def test_no_problem_file_of_many_brings_a_traceback(short):
    settings(max_examples=10 * FILES, **QUIET)(given(problem_files())(lambda each: require_file(short, *each)))()

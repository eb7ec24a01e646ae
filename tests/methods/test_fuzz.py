"""Nothing that is typed and nothing that is in a problem file brings a traceback, a hang, or NaN as success."""

import json
import math

import planting
import pytest
from fuzzed import called, command_lines, commands, problem_files, require_well_ended
from hypothesis import HealthCheck, Phase, given, settings

from daebench.studies import ensemble_timing, gradient_timing, solver_timing

FILES, LINES = 6, 4
"""Examples in the gate, of problem files and of the command lines of one command; very many more where it is exhaustive."""

COMMANDS = 4
"""Commands that the gate tries: other ones for each tree."""

LONG = ("advise", "check")
"""Commands whose calls take seconds each."""

QUIET = {"deadline": None, "derandomize": True, "database": None, "suppress_health_check": list(HealthCheck)}
QUIET["phases"] = (Phase.explicit, Phase.generate, Phase.shrink)
NAMES = sorted(commands())
DRAWN = planting.drawn(NAMES, planting.digest(), COMMANDS)


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


@pytest.mark.sampled(by=lambda case: case in DRAWN)
@pytest.mark.parametrize("name", NAMES)
def test_no_command_line_brings_a_traceback(short, name):
    settings(max_examples=1 if name in LONG else LINES, **QUIET)(given(command_lines(name))(require_words))()


@pytest.mark.exhaustive
@pytest.mark.parametrize("name", NAMES)
def test_no_command_line_of_many_brings_a_traceback(short, name):
    settings(max_examples=60, **QUIET)(given(command_lines(name))(require_words))()


@pytest.mark.parametrize("examples", [FILES, pytest.param(200 * FILES, marks=pytest.mark.exhaustive)])
def test_no_problem_file_brings_a_traceback(short, examples):
    settings(max_examples=examples, **QUIET)(given(problem_files())(lambda each: require_file(short, *each)))()

"""Methods from outside: a callable, a library and a program are run and monitored like a method of daebench."""

import json
import sys
import textwrap

import numpy as np
import pytest
from measures import error_of
from outside_code import BALL, run, script
from refusals import refused

import daebench as package
from daebench.errors import BadInput, LostMotion
from daebench.methods import names
from daebench.methods.names import parse


@pytest.mark.parametrize("name", ["step", "solve", "Counting", "counting"])
def test_a_callable_of_a_file_does_what_rattle_does(mine, name):
    own, theirs = run("rattle", every=10, steps=100, t_end=None), run(f"./mine.py:{name}", every=10, steps=100, t_end=None)
    assert (theirs.method, theirs.steps, theirs.work) == (f"./mine.py:{name}", 100, {})
    assert np.array_equal(theirs.t, own.t)
    assert np.allclose(theirs.q, own.q, rtol=0, atol=1e-14)
    assert np.allclose(theirs.p, own.p, rtol=0, atol=1e-14)
    assert theirs.maxima_over == ("outputs" if name == "solve" else "steps")
    if name != "solve":
        assert theirs.maxima["energy"] == pytest.approx(own.maxima["energy"], rel=1e-6)
        assert theirs.maxima["g"] < 1e-14


def test_a_memory_begins_anew_with_each_run(mine):
    ends = [run("./mine.py:counting", steps=150, t_end=None).q[-1] for _ in range(2)]
    assert np.array_equal(*ends)
    assert np.array_equal(ends[0], run("./mine.py:step", steps=100, t_end=None).q[-1])


def test_a_library_does_what_rattle_does(library, plain_functions):
    own, theirs = run("rattle", every=10), run(f"{library}:step", every=10)
    assert np.allclose(theirs.q, own.q, rtol=0, atol=1e-14)
    assert theirs.steps == 200
    assert theirs.maxima["energy"] == pytest.approx(own.maxima["energy"], rel=1e-6)
    heavy = {"mass": 2.0, "gravity": 3.0}
    own, theirs = (run(name, parameters=heavy, every=0) for name in ("rattle", f"{library}:step"))
    assert np.allclose(theirs.q[-1], own.q[-1], rtol=0, atol=1e-13)


def test_functions_of_a_library_call_each_other_and_not_that_of_the_same_name_in_the_c_library(library):
    twice, halved = run(f"{library}:twice", steps=5, t_end=None), run(f"{library}:step", h=0.005, steps=10, every=2, t_end=None)
    assert np.array_equal(twice.q, halved.q)


def test_a_program_does_what_rattle_does(program):
    own, theirs = run("rattle", every=7), run(f"exec:{program}", every=7)
    assert np.array_equal(theirs.t, own.t)
    assert np.allclose(theirs.q, own.q, rtol=0, atol=1e-14)
    assert 0 < theirs.seconds < 60
    assert theirs.maxima_over == "outputs"


def test_a_callable_itself_is_a_method():
    def still(p, q, h):
        return p, q

    found = package.run("double_pendulum", method=still, h=0.1, t_end=1.0)
    assert found.method.endswith("still")
    assert found.maxima == {"energy": 0.0, "g": 0.0, "Gv": 0.0}
    assert np.array_equal(package.run("lotka_volterra", method=lambda y, h: y, h=0.1, t_end=1.0).y[0], [4.0, 2.0])


def test_a_poisson_system_takes_steps_of_y(mine, library):
    found = package.run("free_rigid_body", method="./mine.py:of_poisson", h=0.1, t_end=1.0)
    assert found.maxima["energy"] == 0
    with pytest.warns(LostMotion, match="the motion is lost"):
        grown = package.run("free_rigid_body", method=f"{library}:doubles", h=0.1, steps=3)
    assert grown.y[-1, 0] == 8 * grown.y[0, 0]


def test_code_from_outside_stands_beside_methods_of_daebench(mine, daebench):
    words = ("compare", BALL["problem"], "--case", BALL["case"], "--methods", "rattle,./mine.py:step", "--h", 0.02, "--t-end", 1, "--json")
    status, out, err = daebench(*words)
    rows = json.loads(out)["rows"]
    assert (status, [row["method"] for row in rows]) == (0, ["rattle", "./mine.py:step"]), err
    assert rows[1]["energy_error"] == pytest.approx(rows[0]["energy_error"], rel=1e-4)
    assert rows[1]["position_error"] == pytest.approx(rows[0]["position_error"], rel=1e-4)


@pytest.mark.parametrize("command", ["bench", "precision"])
def test_commands_on_the_arithmetic_of_daebench_refuse_it_and_do_not_execute_it(folder, daebench, command):
    (folder / "mine.py").write_text("raise SystemExit(5)\n")
    words = {
        "bench": ("--problem", "spherical_pendulum", "--methods", "./mine.py:step"),
        "precision": ("spherical_pendulum", "--methods", "rattle,./mine.py:step"),
    }
    status, out, err = daebench(command, *words[command])
    assert (status, out, err.count("\n")) == (2, "", 1)
    assert "./mine.py:step is from outside" in err


def test_content_is_that_of_the_file_and_what_it_imports_wherever_they_are(folder):
    def content(place, text):
        (folder / place).mkdir(exist_ok=True)
        (folder / place / "mine.py").write_text("from helper import step\n")
        (folder / place / "helper.py").write_text(text)
        return parse(f"{folder / place}/mine.py:step").content

    text = "def step(p, q, h):\n    return p, q\n"
    first = content("one", text)
    assert content("two", text) == first
    assert content("one", text + "# another\n") != first


def test_code_from_outside_is_not_executed_to_see_which_kind_of_problem_it_is_for(mine, monkeypatch):
    monkeypatch.setattr(names, "_known", lambda kind, name: pytest.fail(f"{name} was looked for"))
    for problem in ("spherical_pendulum", "free_rigid_body"):
        ivp = package.initial_value_problem(problem)
        assert names.method_of(ivp, "./mine.py:step").name == "./mine.py:step"
        assert [method.name for method in names.methods_of(ivp, ["./mine.py:step"])] == ["./mine.py:step"]


def test_the_program_is_told_what_is_asked(folder):
    asked = folder / "asked.json"
    run(script(folder, f"cat > {asked}"), every=5, parameters={"mass": 2.0})
    about = json.loads(asked.read_text())
    assert (about["problem"], about["case"], about["h"], about["steps"], about["every"]) == ("spherical_pendulum", "fig1.1", 0.01, 200, 5)
    assert list(about["parameters"].items()) == [("mass", 2.0), ("length", 1.0), ("gravity", 1.0)]
    assert [len(about[name]) for name in ("p", "q")] == [3, 3]


ADAPTIVE = """
    import numpy as np
    from scipy.integrate import solve_ivp

    def solve(p, q, tol, t):
        def rate(s, x):
            lam = (x[:3] @ x[:3] - x[5]) / (x[3:] @ x[3:])
            return np.concatenate([[0, 0, -1.0] - lam * x[3:], x[:3]])
        known = solve_ivp(rate, (0, t[-1]), np.concatenate([p, q]), method="DOP853", rtol=tol, atol=tol, t_eval=t)
        return known.y.T[:, :3], known.y.T[:, 3:]

    solve.knob = "tol"

    def step(p, q, h):
        return p, q

    step.knob = "tol"

    def odd(p, q, h):
        return p, q

    odd.knob = 3
"""


@pytest.fixture
def adaptive(folder):
    (folder / "adaptive.py").write_text(textwrap.dedent(ADAPTIVE))
    return folder


@pytest.mark.sampled(left_out=("callable",))
@pytest.mark.parametrize("place", ["file", "callable"])
def test_code_that_chooses_its_own_steps_is_given_the_tolerance(adaptive, place, plain_functions):
    name = "./adaptive.py:solve"
    if place == "callable":
        space = {}
        exec(textwrap.dedent(ADAPTIVE), space)
        name = space["solve"]
    loose, tight, other = (run(x, h=None, tol=tol, points=21) for x, tol in ((name, 1e-4), (name, 1e-9), ("scipy:DOP853", 1e-9)))
    assert (loose.knob, loose.value, tight.value, loose.maxima_over) == ("tol", 1e-4, 1e-9, "outputs")
    assert np.array_equal(tight.t, other.t)
    assert error_of(tight.q, other.q) < 1e-7 < error_of(loose.q, other.q)


def test_a_tolerance_of_own_code_is_refused_where_steps_are_needed(adaptive, plain_functions):
    for call in (
        lambda: run("./adaptive.py:solve"),
        lambda: run("./adaptive.py:solve", h=None, tol=1e-8, t_end=None, steps=5),
        lambda: package.check("planar_pendulum", method="./adaptive.py:solve"),
        lambda: run("./adaptive.py:step", h=None, tol=1e-8),
        lambda: run("./adaptive.py:odd"),
    ):
        with pytest.raises(BadInput, match=r"adaptive\.py"):
            call()


WRITING = """#!{python}
import json, sys
import numpy as np
sys.path.insert(0, {folder!r})
from mine import step
asked = json.loads(sys.stdin.readline())
p, q = np.array(asked["p"]), np.array(asked["q"])
style = sys.argv[1]
def write():
    if style.startswith("nested"):
        print(json.dumps([list(p), list(q)]))
    elif style.startswith("list"):
        print(json.dumps([*p, *q]))
    else:
        print(*p, *q)
if style.endswith("start"):
    write()
for k in range(asked["steps"]):
    if not style.startswith("still"):
        p, q = step(p, q, asked["h"])
    if asked["every"] and (k + 1) % asked["every"] == 0 or k + 1 == asked["steps"]:
        write()
print(json.dumps(dict(seconds=0.5)))
"""


@pytest.mark.sampled(left_out=("numbers", "nested"))
@pytest.mark.parametrize("style", ["numbers", "list-start", "nested"])
def test_a_program_may_write_lists_and_its_start_and_be_given_as_words(mine, style):
    path = mine / "writing program"
    path.write_text(WRITING.format(python=sys.executable, folder=str(mine)))
    path.chmod(0o755)
    own, theirs = run("rattle", every=3), run([str(path), style], every=3)
    assert theirs.method == f"exec:'{path}' {style}"
    assert np.array_equal(theirs.t, own.t)
    assert np.allclose(theirs.q, own.q, rtol=0, atol=1e-14)
    assert theirs.failure is None
    last = run(f"exec:'{path}' {style}", every=0)
    assert np.array_equal(last.q[-1], theirs.q[-1])


@pytest.mark.filterwarnings("ignore::daebench.errors.LostMotion")
def test_a_program_that_stays_at_its_start_has_all_its_states(mine):
    path = mine / "writing"
    path.write_text(WRITING.format(python=sys.executable, folder=str(mine)))
    path.chmod(0o755)
    for style in ("still", "still-start"):
        found = run(["exec:" + str(path), style], steps=7, t_end=None)
        assert (found.steps, found.failure) == (7, None)
        assert np.array_equal(found.q, np.tile(found.q[0], (8, 1)))


def test_an_empty_list_of_words_is_no_program():
    with refused("program-list-malformed"):
        run([])

"""What goes wrong with code from outside is one sentence, and the states before it are kept."""

import json
import signal
import time
import types
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from outside_code import BALL, RATTLE, run, script
from refusals import refused

import daebench as package
from daebench.errors import BadInput, RunFailed
from daebench.methods.names import parse
from daebench.methods.outside import call, callables, ending
from daebench.methods.outside.callables import method_of_callable
from daebench.runs.request import Request


@pytest.mark.parametrize(
    ("method", "code"),
    [
        ("./mine.py:in_place", "code-changes-arguments"),
        ("./mine.py:one", "state-not-arrays"),
        ("./mine.py:of_poisson", "step-argument-count"),
        ("./mine.py:calls", "code-not-a-method"),
        ("./mine.py:nothing", "file-lacks-function"),
        ("./mine.py:", "function-name-malformed"),
        ("./other.py:step", "no-such-file-or-name"),
        ("./mine.so:step", "no-such-file-or-name"),
        ("exec:./nothing", "exec-no-such-program"),
        ("exec:'", "exec-words-malformed"),
    ],
)
def test_what_is_no_method_is_refused(mine, method, code):
    with refused(code):
        run(method)


def test_a_library_without_the_function_is_refused(library, mine):
    with refused("library-lacks-function"):
        run(f"{library}:nothing")
    (mine / "text.so").write_text("no library")
    with refused("library-not-loadable"):
        run("./text.so:step")


def test_what_code_from_outside_cannot_do_is_refused(mine):
    for settings in (
        {"precision": "float32"},
        {"raw": True},
        {"compensated": True},
        {"options": {"alpha": 1.0}},
        {"tol": 1e-3, "h": None},
    ):
        with pytest.raises(BadInput, match=r"mine\.py:step"):
            package.run(**{"problem": "spherical_pendulum", "method": "./mine.py:step", "h": 0.1, "t_end": 1.0} | settings)


@pytest.mark.parametrize(
    ("name", "steps", "words"),
    [
        ("fails", 7, "line 42: ZeroDivisionError"),
        ("blows_up", 0, "H"),
        ("spoils", 0, "value"),
        ("shrinks", 5, "(3,) and (2,)"),
        ("forgets", 5, "arguments"),
    ],
)
def test_a_run_that_stops_has_its_states_so_far_and_the_reason(mine, name, steps, words):
    with np.errstate(all="ignore"):
        found = run(f"./mine.py:{name}")
    assert (found.steps, len(found.t)) == (steps, steps + 1)
    assert np.isfinite(found.p).all()
    assert words in found.failure
    assert f"(step {steps + 1} of 200, h = 0.01)" in found.failure
    if steps == 5:
        assert np.allclose(found.p[:, 0], 0.06 + 0.01 * np.arange(6), rtol=0, atol=1e-15)


def test_a_status_of_a_library_stops_the_run(library):
    assert run(f"{library}:gives_up").failure is None
    low = package.run("spherical_pendulum", case="fig1.1", q0=[0, 0, -1.0], p0=[0.1, 0, 0], method=f"{library}:gives_up", h=0.01, t_end=1)
    assert (low.steps, "returned 7 instead of 0" in low.failure) == (0, True)


def test_a_program_whose_first_line_is_no_state_is_refused(folder):
    for text in ("echo hello", "echo 1 2 3", "head -c 1000000 /dev/zero"):
        with refused("program-output-faulty") as error:
            run(script(folder, text))
        assert len(str(error.value)) < 2100


def test_the_command_ends_code_that_hangs_at_the_limit(mine, daebench):
    words = ("run", BALL["problem"], "--case", BALL["case"], "--h", 0.01, "--t-end", 1, "--method", "./mine.py:hangs")
    status, out, err = daebench(*words, "--seconds-limit", 0.3, "--json")
    assert (status, json.loads(out)["steps"], err) == (1, 5, "")
    assert "0.3 s" in json.loads(out)["failure"]


def test_what_a_program_wrote_before_it_went_wrong_is_kept(folder):
    for text, states, sentence in [
        ("exit 3", 0, "after 0 of 200 states: it exited with status 3."),
        ("echo some trouble >&2; exit 1", 0, "it exited with status 1: some trouble."),
        ("kill -9 $$", 0, "signal SIGKILL (killed, as the system does where memory runs out)"),
        ("yes 1 2 3 4 5 6 | head -3", 3, "after 3 of 200 states: it exited with status 0."),
        ("yes 1 2 3 4 5 6 | head -5; echo hello", 5, "stopped after t = 0.05 (step 5 of 200, h = 0.01): the program writes 'hello'"),
        ("yes 1 2 3 4 5 6 | head -5; echo 1 2", 5, "writes 2 numbers in a line, '1 2'; a state has 6."),
        ("yes 1 2 3 4 5 6 | head -5; echo '{\"seconds\": 1}'", 5, "the program ended after 5 of 200 states."),
        ("yes 1 2 3 4 5 6 | head -200", 200, "it must write its seconds"),
        ("yes 1 2 3 4 5 6", 200, "it must write its seconds"),
        ("yes 1 2 3 4 5 6 | head -200; echo '{\"seconds\": -1}'", 200, "it must write its seconds"),
        ("yes 1 2 3 4 5 6 | head -200; echo '{\"seconds\": 1}'; echo more", 200, "that line must be the last"),
        ("yes 1 2 3 4 5 6 | head -5; sleep 60", 5, "the limit of 0.5 s is reached; allow more time, or check whether the code hangs."),
    ]:
        found = run(script(folder, text), seconds_limit=0.5)
        assert sentence in found.failure
        assert (found.steps, len(found.t)) == (states, states + 1)
        assert np.array_equal(found.p[1:], np.tile([1.0, 2.0, 3.0], (states, 1)))


def _line(end):
    """Return the number of the one line of the file that ends so."""
    (number,) = (number for number, line in enumerate(RATTLE.splitlines(), start=1) if line.endswith(end))
    return number


@pytest.mark.parametrize(("name", "steps"), [("hangs", 5), ("Hanging", 0)])
def test_a_callable_that_hangs_is_ended_at_the_limit_and_its_line_is_named(mine, name, steps):
    found = run(f"./mine.py:{name}", seconds_limit=0.3)
    assert f"./mine.py:{name}, line {_line(f'# {name}')}: the limit of 0.3 s" in found.failure
    assert (found.steps, len(found.t)) == (steps, steps + 1)
    assert signal.getitimer(signal.ITIMER_REAL) == (0.0, 0.0)


def test_without_a_limit_code_that_gives_no_state_for_long_is_ended(mine, library, folder, monkeypatch):
    monkeypatch.setattr(ending, "SILENCE", 0.3)
    for method in ("./mine.py:hangs", f"{library}:hangs", script(folder, "sleep 60")):
        assert "the code has given no state for 0.3 s; check whether it hangs" in run(method).failure


def test_a_library_that_hangs_is_left_and_keeps_its_states(library):
    found = run(f"{library}:hangs", seconds_limit=0.3)
    assert "stopped at t = 0.04 (step 5 of 200, h = 0.01): the limit of 0.3 s is reached" in found.failure
    assert np.allclose(found.p[:, 0], 0.06 + 0.01 * np.arange(5), rtol=0, atol=1e-15)


def test_a_timer_that_was_set_before_goes_on_afterwards():
    def hangs(p, q, h):
        while True:
            pass

    rung = []
    before = signal.signal(signal.SIGALRM, lambda *_: rung.append(1))
    signal.setitimer(signal.ITIMER_REAL, 0.5)
    try:
        assert "the limit of 0.2 s" in run(hangs, seconds_limit=0.2).failure
        assert 0 < signal.getitimer(signal.ITIMER_REAL)[0] < 0.5
        time.sleep(0.6)
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, before)
    assert rung == [1]


def test_the_limit_ends_what_is_slow_beside_the_main_thread_too():
    def slow(p, q, h):
        time.sleep(0.02)
        return p, q

    with ThreadPoolExecutor(1) as pool:
        found = pool.submit(run, slow, seconds_limit=0.1).result()
    assert "the limit of 0.1 s is reached" in found.failure
    assert 0 < found.steps < 200


def test_an_interruption_keeps_the_states_where_they_are_asked_for(library):
    def interrupted(p, q, h):
        if p[0] > 0.105:
            raise KeyboardInterrupt
        return p + np.array([h, 0, 0]), q

    run(f"{library}:step")  # compiled before the timer is set
    before = signal.signal(signal.SIGALRM, signal.default_int_handler)
    for method, steps in ((interrupted, 5), (f"{library}:hangs", 4)):
        signal.setitimer(signal.ITIMER_REAL, 1.0 if steps == 4 else 0.0)
        found = run(method)
        assert (found.interrupted, found.steps, len(found.t)) == (True, steps, steps + 1)
        assert found.failure.endswith(f"stopped at t = {steps / 100} (step {steps + 1} of 200, h = 0.01): interrupted.")
    signal.signal(signal.SIGALRM, before)
    ivp = package.initial_value_problem(BALL["problem"], BALL["case"])
    with pytest.raises(KeyboardInterrupt):
        method_of_callable(interrupted).solve(ivp, Request(value=0.01, steps=200))


def test_a_state_of_complex_numbers_is_refused_in_words():
    with refused("state-complex"):
        run(lambda p, q, h: (p + 0j, q))


def test_arguments_are_copies(mine):
    def solve(p, q, h, t):
        p += 1.0
        return np.tile(p, (len(t), 1)), np.tile(q, (len(t), 1))

    ivp = package.initial_value_problem(BALL["problem"], BALL["case"])
    start = ivp.p0.copy()
    assert np.array_equal(method_of_callable(solve).solve(ivp, Request(value=0.01, steps=3)).p[0], start)


@pytest.mark.parametrize("kind", [float, complex])
def test_what_a_file_prints_goes_to_standard_error(mine, capfd, kind):
    ivp = package.initial_value_problem(BALL["problem"], BALL["case"])
    parse("./mine.py:prints").flow(ivp, 0.01, 2)(ivp.p0.astype(kind), ivp.q0.astype(kind))
    out, err = capfd.readouterr()
    assert (out, err) == ("", "a step\na step\n")


def test_a_map_of_code_that_fails_says_so_of_real_states_and_raises_it_of_complex_ones(mine, library):
    ivp = package.initial_value_problem(BALL["problem"], BALL["case"])
    p, q = np.array([0.2, 0.0, 0.0]), np.array([0.0, 0.0, -1.0])
    raises = f"./mine.py:raises, line {_line('# raises')}: ValueError: no root"
    for name, words in ((f"{library}:gives_up", "returned 7"), ("./mine.py:raises", raises)):
        with pytest.raises(RunFailed, match=words):
            parse(name).flow(ivp, 0.01, 3)(p, q)
    with pytest.raises(ValueError, match="no root"):
        parse("./mine.py:raises").flow(ivp, 0.01, 3)(p + 0j, q)


def test_seconds_are_those_of_the_code_alone(monkeypatch):
    """A step takes a second of this clock, and what is done around it, such as the look at what it returns, a hundred."""
    clock = types.SimpleNamespace(now=0.0, perf_counter=lambda: clock.now)
    look = call.external_state

    def looked(*arguments):
        clock.now += 100.0
        return look(*arguments)

    def step(p, q, h):
        clock.now += 1.0
        return p, q

    def solve(p, q, h, t):
        clock.now += 7.0
        return np.tile(p, (len(t), 1)), np.tile(q, (len(t), 1))

    monkeypatch.setattr(call, "time", clock)
    monkeypatch.setattr(call, "external_state", looked)
    assert run(step).seconds == 200.0
    monkeypatch.setattr(callables, "CHUNK_SECONDS", 0.0)  # a block for each step
    assert run(step).seconds == 200.0
    assert run(solve).seconds == 7.0

"""Methods from outside: a callable, a library and a program are run, monitored and refused like a method of daebench."""

import json
import shutil
import stat
import subprocess
import sys
import textwrap

import numpy as np
import pytest

import daebench as package
from daebench.diagnostics.derivative import DerivativeWarning
from daebench.errors import BadInput, LostMotion
from daebench.methods.fixed_step.base import monitored_errors, monitored_names, output_maxima
from daebench.methods.names import parse
from daebench.runs.request import Request
from daebench.studies.claims.check import check_claims
from daebench.studies.claims.poisson import PoissonBench
from daebench.studies.grid.run_specification import GridRun
from daebench.studies.grid.specification_key import key_of

RATTLE = """
import numpy as np

calls = 0

def step(p, q, h):
    '''One step of RATTLE for a ball on a string: mass, length and gravity 1.'''
    force = np.array([0.0, 0.0, -1.0])
    start = p + h / 2 * force
    a, b, c = h * h * (q @ q), -2 * h * (q @ (q + h * start)), (q + h * start) @ (q + h * start) - 1.0
    lam = 2 * c / (-b + np.sqrt(b * b - 4 * a * c))
    half = start - lam * q
    end = q + h * half
    last = half + h / 2 * force
    return last - end * (end @ last) / (end @ end), end

def solve(p, q, h, t):
    rows, now = [], 0
    for end in t:
        while now < round(end / h):
            p, q = step(p, q, h)
            now += 1
        rows.append((p, q))
    return np.array([row[0] for row in rows]), np.array([row[1] for row in rows])

class Counting:
    def __init__(self):
        self.steps = 0
    def step(self, p, q, h):
        self.steps += 1
        return step(p, q, h) if self.steps <= 100 else (p, q)

counting = Counting()

def in_place(p, q, h):
    p += 1.0
    return p, q

def fails(p, q, h):
    global calls
    calls += 1
    return (p, q) if calls < 8 else (p / (1 // (calls - calls)), q)

def one(p, q, h):
    return p

def blows_up(p, q, h):
    return 1e200 * p * p, q

def spoils(p, q, h):
    return p, q + np.nan

def of_poisson(y, h):
    return y
"""

LIBRARY = r"""
#include <math.h>
static double dot(const double *a, const double *b) { return a[0]*b[0] + a[1]*b[1] + a[2]*b[2]; }
int step(const double *par, double *p, double *q, double h)
{
    double moved[3], start[3] = {p[0], p[1], p[2] - h / 2 * par[0] * par[2]};
    for (int i = 0; i < 3; i++) moved[i] = q[i] + h * start[i] / par[0];
    double k = h / par[0], a = k * k * dot(q, q), b = -2 * k * dot(q, moved), c = dot(moved, moved) - par[1] * par[1];
    double lam = 2 * c / (-b + sqrt(b * b - 4 * a * c)), end[3], last[3];
    for (int i = 0; i < 3; i++) end[i] = q[i] + h * (start[i] - lam * q[i]) / par[0];
    for (int i = 0; i < 3; i++) last[i] = start[i] - lam * q[i] - (i == 2) * h / 2 * par[0] * par[2];
    double along = dot(end, last) / dot(end, end);
    for (int i = 0; i < 3; i++) { p[i] = last[i] - along * end[i]; q[i] = end[i]; }
    return 0;
}
int gives_up(const double *par, double *p, double *q, double h) { return q[2] > -0.999 ? 0 : 7; }
int doubles(const double *par, double *y, double h) { y[0] *= 2; return 0; }
"""

PROGRAM = """
#!{python}
import json, sys, time
import numpy as np
sys.path.insert(0, {folder!r})
from mine import step

asked = json.loads(sys.stdin.readline())
p, q, began = np.array(asked["p"]), np.array(asked["q"]), time.perf_counter()
for k in range(1, asked["steps"] + 1):
    p, q = step(p, q, asked["h"])
    if k == asked["steps"] or asked["every"] and k % asked["every"] == 0:
        print(*map(repr, map(float, (*p, *q))))
print(json.dumps({{"seconds": time.perf_counter() - began}}))
"""

BALL = {"problem": "spherical_pendulum", "case": "fig1.1", "h": 0.01}


@pytest.fixture
def mine(folder):
    (folder / "mine.py").write_text(RATTLE)
    return folder


@pytest.fixture(scope="module")
def library(tmp_path_factory):
    if shutil.which("gcc") is None:
        pytest.skip("there is no C compiler")
    place = tmp_path_factory.mktemp("library")
    (place / "mine.c").write_text(LIBRARY)
    subprocess.run(["gcc", "-O2", "-shared", "-fPIC", "-o", "libmine.so", "mine.c", "-lm"], cwd=place, check=True)
    return place / "libmine.so"


@pytest.fixture
def program(mine):
    path = mine / "program"
    path.write_text(textwrap.dedent(PROGRAM.format(python=sys.executable, folder=str(mine))).lstrip())
    path.chmod(path.stat().st_mode | stat.S_IXUSR)
    return path


def run(method, **settings):
    return package.run(BALL["problem"], case=BALL["case"], method=method, h=BALL["h"], **{"t_end": 2.0} | settings)


def script(folder, text):
    """Return the name of a method that is a shell script."""
    path = folder / "script"
    path.write_text(f"#!/bin/sh\n{text}\n")
    path.chmod(path.stat().st_mode | stat.S_IXUSR)
    return f"exec:{path}"


# ---- the same numbers as the scheme of daebench ------------------------------------------------------------------------------


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


def test_a_program_does_what_rattle_does(program):
    own, theirs = run("rattle", every=7), run(f"exec:{program}", every=7)
    assert np.array_equal(theirs.t, own.t)
    assert np.allclose(theirs.q, own.q, rtol=0, atol=1e-14)
    assert 0 < theirs.seconds < 60
    assert theirs.maxima_over == "outputs"


def test_monitored_errors_are_those_of_their_formulas(mine, random):
    ivp = package.initial_value_problem(BALL["problem"], BALL["case"])
    p, q = random.standard_normal((2, 5, 3))
    errors = monitored_errors(ivp, ("integrals", "manifold", "energy"), p, q)
    assert monitored_names(("integrals", "manifold", "energy"), ivp) == ["L3", "g", "Gv", "energy"]
    H, L3 = np.sum(p * p, axis=1) / 2 + q[:, 2], q[:, 0] * p[:, 1] - q[:, 1] * p[:, 0]
    expected = [L3 - L3[0], np.sum(q * q, axis=1) - 1.0, 2 * np.sum(p * q, axis=1), H - H[0]]
    assert np.allclose(errors, np.abs(expected).T, rtol=0, atol=1e-14)
    assert list(output_maxima(ivp, ("energy",), p, q).values()) == [np.abs(errors[:, 3]).max()]


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


# ---- what goes wrong is one sentence -----------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("method", "sentence"),
    [
        ("./mine.py:in_place", "step(p, q, h) changes its arguments"),
        ("./mine.py:one", "must return p and q, of shape (3,) each; it returned ndarray"),
        ("./mine.py:of_poisson", "takes 2 arguments; on spherical_pendulum give step(p, q, h)"),
        ("./mine.py:calls", "is no method: it is a int"),
        ("./mine.py:nothing", "mine.py has no nothing; it has step, solve"),
        ("./mine.py:", "'' is no name"),
        ("./other.py:step", "there is no such file"),
        ("./mine.so:step", "there is no such file"),
        ("exec:./nothing", "there is no such program"),
        ("exec:'", "No closing quotation"),
    ],
)
def test_what_is_no_method_is_refused(mine, daebench, method, sentence):
    words = ("run", BALL["problem"], "--case", BALL["case"], "--h", 0.01, "--t-end", 1, "--method", method)
    status, out, err = daebench(*words)
    assert (status, out) == (2, "")
    assert sentence in err
    assert err.count("\n") == 1


def test_a_library_without_the_function_is_refused(library, mine):
    with pytest.raises(BadInput, match="has no function nothing"):
        run(f"{library}:nothing")
    (mine / "text.so").write_text("no library")
    with pytest.raises(BadInput, match="cannot be loaded as a library"):
        run("./text.so:step")


@pytest.mark.parametrize(
    ("settings", "sentence"),
    [
        ({"precision": "float32"}, "computes in float64"),
        ({"raw": True}, "gives no multipliers of its stages"),
        ({"compensated": True}, "sums over its steps itself"),
        ({"options": {"alpha": 1.0}}, "unknown option of ./mine.py:step"),
        ({"tol": 1e-3, "h": None}, "is steered by a step size h"),
    ],
)
def test_what_code_from_outside_cannot_do_is_refused(mine, settings, sentence):
    with pytest.raises(BadInput) as error:
        package.run(**{"problem": "spherical_pendulum", "method": "./mine.py:step", "h": 0.1, "t_end": 1.0} | settings)
    assert sentence in str(error.value)


@pytest.mark.parametrize(
    ("name", "steps", "sentence"),
    [
        ("fails", 7, "./mine.py:fails, line 42: ZeroDivisionError"),
        ("blows_up", 0, "H or a monitored quantity is not finite after this step; use a smaller h"),
        ("spoils", 0, "a value is no longer finite; use a smaller h"),
    ],
)
def test_a_run_that_stops_has_its_states_so_far_and_the_reason(mine, name, steps, sentence):
    with np.errstate(all="ignore"):
        found = run(f"./mine.py:{name}")
    assert found.steps == steps
    assert len(found.t) == steps + 1
    assert sentence in found.failure
    assert f"(step {steps + 1} of 200, h = 0.01)" in found.failure


def test_a_status_of_a_library_stops_the_run(library):
    found = run(f"{library}:gives_up", parameters={"gravity": 1.0})
    assert found.failure is None or "returned 7" in found.failure
    low = package.run("spherical_pendulum", case="fig1.1", q0=[0, 0, -1.0], p0=[0.1, 0, 0], method=f"{library}:gives_up", h=0.01, t_end=1)
    assert (low.steps, "returned 7, and not 0" in low.failure) == (0, True)


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("exit 3", "stopped after t = 0 (step 0 of 200, h = 0.01): the program ended after 0 of 200 states, with status 3."),
        ("echo some trouble >&2; exit 1", "with status 1: some trouble."),
        ("kill -9 $$", "ended after 0 of 200 states, with status -9."),
        ("yes 1 2 3 4 5 6 | head -3", "stopped after t = 0.03 (step 3 of 200, h = 0.01): the program ended after 3 of 200 states."),
    ],
)
def test_a_program_that_dies_is_said_to_have(folder, text, sentence):
    failure = run(script(folder, text)).failure
    assert sentence in failure
    assert failure.count("\n") == 0


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("echo hello", "writes 'hello', which is no state"),
        ("echo 1 2 3", "writes 3 numbers in a line, '1 2 3'; a state has 6"),
        ("yes 1 2 3 4 5 6 | head -200", "it must write its seconds"),
        ("yes 1 2 3 4 5 6", "it must write its seconds"),
        ("yes 1 2 3 4 5 6 | head -200; echo '{\"seconds\": -1}'", "it must write its seconds"),
        ("yes 1 2 3 4 5 6 | head -200; echo '{\"seconds\": 1}'; echo more", "that line must be the last"),
        ("head -c 1000000 /dev/zero", "which is no state"),
    ],
)
def test_a_program_that_writes_something_else_is_refused(folder, text, sentence):
    with pytest.raises(BadInput) as error:
        run(script(folder, text))
    assert sentence in str(error.value)
    assert len(str(error.value)) < 2100


def test_a_program_with_numbers_that_are_not_finite_is_a_failure(folder):
    found = run(script(folder, "yes nan 0 0 0 0 0 | head -200; echo '{\"seconds\": 1}'"))
    assert "a value is no longer finite" in found.failure


def test_a_program_that_hangs_is_left(folder):
    found = run(script(folder, "sleep 60"), seconds_limit=0.3)
    assert "within the limit of time" in found.failure
    assert found.steps == 0


def test_the_program_is_told_what_is_asked(folder):
    asked = folder / "asked.json"
    run(script(folder, f"cat > {asked}"), every=5, parameters={"mass": 2.0})
    about = json.loads(asked.read_text())
    assert (about["problem"], about["case"], about["h"], about["steps"], about["every"]) == ("spherical_pendulum", "fig1.1", 0.01, 200, 5)
    assert list(about["parameters"].items()) == [("mass", 2.0), ("length", 1.0), ("gravity", 1.0)]
    assert [len(about[name]) for name in ("p", "q")] == [3, 3]


def test_code_from_outside_stands_beside_methods_of_daebench(mine, daebench):
    words = ("compare", BALL["problem"], "--case", BALL["case"], "--methods", "rattle,./mine.py:step", "--h", 0.02, "--t-end", 2, "--json")
    status, out, err = daebench(*words)
    rows = json.loads(out)["rows"]
    assert (status, [row["method"] for row in rows]) == (0, ["rattle", "./mine.py:step"]), err
    assert rows[1]["energy_error"] == pytest.approx(rows[0]["energy_error"], rel=1e-4)
    assert rows[1]["position_error"] == pytest.approx(rows[0]["position_error"], rel=1e-4)


def test_its_order_is_measured(mine, plain_functions):
    rows = package.order("spherical_pendulum", methods=["./mine.py:step"], case="fig1.1", t_end=1.0, h=0.1, halvings=4)
    assert list(rows["component"]) == ["q", "p", "lam"]
    assert rows["claimed"].isna().all()
    assert (abs(rows["order"] - 2.0) < 0.1).all()


def test_a_long_run_of_code_from_outside_is_refused(mine, daebench):
    status, out, err = daebench("long", "spherical_pendulum", "--methods", "./mine.py:step", "--h", 0.01, "--steps", 100)
    assert (status, out) == (2, "")
    assert "a long run keeps the whole state of a method" in err


def test_a_stored_run_is_of_the_content_of_the_file(mine):
    def key():
        asked = {"problem": "spherical_pendulum", "case": "fig1.1", "method": "./mine.py:step", "value": 0.1, "t_end": 1.0}
        return key_of(GridRun(**asked, metrics=("energy",)))

    before = key()
    assert key() == before
    (mine / "mine.py").write_text(RATTLE + "\n# another text\n")
    assert key() != before


# ---- properties --------------------------------------------------------------------------------------------------------------

CLAIMING = (
    RATTLE
    + """
step.claims = {"order": 2, "symmetric": True, "symplectic": True, "keeps_g": True, "keeps_Gv": True}

def reduced(p, q, h):
    '''Symplectic Euler on the index-reduced equation.'''
    force = np.array([0.0, 0.0, -1.0])
    p = p + h * (force - (p @ p + force @ q) / (q @ q) * q)
    return p, q + h * p

reduced.claims = {"order": 1, "symplectic": True, "keeps_g": True}

def real(p, q, h):
    if np.iscomplexobj(p):
        raise TypeError("real numbers only")
    return step(p, q, h)

real.claims = step.claims

def drops(p, q, h):
    return step(np.real(p), np.real(q), h)

drops.claims = step.claims
"""
)


def findings(name):
    ivp = package.initial_value_problem("spherical_pendulum", "fig1.1")
    return {finding.property: finding for finding in check_claims(ivp, parse(name), h=0.01, steps=100, halvings=5)}


@pytest.fixture
def claiming(mine, plain_functions):
    (mine / "mine.py").write_text(CLAIMING)
    return mine


def test_claims_that_hold_are_found_to(claiming):
    found = findings("./mine.py:step")
    assert [found[name].verdict for name in ("order", "symmetric", "symplectic", "keeps g", "keeps G H_p")] == 5 * ["ok"]
    assert found["keeps H"].verdict == "not claimed"
    assert found["symplectic"].note == ""
    assert found["symplectic"].bound < 1e-12


def test_claims_that_do_not_hold_are_found_not_to(claiming):
    found = findings("./mine.py:reduced")
    assert {name for name, finding in found.items() if finding.verdict == "FALLS SHORT"} == {"symplectic", "keeps g"}
    assert found["order"].verdict == "ok"


@pytest.mark.parametrize("name", ["real", "drops"])
def test_code_that_does_not_compute_in_complex_numbers_is_measured_by_differences_to_a_stated_floor(claiming, name):
    with pytest.warns(DerivativeWarning, match="that of differences"):
        found = findings(f"./mine.py:{name}")
    assert found["symplectic"].verdict == "ok"
    assert "by differences, good to" in found["symplectic"].note
    assert 1e-12 < found["symplectic"].bound < 1e-6


def test_a_library_is_measured_without_claims(library, plain_functions):
    with pytest.warns(DerivativeWarning, match="that of differences"):
        found = findings(f"{library}:step")
    assert {finding.verdict for finding in found.values()} == {"not claimed"}
    assert found["symplectic"].measured < found["symplectic"].bound
    assert found["symmetric"].measured < 1e-14
    assert abs(found["order"].measured - 2) < 0.1


@pytest.mark.parametrize(
    ("claims", "sentence"),
    [
        ("{'oder': 2}", "unknown claim of ./mine.py:step 'oder'; did you mean order"),
        ("{'order': 2.5}", "claims['order'] = 2.5 is to be a whole number"),
        ("{'symplectic': 1}", "claims['symplectic'] = 1 is to be True or False"),
        ("['order']", "claims is to be a mapping"),
    ],
)
def test_claims_that_are_none_are_refused(mine, claims, sentence):
    (mine / "mine.py").write_text(f"{RATTLE}\nstep.claims = {claims}\n")
    with pytest.raises(BadInput) as error:
        parse("./mine.py:step")
    assert sentence in str(error.value)


MAPS = """
import numpy as np

def turn(y, h):
    c, s = np.cos(h * y[2]), np.sin(h * y[2])
    return np.array([c * y[0] + s * y[1], c * y[1] - s * y[0], y[2]])

def grow(y, h):
    return np.exp(h) * y

turn.claims = grow.claims = {"symplectic": True, "symmetric": True}
"""


@pytest.mark.parametrize(("name", "verdict"), [("turn", "ok"), ("grow", "FALLS SHORT")])
def test_a_poisson_map_is_told_from_one_that_is_none(mine, plain_functions, name, verdict):
    """On the rigid body B is that of the rotations: a turn about an axis is a Poisson map, and growth is none."""
    (mine / "mine.py").write_text(MAPS)
    ivp, method = package.initial_value_problem("free_rigid_body"), parse(f"./mine.py:{name}")
    run = method.solve(ivp, Request(value=0.01, steps=50, watch=("energy", "casimirs", "integrals")))
    found = {finding.property: finding.verdict for finding in PoissonBench(ivp, method, run).findings()}
    assert (found["Poisson map"], found["symmetric"]) == (verdict, "ok")

"""Linked modules in JavaScript, run in a browser, against the machine code that is made of them; derivatives against a complex step."""

import numpy as np
import pytest
from measures import error_of

from daebench.compiler.javascript import functions
from daebench.diagnostics.symplecticity import tangent_path
from daebench.errors import BadInput
from daebench.methods.fixed_step.script import script
from daebench.methods.initial_value_problem import initial_value_problem
from daebench.methods.names import POISSON, parse
from daebench.runs.request import Request

POISSON_PROBLEMS = ("lotka_volterra", "free_rigid_body")
STATES = 1000
PAIRS = [("spherical_pendulum", "rattle", {}), ("lotka_volterra", "strang", {})]
PAIRS += [("spherical_pendulum", name, {}) for name in ("se", "se+proj", "rk4", "implicit_euler", "shake", "lobatto3", "lobatto4")]
PAIRS += [("spherical_pendulum", "stiff:rk4", {"eps": 0.1}), ("spherical_pendulum", "rattle/kahan_li8", {})]
PAIRS += [("slider_crank", "rattle", {}), ("double_pendulum", "rattle", {}), ("double_pendulum", "lobatto3", {})]
PAIRS += [("lotka_volterra", name, {}) for name in ("rk4", "midpoint", "symplectic_euler_adjoint")]
PAIRS += [("free_rigid_body", name, {}) for name in ("strang@123", "midpoint", "rk4")]

SLOW = ("free_rigid_body-midpoint",)
GATE = ("spherical_pendulum-rattle", "lotka_volterra-strang", *SLOW)

RUN = """([text, states, h, par, weights, width]) => {
  const kernel = eval("(" + text + ")"), S = new Float64Array(kernel.size), R = new Float64Array(8);
  const one = new Float64Array(width), ends = [], rows = new Float64Array(width * (states.length - 1));
  for (const state of states) {
    S.set(state); kernel.start(S, h, par, R);
    kernel.integrate(S, h, 1, 1, 1, one, par, weights, R);
    ends.push([R[4], ...one]);
  }
  S.set(states[0]); kernel.start(S, h, par, R);
  kernel.integrate(S, h, states.length - 1, 1, 1, rows, par, weights, R);
  return [ends, [...rows], [...R], [...S]];
}"""


@pytest.fixture(scope="module")
def page(chromium):
    """An empty page that kernels are run in."""
    opened = chromium.new_page()
    yield opened
    opened.close()


def prepared(problem, name, options):
    """Return a method and a problem with a start that no symmetry tells from others."""
    method = parse(name, options, kind=POISSON, anyway=True) if problem in POISSON_PROBLEMS else parse(name, options)
    return method, initial_value_problem(problem)


def compiled(method, ivp, h):
    """Return a run of the compiled kernel, as rows of states, and one step from each of them with what it returns."""
    request = Request(value=h, steps=STATES, every=1, watch=())
    run = method.begin(ivp, request, method.grid(ivp, request), ())
    kernel, steps = run.kernel, STATES
    integrate = lambda carried, n: kernel.integrate(  # noqa: E731
        *carried, run.h, run.weights, n, 1, 1, run.state_rows, run.stage_rows, run.par
    )
    integrate(run.carried, steps)
    rows = np.concatenate([np.concatenate(ivp.start)[None], run.state_rows[:steps]]).copy()
    ends = []
    for row in rows:
        vectors = np.split(row, np.cumsum([len(part) for part in ivp.start])[:-1])
        x = run.state(run.linked.enter(vectors))
        memory = run.state(kernel.initialise(x, run.h, run.par)[0]) if hasattr(kernel, "initialise") else ()
        result = integrate((x, memory, *run.carried[2:]), 1)
        ends.append([result[9][0], *run.state_rows[0]])
    return rows, np.array(ends)


@pytest.mark.sampled(by=lambda case: case in GATE, slow=SLOW)
@pytest.mark.parametrize(("problem", "name", "options"), PAIRS, ids=[f"{problem}-{name}" for problem, name, _ in PAIRS])
def test_a_step_in_the_browser_is_that_of_the_compiled_kernel(page, problem, name, options):
    """Hold a kernel in the browser against the compiled one: one step from each of a thousand states, and the run through them."""
    method, ivp = prepared(problem, name, options)
    rows, expected = compiled(method, ivp, 0.01)
    made = script(method, ivp, 0.01)
    ends, run, report, _ = page.evaluate(RUN, [made.text, rows.tolist(), 0.01, made.par, made.weights, rows.shape[1]])
    size = np.abs(rows).max(axis=1, keepdims=True)
    assert np.array_equal(np.array(ends)[:, 0], expected[:, 0])
    assert np.all(np.abs(np.array(ends)[:, 1:] - expected[:, 1:]) <= 1e-14 * size)
    assert np.all(np.abs(np.reshape(run, (STATES, -1)) - rows[1:]) <= 1e-12 * size[1:])
    assert report[:2] == [STATES, STATES]


@pytest.mark.slow
def test_derivatives_in_the_browser_are_those_of_a_complex_step(page):
    method, ivp = prepared("spherical_pendulum", "rattle", {})
    tangents = np.array([[0.3, -0.1, 0.2, 0.0, 0.4, -0.2], [0.0, 0.5, 0.1, -0.3, 0.2, 0.1]]).T
    states, derivatives, _ = tangent_path(method.path(ivp, 0.02, 50), ivp.p0, ivp.q0, tangents)
    made = script(method, ivp, 0.02, directions=2)
    dual = np.column_stack([made.state, tangents]).ravel().tolist()
    run = RUN.replace("states.length - 1", "50")
    _, _, report, carried = page.evaluate(run, [made.text, [dual], 0.02, made.par, made.weights, 6])
    ends = np.reshape(carried[:18], (6, 3))
    assert report[0] == 50
    assert error_of(ends[:, 0], states[-1]) < 1e-12
    assert error_of(ends[:, 1:], derivatives[-1]) < 1e-10 * np.abs(derivatives[-1]).max()


def test_a_method_that_does_not_take_the_problem_is_refused():
    with pytest.raises(BadInput, match="rattle"):
        script(parse("strang", kind=POISSON), initial_value_problem("spherical_pendulum"), 0.1)
    with pytest.raises(BadInput, match="a page takes 24 at most"):
        script(parse("rattle"), initial_value_problem("pendulum_chain", parameters={"links": 9}), 0.1)


WRITTEN = {
    "x[0] - (x[1] - 1.0)": "a0-(b0-1)",
    "x[0] * (x[1] * 0.1)": "a0*(b0*.1)",
    "x[0] * x[1] - (-x[0])": "a0*b0-(-a0)",
    "-(x[0] + x[1]) / 0.5": "-(a0+b0)/.5",
    "1.0 * x[0] - -1.0 * x[1]": "a0-(-b0)",
    "x[0] if x[0] < x[1] or not x[1] > 0.0 else 2.0": "a0<b0||!(b0>0)?a0:2",
    "arctan2(x[0], x[1]) ** 0.5": "Math.pow(Math.atan2(a0,b0),.5)",
}


def test_an_operation_keeps_the_order_in_which_python_does_it():
    for expression in WRITTEN:
        text = functions(f"def f(x, par):\n    unused = sin(x[0])\n    return {expression}", ["f"], [2], ())
        assert f"O[0]={WRITTEN[expression]};" in text
        assert "sin" not in text


STEERED = """
def f(x, par):
    a, b, c = x[0], x[1], 0.0
    for k in range(1, 8):
        a, b, c = b, a + k * b, c - a
        if b > 50.0:
            return a, b, c
        if a > b:
            c = c + 1.0
        elif a < 0.0:
            a = -a
    return a, b, 2.0 * c
"""


def test_branches_and_loops_do_what_those_of_python_do(page):
    text, scope = functions(STEERED, ["f"], [2], ()), {}
    exec(STEERED, scope)
    rng, ends = np.random.default_rng(0), set()
    states = [*rng.uniform(-3.0, 3.0, (100, 2)).tolist(), [0.0, -0.0], [float("nan"), 1.0], [60.0, 1e300]]
    run = "([text, states]) => { const k = eval('(' + text + ')'), O = [0, 0, 0]; "
    run += "return states.map((S) => { k.f(S, [], O); return O.map(String) }) }"
    told = page.evaluate(run, [text, states])
    for state, values in zip(states, told, strict=True):
        expected = scope["f"](tuple(state), ())
        assert np.array_equal(np.array(values, dtype=float), expected, equal_nan=True)
        ends.add(expected[1] > 50.0)
    assert len(ends) == 2


def test_what_a_page_cannot_compute_is_refused_in_one_sentence():
    for body in ["numpy.empty(3)[0] + x[0]", "numpy.fix(x[0])"]:
        with pytest.raises(BadInput, match="a page cannot compute"):
            functions(f"def f(x, par):\n    return {body}", ["f"], [1], ())

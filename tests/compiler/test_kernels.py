"""Linked kernels as machine code: the same results as uncompiled, number types kept, work counted exactly, failures said."""

import itertools

import numpy as np
import pytest
import uncompiled
from ivps import ONE_OF_EACH_KIND, ivp
from measures import error_of
from tallied import tally

from daebench.compiler.trace.ir import FLOAT32, FLOAT64
from daebench.errors import BadInput
from daebench.methods.catalogue import schemes
from daebench.methods.fixed_step.constrained import FixedStep
from daebench.methods.initial_value_problem import initial_value_problem
from daebench.methods.registry import registry
from daebench.runs.request import Request

FILES = {file: name for name, (file, _) in reversed(registry().items())}
"""One scheme of each file: the others in it are the same code with more stages."""

PAIRS = [*itertools.product(FILES.values(), ("planar", "stretched-M", "double-pendulum"))]
PAIRS += itertools.product(("rattle", "implicit_euler", "se"), ("relativistic", "coupled-rods", "stretched-H"))
GATE = {"energy_momentum on planar", "radau2_ggl on planar", "rattle on stretched-M", "rattle_gauss_seidel on double-pendulum"}
"""Kinds of schemes on kinds of problems: each pair is compiled, and the others are for the day of a release."""


@pytest.mark.sampled(by=lambda case: case in GATE)
@pytest.mark.parametrize(("scheme", "place"), PAIRS, ids=[" on ".join(pair) for pair in PAIRS])
def test_machine_code_and_python_do_what_the_scheme_file_says(scheme, place, monkeypatch):
    if why := FixedStep(scheme).refusal(ivp(place)):
        pytest.skip(why)
    request = Request(value=0.002, steps=40, watch=("energy", "manifold", "integrals"))
    fast, printed = (FixedStep(scheme, compiled=compiled).solve(ivp(place), request) for compiled in (True, False))
    monkeypatch.setattr(FixedStep, "kernel", uncompiled.kernel)
    slow = FixedStep(scheme).solve(ivp(place), request)
    assert fast.failure is None
    assert (fast.work, fast.maxima) == (printed.work, printed.maxima)
    assert np.array_equal((fast.q, fast.p), (printed.q, printed.p))
    assert fast.work == slow.work
    assert error_of(fast.q, slow.q) < 1e-13
    assert error_of(fast.p, slow.p) < 1e-12
    assert fast.maxima.keys() == slow.maxima.keys()


def test_float32_stays_float32_through_the_whole_kernel():
    method, where = FixedStep("rattle"), ivp("spherical-fast")
    run = method.solve(where, Request(value=0.01, steps=200, precision="float32"))
    assert run.steps == 200
    exact = method.solve(where, Request(value=0.01, steps=200))
    kernel = method.kernel(where, "float32", ("energy", "manifold"), count=True)
    (kinds,) = kernel.integrate.kinds.values()
    assert FLOAT32 in kinds
    assert FLOAT64 not in kinds
    assert 1e-8 < run.maxima["g"] < 1e-5
    assert 1e-7 < error_of(run.q[-1], exact.q[-1]) < 1e-3


@pytest.mark.sampled(by=(*ONE_OF_EACH_KIND, "dla", "lie").__contains__)
@pytest.mark.parametrize("name", [name for name in schemes() if name not in ("rattle_conformal", "boris")])
def test_work_is_what_an_independent_tally_counts(name, monkeypatch):
    method, request = FixedStep(name, compiled=False), Request(value=0.002, steps=7, watch=())
    place = "rigid_water" if name == "rattle_settle" else "knife_edge" if method.claims.nonholonomic else "spherical_pendulum"
    where = ivp("spherical-fast") if place == "spherical_pendulum" else initial_value_problem(place)
    counted = method.solve(where, request).work
    assert counted == tally(monkeypatch, method, where, request)


def test_nothing_is_counted_or_watched_where_nothing_is_asked():
    run = FixedStep("rattle").solve(ivp("spherical-fast"), Request(value=0.01, steps=5, watch=(), count=False))
    assert run.work == {}
    assert run.maxima == {}


def test_pieces_of_a_run_join_to_the_same_bits(monkeypatch):
    where, request = ivp("spherical-fast"), Request(value=0.01, steps=1000, every=7)
    for scheme in ("rattle", "shake"):
        whole = FixedStep(scheme).solve(where, request)
        monkeypatch.setattr("daebench.methods.fixed_step.stepping.CHUNK_SECONDS", 1e-9)
        pieces = FixedStep(scheme).solve(where, request)
        monkeypatch.undo()
        assert np.array_equal(whole.q, pieces.q)
        assert np.array_equal(whole.t, pieces.t)
        assert whole.t[-1] == 1000 * 0.01
        assert len(whole.t) == 1 + 1000 // 7 + 1


@pytest.mark.parametrize(
    ("h", "settings", "words"),
    [
        (0.0, {"steps": 5}, "greater than 0"),
        (np.nan, {"steps": 5}, "finite number"),
        (0.1, {"steps": 0}, "at least one"),
        (0.1, {}, "a number of steps or"),
        (0.1, {"steps": 5, "t_end": 1.0}, "not both"),
        (0.1, {"t_end": 0.05}, "less than h"),
        (1e-12, {"t_end": 1e6}, "more steps than"),
        (1e-6, {"steps": 10**12}, "--every"),
        (0.1, {"steps": 5, "every": -1}, "every = -1"),
        (0.1, {"steps": 5, "points": 11}, "tolerance-driven"),
    ],
    ids=str,
)
def test_a_request_that_cannot_be_met_is_refused_with_a_reason(h, settings, words):
    with pytest.raises(BadInput, match=words):
        FixedStep("rattle").solve(ivp("spherical-fast"), Request(value=h, **settings))


def test_a_run_takes_the_whole_steps_that_fit_and_shortens_none():
    for t_end in (0.3, 0.39):
        run = FixedStep("rattle", compiled=False).solve(ivp("spherical-slow"), Request(value=0.1, t_end=t_end))
        assert (run.steps, run.t[-1]) == (3, 3 * 0.1)

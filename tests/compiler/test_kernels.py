"""Linked kernels as machine code: the same results as uncompiled, number types kept, work counted exactly, failures said."""

import subprocess
import sys

import numpy as np
import pytest
import sympy as sp
import uncompiled
from ivps import ivp
from tallied import tally

from daebench.compiler import sealed
from daebench.compiler.definition import source_of
from daebench.compiler.trace.ir import FLOAT32, FLOAT64
from daebench.errors import BadInput, RunFailed
from daebench.methods.catalogue import schemes
from daebench.methods.fixed_step.constrained import FixedStep
from daebench.methods.initial_value_problem import initial_value_problem
from daebench.methods.registry import registry
from daebench.runs.make_ivp import make_ivp
from daebench.runs.request import Request
from daebench.systems.constrained import Case, ConstrainedHamiltonian, coordinates

FILES = {file: name for name, (file, _) in reversed(registry().items())}
"""One scheme of each file: the others in it are the same code with more stages."""

KINDS = ("stretched-M", "double-pendulum")
PAIRS = [(name, "planar") for name in FILES.values()]
SLOW_PAIRS = [(name, KINDS[k % 2]) for k, name in enumerate(FILES.values())]
SLOW_PAIRS += [(name, place) for name in ("rattle", "implicit_euler", "se") for place in ("relativistic", "coupled-rods", "stretched-H")]
SLOW_PAIRS += [("lobatto4", "spherical-fast"), ("gauss3", "spherical-fast")]
OTHER_PAIRS = [("radau3_ggl", "spherical-fast")]
OTHER_PAIRS += [(name, KINDS[(k + 1) % 2]) for k, name in enumerate(FILES.values())]


def marked(pairs, *marks):
    return [pytest.param(*pair, id=" on ".join(pair), marks=marks) for pair in pairs]


@pytest.mark.sampled(
    left_out=(
        "radau2_ggl on double-pendulum",
        "radau2_ggl on planar",
        "radau2_index2 on planar",
    ),
    by=lambda case: (
        not case.startswith(("ggl_vi", "implicit", "lie", "livens", "rattle_g", "rattle_i", "rk4", "seproj", "symplectic_euler_"))
        and not case.startswith(
            ("radau2_index2", "radau2_ggl on st", "se on ", "gauss2 on st", "gauss3", "lobatto2 on s", "lobatto4 on s", "midpoint on d")
        )
    ),
)
@pytest.mark.parametrize(
    ("scheme", "place"),
    [
        *marked(PAIRS),
        *marked(SLOW_PAIRS, pytest.mark.slow),
        *marked(OTHER_PAIRS, pytest.mark.slow, pytest.mark.exhaustive),
    ],
)
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
    assert np.abs(fast.q - slow.q).max() < 1e-13
    assert np.abs(fast.p - slow.p).max() < 1e-12
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
    assert 1e-7 < np.abs(run.q[-1] - exact.q[-1]).max() < 1e-3


def test_another_value_of_a_parameter_compiles_nothing_and_counts(tmp_path):
    method = FixedStep("rattle")
    first = method.solve(ivp("spherical-fast"), Request(value=0.01, steps=50))
    heavy = make_ivp(ivp("spherical-fast").source, "fig1.2b", {"gravity": 9.81})
    second = method.solve(heavy, Request(value=0.01, steps=50))
    kernel = method.kernel(heavy, "float64", ("energy", "manifold"), count=True)
    assert len(kernel.integrate.kinds) == 1
    assert np.abs(first.q[-1] - second.q[-1]).max() > 1e-2


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


def test_rattle_derives_no_second_derivatives_where_h_is_separable():
    kernel = uncompiled.kernel(FixedStep("rattle"), ivp("spherical-fast"), "float64", (), count=False)
    assert not {"H_qp", "H_qq", "curvature", "Gv_q", "a_p"} & set(vars(kernel))


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


def test_symplectic_euler_on_the_reduced_equation_says_where_it_loses_its_solution():
    where = ivp("spherical-fast")
    run = FixedStep("se").solve(where, Request(value=0.05, steps=1000))
    assert run.failure is not None
    assert "se on spherical_pendulum, case fig1.2b, stopped at t =" in run.failure
    assert 0 < run.steps < 1000
    assert np.all(np.isfinite(run.q))
    with pytest.raises(RunFailed, match="did not converge"):
        run.complete()


def test_a_doubled_constraint_is_called_singular():
    q, p = coordinates(2)
    circle = q[0] ** 2 + q[1] ** 2 - 1
    twice = ConstrainedHamiltonian(
        q=(*q, sp.Symbol("q3")),
        p=(*p, sp.Symbol("p3")),
        M=sp.eye(3),
        U=q[1],
        g=[circle, 2 * circle],
        cases={"a": Case(q=(1, 0, 0), p=(0, 0, 0))},
    )
    run = FixedStep("rattle", compiled=False).solve(make_ivp(source_of(twice), "a"), Request(value=0.1, steps=3))
    assert run.failure is not None
    assert "singular" in run.failure
    assert run.steps == 0


def test_leaving_the_domain_of_the_potential_is_said_and_no_nan_travels():
    q, p = coordinates(2)
    falling = ConstrainedHamiltonian(
        q=q, p=p, M=sp.eye(2), U=sp.sqrt(q[1]), g=[q[0]], cases={"a": Case(q=(0, sp.Rational(1, 10)), p=(0, 0))}
    )
    run = FixedStep("rattle", compiled=False).solve(make_ivp(source_of(falling), "a"), Request(value=0.1, steps=100))
    assert run.failure is not None
    assert "no longer finite" in run.failure
    assert np.all(np.isfinite(run.q))
    assert np.all(np.isfinite(run.p))


def test_an_unwritable_cache_compiles_in_memory_with_a_warning(tmp_path, monkeypatch):
    where = ivp("spherical-fast")
    (tmp_path / "file").write_text("not a folder")
    monkeypatch.setenv("DAEBENCH_CACHE", str(tmp_path / "file" / "cache"))
    with pytest.warns(sealed.CacheWarning, match="compiling in memory"):
        fresh = make_ivp(source_of(where.source.define(), "fresh"), "fig1.2b")
    run = FixedStep("rattle").solve(fresh, Request(value=0.01, steps=5, watch=("energy",)))
    assert run.steps == 5


@pytest.mark.slow
def test_several_processes_may_compile_the_same_kernel_at_once(tmp_path):
    code = (
        "import daebench; r = daebench.run('planar_pendulum', method='rattle', h=0.01, steps=100, every=0); print(repr(r.q[-1].tolist()))"
    )
    environment = {"DAEBENCH_CACHE": str(tmp_path), "PATH": "", "HOME": str(tmp_path)}
    running = [subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, text=True, env=environment) for _ in range(3)]
    answers = {process.communicate()[0] for process in running}
    assert all(process.returncode == 0 for process in running)
    assert len(answers) == 1
    assert not list(tmp_path.glob("*.tmp"))


@pytest.mark.parametrize(
    ("request_", "words"),
    [
        (Request(value=0.0, steps=5), "greater than 0"),
        (Request(value=float("nan"), steps=5), "finite number"),
        (Request(value=0.1, steps=0), "at least one"),
        (Request(value=0.1), "either a number of steps or an end time"),
        (Request(value=0.1, steps=5, t_end=1.0), "not both"),
        (Request(value=0.1, t_end=0.05), "less than h"),
        (Request(value=1e-12, t_end=1e6), "more steps than can be counted"),
        (Request(value=1e-6, steps=10**12), "--every"),
        (Request(value=0.1, steps=5, every=-1), "every = -1"),
        (Request(value=0.1, steps=5, points=11), "tolerance-driven"),
    ],
    ids=lambda x: x if isinstance(x, str) else "",
)
def test_a_request_that_cannot_be_met_is_refused_with_a_reason(request_, words):
    with pytest.raises(BadInput, match=words):
        FixedStep("rattle").solve(ivp("spherical-fast"), request_)


def test_a_run_takes_the_whole_steps_that_fit_and_shortens_none():
    run = FixedStep("rattle", compiled=False).solve(ivp("spherical-slow"), Request(value=0.1, t_end=0.3))
    assert run.steps == 3
    run = FixedStep("rattle", compiled=False).solve(ivp("spherical-slow"), Request(value=0.1, t_end=0.39))
    assert run.steps == 3
    assert run.t[-1] == 3 * 0.1

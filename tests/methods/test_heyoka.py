"""Taylor series of heyoka as a method: held against certified references, and told what they cannot do."""

from importlib.util import find_spec

import numpy as np
import pytest
import sympy as sp
from measures import error_of

from daebench.errors import BadInput
from daebench.methods import run as api
from daebench.methods.solvers import drive, heyoka_ode
from daebench.reference.keep.store import load
from daebench.studies.work_precision.study import standard
from daebench.systems.poisson import PoissonCase, PoissonSystem

needs_heyoka = pytest.mark.skipif(find_spec("heyoka") is None, reason="heyoka, of the extra peers, is not installed")


def run(problem, case, t_end, tol=1e-14, **more):
    return api.run(problem, case=case, method="heyoka:taylor", tol=tol, t_end=t_end, **more)


@pytest.mark.sampled(left_out=("in-velocities",))
@needs_heyoka
@pytest.mark.parametrize(
    ("name", "t_end"),
    [
        pytest.param("spherical_pendulum-fig1.2", 10.0, id="in-momenta"),
        pytest.param("double_pendulum-horizontal", 2.0, id="in-velocities"),
        pytest.param("lotka_volterra-4,2", 10.0, id="poisson"),
        pytest.param("cyclohexane_ring-boat", 1.0, id="redundant-constraints", marks=pytest.mark.exhaustive),
    ],
)
def test_it_gives_the_certified_motion(name, t_end):
    problem, case = name.split("-", 1)
    reference = load(name)
    rows = np.flatnonzero(reference.t <= t_end)
    found = run(problem, case, float(reference.t[rows[-1]]), points=len(rows)).complete()
    assert np.allclose(found.t, reference.t[rows], rtol=0, atol=1e-13)
    for part, values in found.states.items():
        assert error_of(values, reference.values[part][rows]) < 1e-9
    loose = run(problem, case, float(reference.t[rows[-1]]), tol=1e-5, points=len(rows))
    assert max(error_of(values, reference.values[part][rows]) for part, values in loose.states.items()) > 1e-8


@needs_heyoka
def test_its_steps_are_counted_and_least_squares_are_refused():
    found = run("planar_pendulum", "rotating", 4.0, points=5)
    assert set(found.work) == {"steps"}
    assert 5 < found.steps == found.work["steps"] < 200
    with pytest.raises(BadInput, match="not by least squares"):
        run("planar_pendulum", "rotating", 1.0, on_singular="least-squares")


@needs_heyoka
def test_a_start_whose_last_coefficients_vanish_is_left_by_a_short_step():
    # from rest, u = -t^2/2 + c t^6 + ...: at order 16, which 1e-13 asks for, the coefficients of t^15 and t^16 are those of no variable
    u, w = sp.symbols("u w", real=True)
    system = PoissonSystem(y=[u, w], B=sp.Matrix([[0, 1], [-1, 0]]), H=w**2 / 2 + sp.sin(u), cases={"rest": PoissonCase(y=(0, 0))})
    found, other = (api.run(system, method=name, tol=1e-13, t_end=5.0).complete() for name in ("heyoka:taylor", "scipy:DOP853"))
    assert error_of(found.y, other.y) < 1e-9


@needs_heyoka
@pytest.mark.parametrize(
    ("problem", "more", "words"),
    [("pendulum_chain", {"algebra": "arrays"}, "use ida:index1"), ("ablowitz_ladik", {}, "as loops")],
    ids=["chain", "lattice"],
)
def test_what_has_no_expressions_is_refused(problem, more, words):
    with pytest.raises(BadInput, match=words):
        run(problem, None, 1.0, **more)


def test_without_heyoka_there_is_the_command_that_installs_it(daebench, monkeypatch):
    monkeypatch.setattr(drive, "find_spec", lambda name: None)
    for problem, case in (("planar_pendulum", "rotating"), ("lotka_volterra", "4,2")):
        words = ("run", problem, "--case", case, "--method", "heyoka:taylor", "--tol", 1e-6, "--t-end", 1)
        status, out, err = daebench(*words)
        assert (status, out) == (2, "")
        assert "pip install 'daebench[peers]'" in err
        study, left_out = standard(problem, case=case)
        assert "heyoka:taylor" not in study.methods
        assert err == f"daebench: {left_out['heyoka:taylor']}\n"


@needs_heyoka
@pytest.mark.parametrize("points", [3, 201, 4001])
def test_what_is_timed_takes_the_steps_that_are_looked_at_and_gives_the_same_outputs(points, monkeypatch):
    timed, once_more = [], heyoka_ode._Along._once_more

    class Told:
        """An integrator that keeps what it gave."""

        def __init__(self, series):
            object.__setattr__(self, "series", series)

        def __getattr__(self, name):
            return getattr(self.series, name)

        def __setattr__(self, name, value):
            setattr(self.series, name, value)

        def propagate_grid(self, grid):
            timed.append(self.series.propagate_grid(grid))

    def told(along, times):
        along.series = Told(along.series)
        once_more(along, times)

    monkeypatch.setattr(heyoka_ode._Along, "_once_more", told)
    found = run("spherical_pendulum", "fig1.2", 10.0, points=points).complete()
    *_, steps, _, outputs = timed[0]
    assert steps + 1 == found.steps
    assert np.allclose(outputs[1:, :3], found.q[len(found.q) - len(outputs) + 1 :], rtol=0, atol=1e-14)
    assert found.seconds > 0

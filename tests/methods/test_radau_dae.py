"""solve_dae's Radau as a method: held against certified references, and told where it cannot be had."""

from importlib.util import find_spec

import numpy as np
import pytest

from daebench.errors import BadInput
from daebench.methods import run
from daebench.methods.solvers import drive
from daebench.reference.keep.store import load

needs_solve_dae = pytest.mark.skipif(find_spec("solve_dae") is None, reason="solve_dae, of the extra peers, is not installed")


@needs_solve_dae
@pytest.mark.parametrize("name", ["spherical_pendulum-fig1.2", "double_pendulum-horizontal"], ids=["in-momenta", "in-velocities"])
def test_it_converges_to_the_certified_motion(name):
    problem, case = name.split("-", 1)
    reference = load(name)
    rows = np.flatnonzero(reference.t <= 0.5)
    errors = []
    for tol in (1e-4, 1e-9):
        found = run.run(
            problem, case=case, method="solve_dae:Radau", tol=tol, t_end=float(reference.t[rows[-1]]), points=len(rows)
        ).complete()
        errors.append(max(np.max(np.abs(values - reference.values[part][rows])) for part, values in found.states.items()))
        assert found.work["jacobian"] % 2 == 0 < found.work["residual"] > found.steps > 5
    assert errors[1] < 1e-7 < errors[0] < 1e-1


@pytest.mark.parametrize(
    ("problem", "more", "sentence"),
    [("pendulum_chain", {"algebra": "arrays"}, "use ida:index1"), ("lotka_volterra", {}, "is for constrained problems")],
    ids=["chain", "poisson"],
)
def test_what_it_cannot_solve_is_refused(problem, more, sentence, monkeypatch):
    monkeypatch.setattr(drive, "find_spec", lambda name: True)
    with pytest.raises(BadInput, match=sentence):
        run.run(problem, method="solve_dae:Radau", tol=1e-6, t_end=1.0, **more)


def test_bad_input_is_one_sentence(daebench, monkeypatch):
    monkeypatch.setattr(drive, "find_spec", lambda name: None)
    words = ("run", "planar_pendulum", "--case", "rotating", "--t-end", 1, "--tol", 1e-6, "--method")
    for method, told in {"solve_dae:Radau": "pip install 'daebench[peers]'", "solve_dae:BDF": "known: Radau"}.items():
        status, out, err = daebench(*words, method)
        assert (status, out, err.count("\n")) == (2, "", 1)
        assert told in err

"""A step lands on the motion's own branch of g = 0, or is named: against the branch that own code follows from h = 0."""

from dataclasses import replace

import numpy as np
import pytest
from branches import continued, followed, lobatto3_continued
from ivps import ivp
from measures import error_of
from planted import plant

from daebench.methods.fixed_step.constrained import FixedStep
from daebench.methods.initial_value_problem import initial_value_problem
from daebench.runs.request import Request

SCHEMES = ["rattle", "symplectic_euler", "symplectic_euler_adjoint"]
MECHANISMS = {
    "pendulum": ("planar_pendulum", {}),
    "torus": ("torus", {}),
    "light-end": ("double_pendulum", {"mass1": 1000.0}),
    "light-middle": ("double_pendulum", {"mass2": 1000.0}),
    "spring": ("four_bar_spring", {"stiffness": 1000.0}),
    "water": ("rigid_water", {}),
    "wishbone": ("double_wishbone", {}),
    "heavy-wheel": ("double_wishbone", {"wheel_mass": 200.0}),
}
SHARES = (0.02, 0.2, 0.6, 1.2)
"""Step sizes in the time in which a motion passes its own length."""

NAMED = "ends on another branch of g = 0 than the one on which the motion goes on from there; use a smaller h"
OMEGA = 27.541
"""Frequency of the suspension's small oscillations, rad/s: that of its reduced mass and stiffness, by second differences of H on g = 0."""

AT_REST = (
    *(0.009684640101318405, 0.7289732612084602, -0.16198367614989972),
    *(-0.009610178128284253, 0.6909149630607166, 0.148305343848527),
    *(-0.12993161753881347, 0.6093200323276361, -0.07093201267823404),
)
"""A start at rest, a millimetre from the equilibrium, where the spring carries the wheel."""


def step(name, where, h, steps=1, **options):
    method = FixedStep(name, compiled=False, options=options)
    return method.solve(replace(where, on_singular="continue"), Request(value=h, steps=steps, every=1, watch=()))


def starts(place, momenta=3):
    """Yield starts of a mechanism with random momenta, at rest, slow and fast, and the time in which it passes its length."""
    problem, parameters = MECHANISMS[place]
    loaded = {"p0": (0.0,) * 9, "q0": AT_REST} if problem == "double_wishbone" else {}
    still = initial_value_problem(problem, None, parameters, **loaded)
    rng = np.random.default_rng(3)
    q = np.asarray(still.q0)
    size, inverse_mass, G = np.abs(q).max(), np.asarray(still.value("H_pp", still.p0, q)), np.asarray(still.value("G", q))
    v, a = still.value("H_p", still.p0, q), inverse_mass @ still.value("H_q", still.p0, q)
    time = 1 / max(np.abs(v).max() / size, np.sqrt(np.abs(a).max() / size))
    for speed in (0.0, 0.1, 1.0, 1.0)[:momenta]:
        p = np.linalg.solve(inverse_mass, rng.standard_normal(len(q)))
        p -= G.T @ np.linalg.solve(G @ inverse_mass @ G.T, G @ inverse_mass @ p)
        p *= speed * size / time / np.abs(inverse_mass @ p).max()
        yield initial_value_problem(still, p0=p, q0=q, project=True), time


def one_scheme_each(places, left_out=()):
    """Sweep schemes over places: on the day of a release all pairs, else one scheme after another over places that are not left out."""
    pairs = [
        (place, name, j == i % len(SCHEMES) and place not in left_out) for i, place in enumerate(places) for j, name in enumerate(SCHEMES)
    ]
    marked = [pytest.param(place, name, id=f"{place}-{name}", marks=[pytest.mark.exhaustive] * (not now)) for place, name, now in pairs]
    return pytest.mark.parametrize(("place", "name"), marked)


@one_scheme_each(MECHANISMS, left_out=("heavy-wheel", "light-middle", "water"))
def test_a_step_is_the_root_that_continues_from_small_h(place, name):
    right = 0
    for where, time in starts(place):
        for share in SHARES:
            expected = continued(name, where, share * time)
            if expected is not None:  # else the branch has an end before h
                run = step(name, where, share * time)
                assert run.failure is None
                assert error_of(run.q[-1], expected) < 1e-7 * np.abs(expected).max()
                right += 1
    assert right >= 6


@one_scheme_each(["pendulum", "torus", "light-end"], left_out=("light-end",))
def test_a_step_beyond_the_end_of_its_branch_is_refused(place, name):
    beyond = 0
    for where, time in starts(place, 4):
        for share in (1.3, 1.5, 1.7, 1.95, 2.2):
            if continued(name, where, share * time) is None:
                assert step(name, where, share * time).failure is not None, share
                beyond += 1
    assert beyond >= 6


@one_scheme_each(["stretched-H", "stretched-M"])
def test_a_step_of_any_hamiltonian_is_the_root_that_continues_from_small_h(place, name):
    where = ivp(place)
    time = np.abs(where.q0).max() / np.abs(where.value("H_p", where.p0, where.q0)).max()
    for share in (0.05, 0.2):
        expected = followed(name, where, share * time)
        run = step(name, where, share * time).complete()
        assert error_of(run.q[-1], expected) < 1e-6 * np.abs(expected).max()


@pytest.mark.sampled(left_out=("rattle_ilves",))
@pytest.mark.parametrize("name", ["rattle", "symplectic_euler", "rattle_ilves", "shake"], ids=str)
def test_a_suspension_at_rest_stays_where_it_is_up_to_the_limit_of_stability(name):
    start = initial_value_problem("double_wishbone", p0=(0.0,) * 9, q0=AT_REST)
    for share in (0.2, 1.5, 1.95):
        run = step(name, start, share / OMEGA, 12).complete()
        widest = 1 / np.sqrt(1 - share**2 / 4) if name == "symplectic_euler" else 1.0  # its conserved ellipse is tilted
        assert error_of(run.q, np.array(AT_REST)) < 1.01e-3 * (1 + widest), share


@pytest.mark.sampled(left_out=("ilves-heavy",))
@pytest.mark.parametrize(
    ("name", "wheel"),
    [("rattle_ilves", 20.0), ("rattle_ilves", 200.0), ("rattle_gauss_seidel", 20.0)],
    ids=["ilves", "ilves-heavy", "gauss-seidel"],
)
def test_solvers_of_molecular_dynamics_reach_the_root_of_rattle(name, wheel):
    start = initial_value_problem("double_wishbone", None, {"wheel_mass": wheel}, p0=(0.0,) * 9, q0=AT_REST)
    loose, fine = (step(scheme, start, 0.06, **options).complete() for scheme, options in ((name, {"tolerance": 1e-9}), ("rattle", {})))
    assert error_of(loose.q[-1], fine.q[-1]) < 1e-6


def gauss_seidel(place):
    """Yield the failure, None where the root is the one that continues from small h, of each step of Gauss-Seidel iteration."""
    for where, time in starts(place):
        for share in SHARES:
            expected = continued("rattle", where, share * time)
            if expected is not None:
                run = step("rattle_gauss_seidel", where, share * time, tolerance=1e-9)
                assert run.failure or error_of(run.q[-1], expected) < 1e-5 * np.abs(expected).max()
                yield run.failure


SOLVED = {"pendulum": 11, "torus": 10, "spring": 9, "wishbone": 10}
"""Steps whose branch goes on up to h: bodies at rest are among them, and forces that constraints balance."""


@pytest.mark.sampled(left_out=("pendulum", "spring"))
@pytest.mark.parametrize(("place", "steps"), SOLVED.items(), ids=SOLVED)
def test_gauss_seidel_iteration_reaches_the_own_root_and_does_not_call_it_another(place, steps):
    assert list(gauss_seidel(place)) == [None] * steps


LOBATTO3 = {"pendulum": (9, 0), "torus": (7, 2)}
"""Steps of lobatto3 on their own branch, and steps whose iteration ends on another one."""


@pytest.mark.sampled(left_out=("pendulum",))
@pytest.mark.parametrize(("place", "counts"), LOBATTO3.items(), ids=LOBATTO3)
def test_a_step_of_lobatto3_is_the_root_that_continues_from_small_h_or_is_named(place, counts):
    right = named = 0
    for where, time in starts(place):
        for share in (0.6, 1.05, 1.1):
            expected = lobatto3_continued(where, share * time)
            if expected is None:
                continue
            run = step("lobatto3", where, share * time)
            assert run.failure is None or NAMED in run.failure
            assert run.failure or error_of(run.q[-1], expected) < 1e-7 * np.abs(expected).max()
            right, named = right + (run.failure is None), named + (run.failure is not None)
    assert (right, named) == counts


@pytest.mark.sampled(by=lambda case: case in ("rattle-stretched-H", "lobatto2-spherical-fast", "lobatto3-relativistic"))
@pytest.mark.parametrize("place", ["spherical-fast", "stretched-H", "relativistic"], ids=str)
@pytest.mark.parametrize("name", ["rattle", *(f"lobatto{s}" for s in range(2, 7))], ids=str)
def test_every_walk_of_a_right_step_ends_where_the_step_does(name, place, monkeypatch, tmp_path):
    plant(monkeypatch, tmp_path, "schemes.kernels.branch", "return min(far - near, excess)", "return 1.0 + 0 * min(far - near, excess)")
    for h in (0.01, 0.1):
        assert step(name, ivp(place), h, 3).failure is None


# ---- the old start, planted ----------------------------------------------------------------------------------------------


@pytest.mark.sampled(left_out=("spring", "heavy-wheel"))
@pytest.mark.parametrize("place", ["spring", "wishbone", "heavy-wheel"], ids=str)
def test_a_root_of_another_branch_is_named_and_not_silent(place, monkeypatch, tmp_path):
    plant(
        monkeypatch,
        tmp_path,
        "schemes.kernels.constrain",
        "newton(update_position, (tangent, nu0),",
        "newton(update_position, (tangent + V.T @ nu0, 0 * nu0),",
    )
    named = 0
    for where, time in starts(place, 2):
        for share in SHARES:
            run = step("rattle", where, share * time)
            named += NAMED in (run.failure or "")
            if run.failure is None and (expected := continued("rattle", where, share * time)) is not None:
                assert error_of(run.q[-1], expected) < 1e-7, share
    assert named >= 1

"""Every formulation of every kind of problem, against equations of motion written by hand. Functions run uncompiled unless said."""

import dataclasses
from functools import cache

import numpy as np
import pytest
import uncompiled
from oracles import solution
from scenes import SCENES, scene

from daebench import pose as posing
from daebench import residuals
from daebench.elimination import SINGULAR, eliminate
from daebench.equations import Equations
from daebench.errors import BadInput, DaebenchError
from daebench.method import Request
from daebench.pose import FORMULATIONS, pose
from daebench.reference.ida import Ida
from daebench.scene import make_scene, source_of

POSED = [(f, "plain") for f in FORMULATIONS] + [(f, "derivative") for f in FORMULATIONS if f != "ode"]
POSED_IDS = ["-".join(posed) for posed in POSED]
OTHERS, INDEX3 = 1e-4, 2e-2
"""Bounds of the state error at t = 2 and tol = 1e-8, about three times the worst that was measured: on spherical-fast, where p is 7."""


@pytest.fixture(autouse=True)
def plain_functions(monkeypatch, request):
    if "compiled" not in request.fixturenames:
        monkeypatch.setattr(posing, "_module", uncompiled.kept_module)


@pytest.fixture
def compiled():
    """Asked for by tests that want numba's functions."""


@pytest.fixture(params=FORMULATIONS, ids=FORMULATIONS)
def formulation(request):
    return request.param


@pytest.fixture(params=POSED, ids=POSED_IDS)
def posed(request):
    return request.param


# ---- measures, which the planted faults below must upset -----------------------------------------------------------------


def residual(dae, y, yp):
    res = np.empty(dae.n)
    dae.residual(0.0, y, yp, res, dae.par)
    return res


def start_defect(dae):
    """Return the largest residual at the initial values, relative to the largest rate."""
    return np.abs(residual(dae, dae.y0, dae.yp0)).max() / max(1.0, np.abs(dae.yp0).max())


def multiplier_defect(dae):
    """Return how far the initial multiplier is from the one of HLW (1.12), as the kernels of the schemes have it."""
    lam = dae.scene.value("lam", dae.scene.p0, dae.scene.q0)
    return np.abs(dae.raw_multipliers(dae.y0[None], dae.yp0[None])[0] - lam).max() / max(1.0, np.abs(lam).max())


def somewhere(dae):
    """Return unknowns and rates off the manifold, where no term vanishes."""
    rng = np.random.default_rng(20)
    y, yp = dae.y0 + 0.1 * rng.uniform(-1, 1, dae.n), dae.yp0 + rng.uniform(-1, 1, dae.n)
    return y, yp


def differences(f, x, h=3e-3):
    """Return the Jacobian of f at x by central differences of order 6."""
    weights = {1: 3 / 4, 2: -3 / 20, 3: 1 / 60}
    columns = []
    for e in np.eye(len(x)):
        columns.append(sum(w * (f(x + k * h * e) - f(x - k * h * e)) for k, w in weights.items()) / h)
    return np.array(columns).T


def jacobian_defect(dae, cj=1.7):
    """Return the largest error of dF/dy + cj dF/dy', relative to its largest entry."""
    y, yp = somewhere(dae)
    JJ = np.full((dae.n, dae.n), np.nan)
    dae.jacobian(0.0, y, yp, np.empty(dae.n), cj, JJ, dae.par)
    found = differences(lambda x: residual(dae, x, yp), y) + cj * differences(lambda x: residual(dae, y, x), yp)
    return np.abs(JJ - found).max() / np.abs(found).max()


def state_error(name, formulation, tol=1e-8):
    trajectory = Ida(formulation).solve(scene(name), Request(value=tol, t_end=2.0, points=3, watch=())).complete()
    q, p = solution(name, 2.0)
    return max(np.abs(trajectory.q[-1] - q).max(), np.abs(trajectory.p[-1] - p).max())


# ---- the sweep -----------------------------------------------------------------------------------------------------------


def test_residual_vanishes_at_the_start(each_scene, posed):
    assert start_defect(pose(each_scene, posed[0], multipliers=posed[1])) < 1e-13


def test_multiplier_at_the_start_is_that_of_the_hidden_constraint(each_scene, posed):
    if posed[0] != "ode":
        assert multiplier_defect(pose(each_scene, posed[0], multipliers=posed[1])) < 1e-14


def test_jacobian_is_the_derivative_of_the_residual(each_scene, posed):
    assert jacobian_defect(pose(each_scene, posed[0], multipliers=posed[1])) < 1e-10


def test_right_side_of_the_ode_has_the_jacobian_that_is_claimed(each_scene):
    dae = pose(each_scene, "ode")
    y, _ = somewhere(dae)
    JJ = np.full((dae.n, dae.n), np.nan)
    dae.rhs_jacobian(0.0, y, JJ, dae.par)

    def rhs(x):
        out = np.empty(dae.n)
        dae.rhs(0.0, x, out, dae.par)
        return out

    assert np.abs(JJ - differences(rhs, y)).max() < 1e-10 * np.abs(JJ).max()


@pytest.mark.parametrize("name", SCENES)
def test_ida_follows_the_motion_written_by_hand(name, formulation):
    assert state_error(name, formulation) < (INDEX3 if formulation == "index3" else OTHERS)


def test_mass_matrix_and_hamiltonian_give_the_same_motion(formulation):
    request = Request(value=1e-10, t_end=2.0, points=5)
    one, other = (Ida(formulation).solve(scene(name), request).complete() for name in ("stretched-M", "stretched-H"))
    bound = 5e-6 if formulation == "index3" else 1e-7
    assert max(np.abs(one.q - other.q).max(), np.abs(one.p - other.p).max()) < bound


# ---- what the record holds -----------------------------------------------------------------------------------------------


def test_momenta_of_the_start_come_back(each_scene, formulation):
    dae = pose(each_scene, formulation)
    q, p = dae.unpack(dae.y0[None])
    assert np.array_equal(q[0], each_scene.q0)
    assert np.allclose(dae.momenta(q, p)[0], each_scene.p0, rtol=0, atol=1e-14 * np.abs(each_scene.p0).max())


def test_blocks_cover_all_unknowns(each_scene, formulation):
    dae = pose(each_scene, formulation)
    assert np.array_equal(np.concatenate([np.arange(dae.n)[block] for block in dae.blocks.values()]), np.arange(dae.n))
    assert list(dae.blocks)[2:] == {"ode": [], "ggl": ["lam", "mu"]}.get(formulation, ["lam"])


def baumgarte_defect():
    """Return the error of the rows that Baumgarte's numbers, each 10, add to index 1: 20 G v + 100 g."""
    index1, default = (pose(scene("coupled-rods"), name) for name in ("index1", "baumgarte"))
    y, yp = somewhere(index1)
    q, v = y[: index1.d], y[index1.d : 2 * index1.d]
    added = 20 * index1.scene.value("G", q) @ v + 100 * index1.scene.value("g", q)
    return np.abs((residual(default, y, yp) - residual(index1, y, yp))[-2:] - added).max() / np.abs(added).max()


def test_baumgarte_adds_both_constraints_to_the_hidden_one():
    assert baumgarte_defect() < 1e-14


def test_baumgarte_numbers_are_run_time_data():
    weak, default = (pose(scene("coupled-rods"), "baumgarte", options) for options in ({"alpha": 0, "beta": 0}, None))
    index1 = pose(scene("coupled-rods"), "index1")
    y, yp = somewhere(index1)
    assert weak.module is default.module
    assert np.allclose(residual(weak, y, yp), residual(index1, y, yp), rtol=0, atol=1e-13)


def test_unknown_names_are_refused_with_the_nearest():
    with pytest.raises(BadInput, match="did you mean index2 or"):
        pose(scene("planar"), "indx2")
    with pytest.raises(BadInput, match="option of index1"):
        pose(scene("planar"), "index1", {"alpha": 1.0})
    with pytest.raises(BadInput, match="at least 0"):
        pose(scene("planar"), "baumgarte", {"alpha": -1.0})


def changed(**parts):
    problem = dataclasses.replace(scene("spherical-slow").source.define(), **parts)
    return make_scene(source_of(problem, "changed"), "fig1.1")


def test_redundant_constraints_are_an_error_at_the_start(formulation):
    g = scene("spherical-slow").source.define().g[0]
    with pytest.raises(DaebenchError, match=r"G M\^-1 G\^T is singular there .* remove redundant constraints"):
        pose(changed(g=[g, 3 * g], chart=None), formulation)


def test_a_massless_coordinate_is_an_error_at_the_start(formulation):
    M = scene("spherical-slow").source.define().M.copy()
    M[0, 0] = 0
    with pytest.raises(DaebenchError, match="mass matrix"):
        pose(changed(M=M), formulation)


def test_right_side_tells_of_rank_loss():
    dae = pose(scene("spherical-slow"), "ode")
    y = dae.y0.copy()
    y[:3] = 0.0
    assert not dae.rhs(0.0, y, np.empty(6), dae.par) > SINGULAR


# ---- elimination ---------------------------------------------------------------------------------------------------------


def test_elimination_solves_and_does_not_mind_how_rows_and_columns_are_scaled():
    rng = np.random.default_rng(3)
    A, B = rng.normal(size=(6, 6)), rng.normal(size=(6, 2))
    scaled = np.diag(10.0 ** np.arange(-12, 12, 4)) @ A @ np.diag(10.0 ** np.arange(12, -12, -4))
    X, pivot = B.copy(), eliminate(A.copy(), B.copy())
    eliminate(A.copy(), X)
    assert np.allclose(A @ X, B, rtol=0, atol=1e-13)
    assert eliminate(scaled, B.copy()) > 1e-3 * pivot


def test_elimination_tells_a_singular_matrix_from_a_badly_scaled_one():
    rng = np.random.default_rng(4)
    A = rng.normal(size=(5, 5))
    A[4] = A[:4].T @ rng.normal(size=4)
    assert eliminate(A, np.ones((5, 1))) < SINGULAR
    assert eliminate(np.array([[1e8, 0, 1.0], [0, 1e-8, 1.0], [1.0, 1.0, 0]]), np.ones((3, 1))) > 0.1
    assert not eliminate(np.array([[np.nan, 1.0], [1.0, 0.0]]), np.ones((2, 1))) > SINGULAR


# ---- compiled functions --------------------------------------------------------------------------------------------------


@pytest.mark.usefixtures("compiled")
def test_compiled_functions_give_what_the_uncompiled_give(formulation):
    fast = scene("spherical-fast")
    dae = pose(fast, formulation)
    plain = dataclasses.replace(dae, module=uncompiled.kept_module(fast, formulation, "plain"))
    y, yp = somewhere(dae)
    assert np.allclose(residual(dae, y, yp), residual(plain, y, yp), rtol=0, atol=1e-13 * np.abs(y).max() ** 2)
    J, K = (np.full((dae.n, dae.n), np.nan) for _ in range(2))
    for each, JJ in ((dae, J), (plain, K)):
        assert each.jacobian(0.0, y, yp, np.empty(dae.n), 2.5, JJ, each.par) > SINGULAR
    assert np.allclose(J, K, rtol=0, atol=1e-13 * np.abs(K).max())


# ---- tight tolerances on the fast spherical pendulum, compiled -----------------------------------------------------------


@cache
def fast_truth(t_end):
    """Positions of spherical_pendulum fig1.2 from its angles: th'' = sin th cos th phi'^2 + sin th, sin^2 th phi' constant."""
    from scipy.integrate import solve_ivp

    L = 6.5 * np.sin(1.3)

    def f(_, x):
        turn = L / np.sin(x[0]) ** 2
        return [x[1], np.sin(x[0]) * np.cos(x[0]) * turn**2 + np.sin(x[0]), turn]

    times = np.linspace(0.0, t_end, 201)
    th, _, phi = solve_ivp(f, (0.0, t_end), [1.3, 3.0, 0.0], method="DOP853", rtol=3e-14, atol=1e-14, t_eval=times).y
    return np.stack([np.sin(th) * np.cos(phi), np.sin(th) * np.sin(phi), np.cos(th)], axis=1)


def fast_error(method, tol):
    from daebench.catalogue import find_scene

    trajectory = method.solve(find_scene("spherical_pendulum", "fig1.2"), Request(value=tol, t_end=10.0, watch=())).complete()
    return np.abs(trajectory.q - fast_truth(10.0)).max()


@pytest.mark.usefixtures("compiled")
@pytest.mark.parametrize(("variant", "bound"), [("index2", 5e-5), ("index1", 1e-3), ("ggl", 5e-4), ("baumgarte", 3e-4), ("ode", 3e-3)])
def test_error_on_the_fast_pendulum_at_a_tolerance_of_1e_8(variant, bound):
    assert fast_error(Ida(variant), 1e-8) < bound


MEASURED = [
    ("index2", 1e-12, 2e-9),
    ("index2", 1e-14, 3e-11),
    ("ggl", 1e-12, 1.3e-8),
    ("ggl", 1e-14, 3e-10),
    ("index1", 1e-12, 6e-7),
    ("index1", 1e-14, 2e-8),
    ("index3", 1e-12, 3e-5),
]
BOTH_WAYS = ("ggl", "index1")
"""Where round-off does not decide the steps, the error is met from below too; index 2 and 3 were seen to vary by a factor 5."""


@pytest.mark.slow
@pytest.mark.usefixtures("compiled")
@pytest.mark.parametrize(("variant", "tol", "measured"), MEASURED, ids=[f"{v}-{t:g}" for v, t, _ in MEASURED])
def test_tight_tolerances_deliver_what_was_measured_before(variant, tol, measured):
    error = fast_error(Ida(variant), tol)
    assert error < 3 * measured
    assert variant not in BOTH_WAYS or error > measured / 3


# ---- planted faults ------------------------------------------------------------------------------------------------------


@pytest.fixture
def plant(monkeypatch):
    """Replace a part of ``Equations`` by its negative or another, in modules made afresh."""
    monkeypatch.setattr(posing, "_module", uncompiled.module)

    def put(name, fault):
        right = getattr(Equations, name)
        get = right.fget if isinstance(right, property) else right
        wrong = (lambda self: fault(self, get(self))) if isinstance(right, property) else (lambda self, *a: fault(self, get(self, *a)))
        monkeypatch.setattr(Equations, name, property(wrong) if isinstance(right, property) else wrong)

    return put


def test_planted_wrong_sign_of_the_velocity_shows_in_the_residual_at_the_start(plant):
    plant("positions", lambda self, rows: rows + 2 * self.velocity)
    assert start_defect(pose(scene("spherical-fast"), "index3")) > 1e-2


def test_planted_wrong_sign_of_the_curvature_term_shows_in_the_multiplier(plant):
    plant("second", lambda self, rows: rows - 2 * self.of.g_qv * self.of.v)
    assert multiplier_defect(pose(scene("spherical-fast"), "index2")) > 1e-2


def test_planted_wrong_sign_of_the_velocity_terms_shows_in_the_motion(plant):
    plant("momenta", lambda self, rows: rows - 2 * self.of.c)
    assert start_defect(pose(scene("stretched-M"), "index2")) < 1e-14
    assert state_error("stretched-M", "index2") > 10 * OTHERS


def test_planted_wrong_sign_of_the_multiplier_shows_in_its_value(plant):
    plant("momenta", lambda self, rows: rows - 2 * self.of.G.T * self.of.lam)
    assert multiplier_defect(pose(scene("coupled-rods"), "index2")) > 1e-2


def test_planted_half_of_the_velocity_constraint_shows_in_the_rows_of_baumgarte(plant):
    plant("first", lambda self, rows: rows / 2)
    assert baumgarte_defect() > 0.1


@pytest.mark.parametrize("array", ["JJ", "E_y"])
def test_planted_wrong_entry_of_a_jacobian_shows_in_its_defect(plant, monkeypatch, array):
    right = residuals.writer

    def wrong(name, inputs, outputs, parameters):
        if array in outputs:
            matrix = outputs[array].copy()
            matrix[0, 0] += 1
            outputs = {**outputs, array: matrix}
        return right(name, inputs, outputs, parameters)

    monkeypatch.setattr(residuals, "writer", wrong)
    assert jacobian_defect(pose(scene("coupled-rods"), "ode" if array == "E_y" else "ggl")) > 1e-3

"""The row of four-bar linkages against bars and a pendulum written out by hand, published numbers, and its certificate across rank loss."""

import shutil

import mpmath as mp
import numpy as np
import pytest
from kept_stages import computations
from measures import differences, error_of
from refusals import refused
from scipy.integrate import solve_ivp
from tampered import altered, nudged

from daebench.errors import RunFailed
from daebench.methods.initial_value_problem import initial_value_problem
from daebench.methods.names import parse
from daebench.problems.four_bar import closed_form
from daebench.reference.check.independent_runs import method_of
from daebench.reference.check.invariants import Stored, checks
from daebench.reference.check.verify import _outside
from daebench.reference.keep import store
from daebench.reference.keep.definition import Definition, define
from daebench.reference.keep.dense_evaluation import states_at
from daebench.reference.make import build as building
from daebench.reference.make import independent_computations
from daebench.reference.make.build import certified_text
from daebench.reference.make.certify import certify
from daebench.reference.make.constrained import Functions
from daebench.reference.make.stages import Stages
from daebench.runs.local_flow import enter, leave
from daebench.runs.request import Request

NAME = "four_bar-iftomm"
ONES = {"mass": 1.0, "length": 1.0, "gravity": 9.81}
UNITS = {"mass": 0.7, "length": 2.5, "gravity": 9.81}
FIRST = 0.714355529
"""First passage of the horizontal, s; published as 0.71."""


def ivp(bars=2, case="iftomm", **parameters):
    return initial_value_problem("four_bar", case, {"bars": bars, **parameters})


def shares(bars, mass):
    """Return the momentum of each upright's end, where all ends move with velocity 1: by p = dT/dv, summed over the bars that end there."""
    found = np.full(bars + 1, mass / 3)  # of the uprights, whose other end is at rest
    for i in range(bars):
        found[[i, i + 1]] += mass / 2
    return found


def by_hand(bars, mass, length, gravity):
    """Return the moment of inertia about the pivots and the weight's moment, a bar at a time, of all uprights in parallel."""
    inertia = (bars + 1) * mass * length**2 / 3 + bars * mass * length**2
    return inertia, gravity * ((bars + 1) * mass * length / 2 + bars * mass * length)


def swung(theta0, omega0, bars, t, events=None, dense_output=False, **units):
    """Return the solution of the pendulum of the parallel motion from an angle and its rate."""
    inertia, weight = by_hand(bars, **units)

    def f(_, x):
        return [x[1], -weight / inertia * np.sin(x[0])]

    return solve_ivp(f, (0, t), [theta0, omega0], method="DOP853", rtol=1e-13, atol=1e-14, events=events, dense_output=dense_output)


def started(theta, omega, bars, mass, length, **_):
    """Return q and p of all uprights at an angle from hanging and a rate."""
    B = np.array([np.sin(theta), -np.cos(theta)]) * length
    q = np.concatenate([B + np.array([i * length, 0]) for i in range(bars + 1)])
    v = omega * length * np.array([np.cos(theta), np.sin(theta)])
    return q, np.concatenate([share * v for share in shares(bars, mass)])


@pytest.mark.parametrize("bars", [1, 2])
def test_energy_and_constraints_are_those_of_the_bars(bars, random):
    where, (m, length, gravity) = ivp(bars, **UNITS), UNITS.values()
    pivots = length * np.arange(bars + 1)[:, None] * [1, 0]
    q, v = random.normal(size=(2, 2 * bars + 2))

    def ends(B, A):
        """Return both ends of the uprights and then of the couplers, or their velocities."""
        B = B.reshape(-1, 2)
        return np.vstack([A, B[:-1]]), np.vstack([B, B[1:]])

    def kinetic(v):
        a, b = ends(v, 0 * pivots)
        return m / 6 * np.sum(a * a + a * b + b * b)

    (x, y), g = ends(q, pivots), where.value("g", q)
    energy = kinetic(v) + m * gravity * np.sum((x + y)[:, 1]) / 2
    assert float(where.value("H", differences(kinetic, v, 1.0), q)) == pytest.approx(energy, rel=1e-13)
    assert error_of([*g[::2], *g[1::2]], np.sum((y - x) ** 2, axis=1) - length**2) < 1e-12


def test_g_loses_rank_in_the_horizontal_and_nowhere_else():
    for bars in (1, 2):
        where = ivp(bars)
        for theta, rank in ((np.pi, 2 * bars + 1), (0.3, 2 * bars + 1), (np.pi / 2, bars + 1), (-np.pi / 2, bars + 1)):
            q, _ = started(theta, 0.0, bars, 1.0, 1.0)
            assert np.linalg.matrix_rank(where.value("G", q), tol=1e-9) == rank


# ---- the motion ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("theta", "omega"), [(np.pi, -1.0), (0.1, 0.0), (2.0, 3.0), (-0.7, 9.0)], ids=["over", "swing", "back", "fast"])
@pytest.mark.parametrize("bars", [1, 2, 5])
def test_the_closed_form_is_the_pendulum_that_all_bars_make_together(bars, theta, omega):
    q0, p0 = started(theta, omega, bars, **UNITS)
    found = swung(theta, omega, bars, 3.0, **UNITS)
    q, p = closed_form(3.0, list(q0), list(p0), UNITS)
    expected = started(*found.y[:, -1], bars, **UNITS)
    assert error_of(np.array(q, dtype=float), expected[0]) < 1e-10
    assert error_of(np.array(p, dtype=float), expected[1]) < 1e-9


@pytest.mark.slow
@pytest.mark.parametrize(
    ("h", "allowed"), [(0.01, 1e-1), pytest.param(0.002, 1e-3, marks=pytest.mark.exhaustive)], ids=["rough", "precise"]
)
def test_forty_linkages_go_through_twenty_singular_places_within_the_errors_of_the_benchmark(h, allowed):
    """IFToMM A02 with N = 40: 20 s, 400 outputs, and the errors of B_0 that the benchmark allows its two classes of runs."""
    where = ivp(40)
    run = parse("rattle").solve(where, Request(value=h, t_end=20.0, every=round(0.05 / h))).complete()
    truth = swung(np.pi, -1.0, 40, run.t[-1], events=horizontal, dense_output=True, **ONES)
    theta = truth.sol(run.t)[0]
    B = run.q.reshape(len(run.t), -1, 2)
    assert len(run.t) == 401
    assert error_of(B[:, 0], np.stack([np.sin(theta), -np.cos(theta)], axis=1)) < allowed
    assert error_of(B - B[:, :1], np.arange(41)[:, None] * [1.0, 0.0]) < 1e-12
    assert [each.branch for each in run.passages] == ["through"] * np.sum(np.diff(np.sign(np.cos(theta))) != 0)
    assert run.passages[0].t == pytest.approx(truth.t_events[0][0], abs=1e-3)


def test_the_closed_form_keeps_its_digits():
    definition, found = define("four_bar", "iftomm"), []
    for digits in (40, 60):
        with mp.workdps(digits):
            q0, p0 = definition.start_numbers()
            q, p = closed_form(100, q0, p0, definition.values())
            found.append([*q, *p])
    assert max(abs(a - b) for a, b in zip(*found, strict=True)) < 1e-35


@pytest.mark.parametrize("part", ["q", "p"])
def test_uprights_that_are_not_parallel_are_refused(part):
    q0, p0 = started(0.3, 1.0, 2, **UNITS)
    (q0 if part == "q" else p0)[4] += 1e-6
    with refused("four-bar-uprights-not-parallel"):
        closed_form(1.0, list(q0), list(p0), UNITS)


@pytest.mark.parametrize("theta", [0.1, np.pi / 2, 2.5, -np.pi / 2], ids=["low", "right", "high", "left"])
def test_the_chart_leads_to_the_manifold_and_back_through_the_horizontal(theta):
    where = ivp(2, **UNITS)
    p, q = leave(where)([0.8], [theta])
    expected = started(theta, 0.8, 2, **UNITS)
    assert error_of(q, expected[0]) < 1e-14
    assert error_of(p, expected[1]) < 1e-13
    assert error_of(np.ravel(enter(where)(p, q)), [0.8, theta]) < 1e-14


# ---- the certificate -----------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Certify the motion up to t = 1, with one rank loss and without runs of IDA, and return the folder it is stored in."""
    place = tmp_path_factory.mktemp("references")
    with pytest.MonkeyPatch.context() as patch, mp.workdps(80):
        patch.setattr(building, "ida_errors", lambda *_: [])
        times = [mp.mpf(k) / 8 for k in range(9)]
        found, text = certified_text(define("four_bar", "iftomm"), times, Stages(place / ".stages", "key", lambda stage: None))
        store.save(NAME, found | {"versions": {}}, text, place)
    return place


@pytest.fixture
def crossed(folder):
    return store.load(NAME, folder)


def test_the_certificate_says_that_rank_is_lost_and_when_and_where_the_truth_is(crossed):
    passed = swung(np.pi, -1.0, 2, 1.0, events=horizontal, **ONES).t_events[0]
    assert list(crossed.rank_losses) == pytest.approx(passed, abs=2e-9)
    assert list(crossed.rank_losses) == pytest.approx([FIRST], abs=2e-9)
    assert "minimal coordinates" in crossed.certificate["made"]["method"]
    assert len(crossed.certificate["made"]["checks"]) > 1
    assert method_of(crossed, crossed.ivp()) == "local:gauss4"


def test_stored_digits_are_those_of_a_pendulum_by_taylor_series(crossed):
    with mp.workdps(30):
        ratio = mp.mpf(7) / 6 * mp.mpf(981) / 100  # 3/2 + 2 weights, and 3/3 + 2 moments of inertia, of a bar
        theta, omega = mp.odefun(lambda _, x: [x[1], -ratio * mp.sin(x[0])], 0, [+mp.pi, mp.mpf(-1)])(mp.mpf(3) / 8)
        expected = {"q1": mp.sin(theta), "q6": -mp.cos(theta), "p4": mp.mpf(4) / 3 * omega * mp.sin(theta)}
        for name, value in expected.items():
            assert abs(mp.mpf(crossed.text[name][3]) - value) < 1e-26


def force_by_hand(q, p):
    """Return -(M q'' + U_q), the force G^T lam of the constraints, of the parallel motion with default numbers and two linkages."""
    B, P = q[:2], np.array([p[0::2].sum(), p[1::2].sum()])
    inertia, weight = by_hand(2, 1.0, 1.0, 9.81)
    v = P / shares(2, 1.0).sum()
    a = -weight / inertia * B[0] * np.array([-B[1], B[0]]) - v @ v * B
    return -np.concatenate([m * a + [0, 9.81 * w] for m, w in zip(shares(2, 1.0), (1.0, 1.5, 1.0), strict=True)])


def test_stored_multipliers_and_those_next_to_rank_loss_make_the_force_of_newtons_law(crossed):
    near = states_at(crossed, [FIRST - 1e-6, FIRST + 1e-9])
    rows = [*zip(crossed.q, crossed.p, crossed.lam, strict=True), *zip(*near.states.values(), strict=True)]
    for q, p, lam in rows:
        force = ivp().value("G", q).T @ lam
        assert error_of(force, force_by_hand(q, p)) < 1e-14 * max(30.0, np.abs(lam).max())
    assert np.abs(near.states["lam"][1]).max() > 1e7
    assert not near.stored.any()


def test_between_stored_times_states_lie_within_their_bounds(crossed):
    t = [0.3, FIRST + 0.01, 0.99]
    found = states_at(crossed, t)
    with mp.workdps(40):
        q0, p0 = define("four_bar", "iftomm").start_numbers()
        exact = [closed_form(mp.mpf(time), q0, p0, ONES | {"gravity": mp.mpf(981) / 100}) for time in t]
        for part, rows in zip("qp", zip(*exact, strict=True), strict=True):
            errors = np.abs(found.states[part] - np.array(rows)).astype(float)
            assert np.all(errors <= found.bound[part])
    assert max(rows.max() for rows in found.bound.values()) < 1e-12


def test_without_minimal_coordinates_rank_loss_is_refused(monkeypatch):
    monkeypatch.setattr(Definition, "crosses", False)
    monkeypatch.setattr(independent_computations, "MOST_STEPS", 500)
    with mp.workdps(80), refused("taylor-series-stopped", RunFailed, ["between t = 0.625 and 0.75"]):
        certify(computations("four_bar", "iftomm", 1, 8))


def horizontal(_, x):
    """Vanish where a pendulum is horizontal."""
    return np.cos(x[0])


def test_multipliers_where_there_are_none_are_refused_with_the_place():
    with refused("no-multipliers-there", RunFailed, ["(0.0, 0.0, 2.0,"]):
        Functions(define("four_bar", "iftomm")).lam([mp.mpf(x) for x in (0, 0, 2, 0, 3, 0)], [mp.mpf(0)] * 6)


def test_an_intact_certificate_holds_against_its_definition(crossed):
    assert [check for check in checks(Stored(crossed, define("four_bar", "iftomm"))) if not check.ok] == []


def setting(**changes):
    """Return an alteration of what a certificate says of the rank of G; without a value it says nothing."""

    def alter(claims):
        for name, change in changes.items():
            claims["rank"][name] = change(claims["rank"][name]) if callable(change) else change
            if change is None:
                del claims["rank"][name]

    return alter


ALTERED = {
    "no loss": (None, setting(lost=[]), "times of rank loss"),
    "late": (None, setting(lost=[FIRST + 1e-6]), "times of rank loss"),
    "one too many": (None, setting(lost=[FIRST, 0.9]), "times of rank loss"),
    "value": (None, setting(values=lambda rows: [*rows[:3], 2 * rows[3], *rows[4:]]), "singular values at the outputs"),
    "values": (None, setting(values=lambda rows: rows[:-1]), "rank.values"),
    "no values": (None, setting(values=None), "rank has no values"),
    "lam": (nudged("lam3", "1e-26", 6), None, "lam against lam(p, q)"),
    "q": (nudged("q4", "1e-28", 7), None, "drift of g"),
}


@pytest.mark.sampled(left_out=("late", "one too many", "value", "values", "no values"))
@pytest.mark.parametrize(("digits", "certificate", "seen"), ALTERED.values(), ids=ALTERED)
def test_what_is_altered_is_seen(folder, digits, certificate, seen, tmp_path):
    place = shutil.copytree(folder, tmp_path / "references")
    altered(NAME, place, digits, certificate)
    assert seen in faults(place)


def faults(folder):
    """Return what a reference in a folder fails: the sentence with which it is refused, or the checks that do not hold."""
    try:
        altered = store.load(NAME, folder)
    except store.Misshapen as error:
        return str(error)
    definition, outside = _outside(altered, asked=True)
    found = outside if not all(check.ok for check in outside) else checks(Stored(altered, definition))
    return "; ".join(check.what for check in found if not check.ok)

"""Solvers of constraints of molecular dynamics: against Newton's RATTLE, LINCS's radius against bonds by hand, and refusals."""

import itertools

import numpy as np
import pytest
from measures import error_of
from refusals import refused
from scipy.spatial.transform import Rotation

from daebench.compiler.constrained.distances import distances, is_water
from daebench.methods.fixed_step.constrained import FixedStep
from daebench.methods.fixed_step.constraint_structure import spectral_radius
from daebench.methods.initial_value_problem import initial_value_problem
from daebench.problems import butane, double_pendulum, rigid_body_rotation, rigid_water
from daebench.runs.request import Request

WATER, BUTANE, RING = ("rigid_water", "tumbling"), ("butane", "gauche"), ("cyclohexane_ring", "chair")
TIGHT = {"tolerance": 1e-15}
SOLVERS = {
    "gauss_seidel": ("rattle_gauss_seidel", TIGHT, 1e-12),
    "ilves": ("rattle_ilves", TIGHT, 1e-13),
    "lincs": ("rattle_lincs", {"order": 32, "iterations": 8}, 1e-12),
    "settle": ("rattle_settle", {}, 1e-13),
    "differences": ("rattle_settle", {"differences": 1}, 1e-12),
}
"""Each solver where it has converged, and by what its momenta may be off."""


def run(name, where, h=0.01, steps=30, **options):
    ivp = initial_value_problem(*where)
    return FixedStep(name, options=options, compiled=False).solve(ivp, Request(value=h, steps=steps, every=1)).complete()


CONVERGED = {
    WATER: ["gauss_seidel", "lincs", "settle", "differences"],
    BUTANE: ["lincs"],
    RING: ["ilves"],
}
"""Solvers on the molecules that they take, each solver once."""


@pytest.mark.sampled(left_out=("('cyclohexane_ring', 'chair')-ilves",))
@pytest.mark.parametrize(("where", "solver"), [(where, solver) for where, solvers in CONVERGED.items() for solver in solvers], ids=str)
def test_what_has_converged_is_rattle(where, solver):
    name, options, close = SOLVERS[solver]
    newton, other = run("rattle", where), run(name, where, **options)
    assert error_of(other.q, newton.q) < 1e-12
    assert error_of(other.p, newton.p) < close * max(1, np.abs(newton.p).max())


@pytest.mark.parametrize(("name", "options"), [("rattle_lincs", {"order": 2, "iterations": 1}), ("rattle_ilves", {"tolerance": 1e-3})])
def test_what_has_not_converged_is_another_motion(name, options):
    assert error_of(run(name, BUTANE, **options).q, run("rattle", BUTANE).q) > 1e-6


def test_settle_is_newton_from_a_thousand_states(random):
    ivp = initial_value_problem(*WATER)
    steps = []
    for name in ("rattle", "rattle_settle"):
        method = FixedStep(name, compiled=False)
        linked = method.linked(ivp, method.kernel(ivp, "float64", (), count=False, singular=""), 0.01)
        steps.append((linked.kernel.integrate, linked.par))
    worst = 0.0
    for _ in range(1000):
        q = (Rotation.random(random_state=random).apply(ivp.q0.reshape(3, 3)) + random.normal(size=3)).ravel()
        p = random.normal(size=9) * np.repeat([4.0, 1.0, 1.0], 3)
        h = random.uniform(0.002, 0.05)
        newton, settle = (one_step(*step, p, q, h) for step in steps)
        worst = max(worst, error_of(newton[1], settle[1]), h * error_of(newton[0], settle[0]))
    assert 0 < worst < 4e-13


def one_step(integrate, par, p, q, h):
    """Return the state after one step."""
    x, none = (tuple(p), tuple(q)), np.empty((0, 0))
    result = integrate(x, (), (), (), np.inf, h, np.array([]), 1, -1, 0, none, none, par)
    assert result[-1][0] == 0
    return np.array(result[0])


def by_hand(where, bonds):
    """Return the spectral radius of Hess's matrix from unit vectors along bonds (i, j) and masses, entry by entry."""
    ivp = initial_value_problem(*where)
    r, inverse = ivp.q0.reshape(-1, 3), np.diag(ivp.value("H_pp", ivp.p0, ivp.q0))[::3]
    B = [(r[j] - r[i]) / np.linalg.norm(r[j] - r[i]) / np.sqrt(inverse[i] + inverse[j]) for i, j in bonds]
    A = np.zeros((len(bonds), len(bonds)))
    for (k, one), (n, other) in itertools.permutations(enumerate(bonds), 2):
        for atom in {*one} & {*other}:
            sign = 1 if one.index(atom) == other.index(atom) else -1
            A[k, n] = -sign * inverse[atom] * (B[k] @ B[n])
    return np.abs(np.linalg.eigvalsh(A)).max()


BONDS = [(0, 1), (1, 2), (2, 3), (0, 2), (1, 3)]


@pytest.mark.parametrize("case", ["trans", "tumbling"])
def test_the_spectral_radius_is_that_of_the_bonds(case):
    where = "butane", case
    assert spectral_radius(initial_value_problem(*where)) == pytest.approx(by_hand(where, BONDS), abs=1e-12)
    assert 0.7 < by_hand(where, BONDS) < 0.95


def test_the_error_of_momenta_falls_by_the_square_of_the_spectral_radius_an_order():
    newton = run("rattle", BUTANE, steps=1)
    errors = [error_of(run("rattle_lincs", BUTANE, steps=1, order=n, iterations=1).p, newton.p) for n in (20, 30)]
    # momenta are corrected once more with the same expansion, so that what it leaves is left twice: 20 powers in 10 orders
    assert (errors[1] / errors[0]) ** (1 / 20) == pytest.approx(spectral_radius(initial_value_problem(*BUTANE)), abs=0.01)


def test_momenta_have_order_1_for_small_steps_with_a_factor_that_falls_with_the_terms_of_the_series():
    """What docs/how-to/molecules.md says of a chain."""
    chain, errors = ("pendulum_chain", "horizontal5"), {}
    exact = run("lobatto4", chain, 0.1 / 64, 64).p[-1]
    for order in (8, 32):
        coarse, errors[order] = (error_of(run("rattle_lincs", chain, 0.1 / n, n, order=order).p[-1], exact) for n in (256, 512))
        assert np.log2(coarse / errors[order]) == pytest.approx(1, abs=0.05)
    assert 300 < errors[8] / errors[32] < 600


def test_unprojected_momenta_leave_the_positions_of_shake():
    shake, half = run("shake", BUTANE), run("rattle_ilves", BUTANE, tolerance=1e-14, projected=0)
    assert error_of(half.q, shake.q) < 1e-11
    assert error_of(half.p, shake.p) > 1e-2


def test_distances_and_water_are_told_from_their_expressions():
    assert is_water(rigid_water.problem())
    assert not is_water(butane.problem())
    assert len(distances(butane.problem())) == 5
    assert distances(double_pendulum.problem()) is not None
    assert distances(rigid_body_rotation.problem()) is None


REFUSED = {
    "ring": ("rattle_lincs", RING, "radius is 1 at"),
    "boat": ("rattle_lincs", ("cyclohexane_ring", "boat"), "radius is 1.085 at"),
    "no distances": ("rattle_lincs", ("torus", None), "distances"),
    "no water": ("rattle_settle", BUTANE, "water"),
}


@pytest.mark.parametrize(("name", "where", "why"), REFUSED.values(), ids=REFUSED)
def test_a_problem_without_the_structure_is_refused_in_one_sentence(name, where, why):
    refusal = FixedStep(name).refusal(initial_value_problem(*where))
    assert why in refusal
    assert refusal.startswith(name)


BAD = {
    "tolerance in single": ("rattle_ilves", {}, "float32", "tolerance-below-round-off"),
    "tolerance in double": ("rattle_gauss_seidel", {"tolerance": 1e-17}, "float64", "tolerance-below-round-off"),
    "order": ("rattle_lincs", {"order": 2.5}, "float64", "lincs-number-out-of-range"),
    "iterations": ("rattle_lincs", {"iterations": 0}, "float64", "lincs-number-out-of-range"),
    "differences": ("rattle_settle", {"differences": 2}, "float64", "choice-not-zero-or-one"),
}


@pytest.mark.parametrize(("name", "options", "precision", "code"), BAD.values(), ids=BAD)
def test_a_bad_number_is_refused(name, options, precision, code):
    with refused(code):
        FixedStep(name, options=options).solve(initial_value_problem(*WATER), Request(value=0.01, steps=1, precision=precision))


# ---- SHAKE, by own code --------------------------------------------------------------------------------------------------


def shaken(where, h, tolerance):
    """Return q after one step: one constraint after another from the end of the free flight, until all hold; and the rounds of that."""
    p0, q0 = where.start
    inverse_mass, G0 = np.diag(np.asarray(where.value("H_pp", p0, q0))), np.asarray(where.value("G", q0))
    q = q0 + h * inverse_mass * (p0 - h / 2 * np.asarray(where.value("H_q", p0, q0)))
    bounds = tolerance * np.sum(np.abs(G0 * q), axis=1)
    for rounds in range(1, 1000):
        late = 0
        for k, bound in enumerate(bounds):
            value = np.asarray(where.value("g", q))[k]
            if abs(value) > bound:
                late += 1
                q = q - value / (np.asarray(where.value("G", q))[k] * inverse_mass @ G0[k]) * inverse_mass * G0[k]
        if not late:
            return q, rounds
    return q, 0


@pytest.mark.parametrize("tolerance", [1e-4, 1e-6])
@pytest.mark.parametrize("case", ["tumbling", "libration"])
def test_gauss_seidel_iteration_is_that_of_shake(case, tolerance):
    """The start decides what is left: from elsewhere positions differ by about the tolerance."""
    where = initial_value_problem("rigid_water", case)
    method = FixedStep("rattle_gauss_seidel", options={"tolerance": tolerance, "projected": 0}, compiled=False)
    done = method.solve(where, Request(value=0.02, steps=1, watch=()))
    q, rounds = shaken(where, 0.02, tolerance)
    assert rounds > 2
    np.testing.assert_allclose(done.q[-1], q, rtol=0, atol=1e-14)

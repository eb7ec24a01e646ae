"""The coefficients of compositions and Runge-Kutta methods, against their order conditions and closed forms at high precision."""

import dataclasses
import math
import subprocess
import sys
from fractions import Fraction

import mpmath as mp
import pytest

from daebench.compositions import COMPOSITIONS
from daebench.errors import BadInput
from daebench.tableaux import Tableau, gauss, lobatto_iiia, lobatto_iiib, radau_iia

# ---- compositions ---------------------------------------------------------------------------------------------------------

NAMES = list(COMPOSITIONS)
STAGES = {"triple_jump4": 3, "suzuki4": 5, "yoshida6": 7, "kahan_li6": 9, "suzuki_umeno8": 15, "kahan_li8": 17, "sofroniou_spaletta10": 35}

# The middle weights as published: they are not in the package, so that they tell whether the others were typed correctly.
MIDDLE = {
    "yoshida6": "1.31518632068391121888424973",
    "kahan_li6": "0.79854399093482996339895035",
    "suzuki_umeno8": "-0.79688793935291635401978884",
    "kahan_li8": "-0.60550853383003451169892108",
    "sofroniou_spaletta10": "0.04931773575959453791768001",
}

# Numbers published to 26 digits meet the conditions to 2e-25 at worst (yoshida6); the next condition fails by 1e-6 at least.
TOLERANCE = 1e-24


def words(weight):
    """Return the words of odd letters whose sum is the weight: products X_i X_j ... of the free associative algebra."""
    if weight == 0:
        return [()]
    return [(*word, letter) for letter in range(1, weight + 1, 2) for word in words(weight - letter)]


def product(weights, highest):
    """Return the coefficients of prod exp(gamma X_1 + gamma^3 X_3 + gamma^5 X_5 + ...) up to a weight.

    A symmetric map of order 2 or more is such an exponential with the exact X_1, and its other X_i are arbitrary. The coefficient of
    a word in one factor is gamma^weight / length!.
    """
    basis = [word for weight in range(highest + 1) for word in words(weight)]
    result = {word: mp.mpf(not word) for word in basis}
    for gamma in weights:
        result = {
            word: mp.fsum(result[word[:k]] * gamma ** sum(word[k:]) / math.factorial(len(word) - k) for k in range(len(word) + 1))
            for word in basis
        }
    return result


def defects(weights, highest):
    """Return how far the product is from exp(X_1), weight by weight from 1: zero below the order of the composition plus 1."""
    found = product(weights, highest)
    return [
        max(abs(found[word] - (mp.mpf(1) / math.factorial(weight) if set(word) == {1} else 0)) for word in words(weight))
        for weight in range(1, highest + 1)
    ]


def order(weights, highest):
    """Return the number of weights whose conditions hold, counted up to the first that fails."""
    return next((k for k, defect in enumerate(defects(weights, highest)) if defect > TOLERANCE), highest)


@pytest.fixture(autouse=True)
def _digits():
    with mp.workdps(40):
        yield


def test_the_compositions_are_those_named():
    assert {name: each.stages for name, each in COMPOSITIONS.items()} == STAGES
    assert all(len(each.weights) == STAGES[name] and each.name == name for name, each in COMPOSITIONS.items())


def test_the_order_conditions_know_the_order_of_the_plain_step_and_of_a_triple_jump_of_triple_jumps():
    inner = COMPOSITIONS["triple_jump4"].weights_to(40)
    outer = 1 / (2 - mp.root(2, 5))
    assert order([mp.mpf(1)], 5) == 2
    assert order([mp.mpf(1) / 3] * 3, 5) == 2
    assert order([gamma * delta for delta in (outer, 1 - 2 * outer, outer) for gamma in inner], 7) == 6


@pytest.mark.parametrize("name", NAMES, ids=str)
def test_a_composition_has_its_order_and_no_higher_one(name):
    composition = COMPOSITIONS[name]
    found = defects(composition.weights_to(40), composition.order + 1)
    assert max(found[:-1]) < TOLERANCE
    assert found[-1] > 1e-6


@pytest.mark.parametrize("name", NAMES, ids=str)
def test_the_rounded_weights_have_the_order_to_rounding(name):
    composition = COMPOSITIONS[name]
    found = defects([mp.mpf(weight) for weight in composition.weights], composition.order)
    assert max(found) < 2e-15


@pytest.mark.parametrize("name", NAMES, ids=str)
def test_a_wrong_digit_in_the_twentieth_place_is_noticed(name):
    composition = COMPOSITIONS[name]
    highest = min(composition.order, 5)
    for i, gamma in enumerate(composition.gamma):
        place = gamma.index(".") + 20
        wrong = gamma[:place] + str((int(gamma[place]) + 1) % 10) + gamma[place + 1 :]
        corrupted = dataclasses.replace(composition, gamma=(*composition.gamma[:i], wrong, *composition.gamma[i + 1 :]))
        assert order(corrupted.weights_to(40), highest) < highest, f"gamma_{i + 1}"


@pytest.mark.parametrize("name", list(MIDDLE), ids=str)
def test_weights_in_another_order_are_noticed(name):
    composition = COMPOSITIONS[name]
    first, second, *rest = composition.gamma
    exchanged = dataclasses.replace(composition, gamma=(second, first, *rest))
    assert order(exchanged.weights_to(40), composition.order) < composition.order


@pytest.mark.parametrize("name", NAMES, ids=str)
def test_the_weights_are_symmetric_and_their_sum_is_one(name):
    composition = COMPOSITIONS[name]
    half = composition.stages // 2
    for weights in (composition.weights, composition.weights_to(40)):
        assert weights == weights[::-1]
    assert abs(mp.fsum(composition.weights_to(40)) - 1) < 1e-39
    assert math.fsum(composition.weights) == 1.0
    error = abs(sum(map(Fraction, composition.weights)) - 1)
    assert error <= Fraction(math.ulp(composition.weights[half])) / 2


@pytest.mark.parametrize("name", NAMES, ids=str)
def test_the_weights_are_those_of_high_precision_rounded(name):
    composition = COMPOSITIONS[name]
    half = composition.stages // 2
    expected = [float(weight) for weight in composition.weights_to(40)]
    assert composition.weights[:half] == tuple(expected[:half])
    # the middle one makes up for the rounding of the others, each at most half a unit in the last place
    assert abs(composition.weights[half] - expected[half]) <= sum(map(math.ulp, expected))


@pytest.mark.parametrize("name", list(MIDDLE), ids=str)
def test_the_middle_weight_is_the_published_one(name):
    composition = COMPOSITIONS[name]
    # half a unit in the 26th place for itself and for each of the others
    assert abs(composition.weights_to(40)[composition.stages // 2] - mp.mpf(MIDDLE[name])) <= 0.5e-26 * composition.stages


def test_the_compositions_of_order_4_are_the_closed_forms():
    with mp.workdps(50):
        for name, root, n in (("triple_jump4", mp.cbrt(2), 2), ("suzuki4", mp.cbrt(4), 4)):
            assert all(abs(mp.mpf(gamma) - 1 / (n - root)) < 1e-48 for gamma in COMPOSITIONS[name].gamma)


# ---- tableaux -------------------------------------------------------------------------------------------------------------

FAMILIES = {"gauss": gauss, "radau_iia": radau_iia, "lobatto_iiia": lobatto_iiia, "lobatto_iiib": lobatto_iiib}
LEAST = {"gauss": 1, "radau_iia": 1, "lobatto_iiia": 2, "lobatto_iiib": 2}
TABLEAUX = [(family, s) for family in FAMILIES for s in range(LEAST[family], 9)]
SYMMETRIC = [each for each in TABLEAUX if each[0] != "radau_iia"]
PAIRS = [s for family, s in TABLEAUX if family == "lobatto_iiia"]
IDS = [f"{family}-{s}" for family, s in TABLEAUX]
DIGITS = 1e-30

# The simplifying assumptions B(p), C(eta), D(zeta) of each family, as functions of s.
ASSUMPTIONS = {
    "gauss": lambda s: (2 * s, s, s),
    "radau_iia": lambda s: (2 * s - 1, s, s - 1),
    "lobatto_iiia": lambda s: (2 * s - 2, s, s - 2),
    "lobatto_iiib": lambda s: (2 * s - 2, s - 2, s),
}


def distance(these, those):
    """Return the largest difference of two equally nested sequences of numbers."""
    if isinstance(these, Tableau):
        these, those = (dataclasses.astuple(each) for each in (these, those))
    if isinstance(these, tuple | list):
        return max(distance(a, b) for a, b in zip(these, those, strict=True))
    return abs(these - those)


def B(tableau, k):
    """Return the defect of sum_i b_i c_i^(k-1) = 1/k."""
    return abs(mp.fdot(tableau.b, [c ** (k - 1) for c in tableau.c]) - mp.mpf(1) / k)


def C(tableau, k):
    """Return the defect of sum_j a_ij c_j^(k-1) = c_i^k / k."""
    powers = [c ** (k - 1) for c in tableau.c]
    return max(abs(mp.fdot(row, powers) - c**k / k) for row, c in zip(tableau.A, tableau.c, strict=True))


def D(tableau, k):
    """Return the defect of sum_i b_i c_i^(k-1) a_ij = b_j (1 - c_j^k) / k."""
    powers = [b * c ** (k - 1) for b, c in zip(tableau.b, tableau.c, strict=True)]
    columns = zip(*tableau.A, strict=True)
    return max(abs(mp.fdot(a, powers) - b * (1 - c**k) / k) for a, b, c in zip(columns, tableau.b, tableau.c, strict=True))


def symplecticity(first, second):
    """Return the defect of b_i a^_ij + b_j a_ji = b_i b_j."""
    b, stages = first.b, range(len(first.b))
    return max(abs(b[i] * second.A[i][j] + b[j] * first.A[j][i] - b[i] * b[j]) for i in stages for j in stages)


def closed_forms():
    """Return tableaux as they stand in the books."""
    r3, r5, r6, r15 = map(mp.sqrt, (3, 5, 6, 15))
    half, one = mp.mpf(1) / 2, mp.mpf(1)
    lobatto3 = (one / 6, 2 * one / 3, one / 6), (0, half, 1)
    lobatto4 = (one / 12, 5 * one / 12, 5 * one / 12, one / 12), (0, (5 - r5) / 10, (5 + r5) / 10, 1)
    radau3_b = ((16 - r6) / 36, (16 + r6) / 36, one / 9)
    return {
        ("gauss", 1): (((half,),), (1,), (half,)),
        ("gauss", 2): (((one / 4, one / 4 - r3 / 6), (one / 4 + r3 / 6, one / 4)), (half, half), (half - r3 / 6, half + r3 / 6)),
        ("gauss", 3): (
            (
                (5 * one / 36, 2 * one / 9 - r15 / 15, 5 * one / 36 - r15 / 30),
                (5 * one / 36 + r15 / 24, 2 * one / 9, 5 * one / 36 - r15 / 24),
                (5 * one / 36 + r15 / 30, 2 * one / 9 + r15 / 15, 5 * one / 36),
            ),
            (5 * one / 18, 4 * one / 9, 5 * one / 18),
            (half - r15 / 10, half, half + r15 / 10),
        ),
        ("radau_iia", 1): (((1,),), (1,), (1,)),
        ("radau_iia", 2): (((5 * one / 12, -one / 12), (3 * one / 4, one / 4)), (3 * one / 4, one / 4), (one / 3, 1)),
        ("radau_iia", 3): (
            (
                ((88 - 7 * r6) / 360, (296 - 169 * r6) / 1800, (-2 + 3 * r6) / 225),
                ((296 + 169 * r6) / 1800, (88 + 7 * r6) / 360, (-2 - 3 * r6) / 225),
                radau3_b,
            ),
            radau3_b,
            ((4 - r6) / 10, (4 + r6) / 10, 1),
        ),
        ("lobatto_iiia", 2): (((0, 0), (half, half)), (half, half), (0, 1)),
        ("lobatto_iiia", 3): (((0, 0, 0), (5 * one / 24, one / 3, -one / 24), lobatto3[0]), *lobatto3),
        ("lobatto_iiia", 4): (
            (
                (0, 0, 0, 0),
                ((11 + r5) / 120, (25 - r5) / 120, (25 - 13 * r5) / 120, (-1 + r5) / 120),
                ((11 - r5) / 120, (25 + 13 * r5) / 120, (25 + r5) / 120, (-1 - r5) / 120),
                lobatto4[0],
            ),
            *lobatto4,
        ),
        ("lobatto_iiib", 2): (((half, 0), (half, 0)), (half, half), (0, 1)),
        ("lobatto_iiib", 3): (((one / 6, -one / 6, 0), (one / 6, one / 3, 0), (one / 6, 5 * one / 6, 0)), *lobatto3),
        ("lobatto_iiib", 4): (
            (
                (one / 12, (-1 - r5) / 24, (-1 + r5) / 24, 0),
                (one / 12, (25 + r5) / 120, (25 - 13 * r5) / 120, 0),
                (one / 12, (25 + 13 * r5) / 120, (25 - r5) / 120, 0),
                (one / 12, (11 - r5) / 24, (11 + r5) / 24, 0),
            ),
            *lobatto4,
        ),
    }


@pytest.mark.parametrize(("family", "s"), closed_forms(), ids=[f"{family}-{s}" for family, s in closed_forms()])
def test_a_tableau_is_the_one_in_the_books(family, s):
    assert distance(FAMILIES[family](s, digits=40), Tableau(*closed_forms()[family, s])) < 1e-39


@pytest.mark.parametrize(("family", "s"), TABLEAUX, ids=IDS)
def test_the_simplifying_assumptions_hold_as_far_as_they_should_and_no_farther(family, s):
    tableau = FAMILIES[family](s, digits=40)
    for assumption, highest in zip((B, C, D), ASSUMPTIONS[family](s), strict=True):
        assert max((assumption(tableau, k) for k in range(1, highest + 1)), default=0) < DIGITS
        # the quadrature error of Gauss with 8 nodes at degree 16 is 4e-11
        assert assumption(tableau, highest + 1) > 1e-12


@pytest.mark.parametrize(("family", "s"), TABLEAUX, ids=IDS)
def test_the_nodes_increase_within_the_step_and_the_weights_are_positive(family, s):
    for digits in (None, 40):
        tableau = FAMILIES[family](s, digits=digits)
        assert list(tableau.c) == sorted(set(tableau.c))
        assert 0 <= tableau.c[0] <= tableau.c[-1] <= 1
        assert min(tableau.b) > 0
        assert [len(row) for row in tableau.A] == [s] * s


@pytest.mark.parametrize(("family", "s"), SYMMETRIC, ids=[f"{family}-{s}" for family, s in SYMMETRIC])
def test_the_tableau_is_symmetric(family, s):
    tableau = FAMILIES[family](s, digits=40)
    reflected = [[b - a for a, b in zip(row[::-1], tableau.b, strict=True)] for row in tableau.A[::-1]]
    assert distance(reflected, tableau.A) < DIGITS
    assert distance([1 - c for c in tableau.c[::-1]], tableau.c) < DIGITS
    rounded = FAMILIES[family](s)
    assert rounded.b == rounded.b[::-1]


@pytest.mark.parametrize("s", range(1, 9), ids=str)
def test_gauss_is_symplectic(s):
    assert symplecticity(gauss(s, digits=40), gauss(s, digits=40)) < DIGITS
    assert symplecticity(gauss(s), gauss(s)) < 1e-16


@pytest.mark.parametrize("s", PAIRS, ids=str)
def test_lobatto_iiia_and_iiib_are_a_symplectic_pair(s):
    for digits, tolerance in ((40, DIGITS), (None, 1e-16)):
        iiia, iiib = lobatto_iiia(s, digits=digits), lobatto_iiib(s, digits=digits)
        assert symplecticity(iiia, iiib) < tolerance
        assert (iiia.b, iiia.c) == (iiib.b, iiib.c)
        assert symplecticity(iiia, iiia) > 1e-3
        assert symplecticity(iiib, iiib) > 1e-3


@pytest.mark.parametrize("s", PAIRS, ids=str)
def test_lobatto_iiib_is_what_its_definition_by_discontinuous_collocation_gives(s):
    # the first column b_1, the last zero, and C(s-2), HLW II.1.4: s conditions on the s entries of each row
    b, c = lobatto_iiia(s, digits=60).b, lobatto_iiia(s, digits=60).c
    with mp.workdps(60):
        first, last = ([mp.mpf(i == j) for j in range(s)] for i in (0, s - 1))
        conditions = mp.matrix([first, last, *([x ** (k - 1) for x in c] for k in range(1, s - 1))])
        rows = [list(mp.lu_solve(conditions, mp.matrix([b[0], 0, *(x**k / k for k in range(1, s - 1))]))) for x in c]
    assert distance(rows, lobatto_iiib(s, digits=40).A) < DIGITS


@pytest.mark.parametrize("digits", [None, 40], ids=["floats", "40 digits"])
@pytest.mark.parametrize("s", PAIRS, ids=str)
def test_the_ends_of_the_lobatto_tableaux_are_exact(s, digits):
    iiia, iiib = lobatto_iiia(s, digits=digits), lobatto_iiib(s, digits=digits)
    assert (iiia.c[0], iiia.c[-1]) == (0, 1)
    assert set(iiia.A[0]) == {0}
    assert iiia.A[-1] == iiia.b
    assert {row[-1] for row in iiib.A} == {0}
    assert {row[0] for row in iiib.A} == {iiib.b[0]}


@pytest.mark.parametrize("digits", [None, 40], ids=["floats", "40 digits"])
@pytest.mark.parametrize("s", range(1, 9), ids=str)
def test_radau_iia_is_stiffly_accurate(s, digits):
    tableau = radau_iia(s, digits=digits)
    assert tableau.c[-1] == 1
    assert tableau.A[-1] == tableau.b


@pytest.mark.parametrize(("family", "s"), TABLEAUX, ids=IDS)
def test_the_floats_are_the_exact_numbers_rounded_once(family, s):
    with mp.workdps(70):
        exact = FAMILIES[family](s, digits=60)
        rounded = Tableau(*((tuple(tuple(map(float, row)) for row in exact.A)), tuple(map(float, exact.b)), tuple(map(float, exact.c))))
    assert FAMILIES[family](s) == rounded
    assert {type(a) for row in FAMILIES[family](s).A for a in row} == {float}


def test_many_stages_keep_every_digit():
    for family in FAMILIES.values():
        assert distance(family(12, digits=25), family(12, digits=50)) < 1e-24


@pytest.mark.parametrize("s", [0, -1, 2.0, "2", True], ids=repr)
@pytest.mark.parametrize("family", list(FAMILIES), ids=str)
def test_a_number_of_stages_that_is_none_is_refused(family, s):
    with pytest.raises(BadInput, match=family):
        FAMILIES[family](s)


@pytest.mark.parametrize("family", ["lobatto_iiia", "lobatto_iiib"], ids=str)
def test_lobatto_needs_both_ends(family):
    with pytest.raises(BadInput, match="at least 2 stages, not s = 1"):
        FAMILIES[family](1)


def test_the_modules_import_without_mpmath():
    code = "import sys, daebench.compositions, daebench.tableaux; sys.exit('mpmath' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0

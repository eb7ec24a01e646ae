"""Runge-Kutta tableaux, against their closed forms and simplifying assumptions at high precision."""

import dataclasses
import itertools
import re
import subprocess
import sys

import mpmath as mp
import pytest
from refusals import refused

from daebench.schemes.kernels.tableaux import Tableau, gauss, lobatto_iiia, lobatto_iiib, radau_iia

pytestmark = pytest.mark.usefixtures("forty_digits")

FAMILIES = {"gauss": gauss, "radau_iia": radau_iia, "lobatto_iiia": lobatto_iiia, "lobatto_iiib": lobatto_iiib}
LEAST = {"gauss": 1, "radau_iia": 1, "lobatto_iiia": 2, "lobatto_iiib": 2}
STAGES = {family: range(least, 9) for family, least in LEAST.items()}
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


BOOKS = {
    ("gauss", 1): "[[1/2]], [1], [1/2]",
    ("gauss", 2): "[[1/4, 1/4 - r3/6], [1/4 + r3/6, 1/4]], [1/2, 1/2], [1/2 - r3/6, 1/2 + r3/6]",
    ("gauss", 3): """[
        [5/36, 2/9 - r15/15, 5/36 - r15/30], [5/36 + r15/24, 2/9, 5/36 - r15/24], [5/36 + r15/30, 2/9 + r15/15, 5/36]
    ], [5/18, 4/9, 5/18], [1/2 - r15/10, 1/2, 1/2 + r15/10]""",
    ("radau_iia", 1): "[[1]], [1], [1]",
    ("radau_iia", 2): "[[5/12, -1/12], [3/4, 1/4]], [3/4, 1/4], [1/3, 1]",
    ("radau_iia", 3): """[
        [(88 - 7*r6)/360, (296 - 169*r6)/1800, (-2 + 3*r6)/225], [(296 + 169*r6)/1800, (88 + 7*r6)/360, (-2 - 3*r6)/225],
        [(16 - r6)/36, (16 + r6)/36, 1/9]
    ], [(16 - r6)/36, (16 + r6)/36, 1/9], [(4 - r6)/10, (4 + r6)/10, 1]""",
    ("lobatto_iiia", 2): "[[0, 0], [1/2, 1/2]], [1/2, 1/2], [0, 1]",
    ("lobatto_iiia", 3): "[[0, 0, 0], [5/24, 1/3, -1/24], [1/6, 2/3, 1/6]], [1/6, 2/3, 1/6], [0, 1/2, 1]",
    ("lobatto_iiia", 4): """[
        [0, 0, 0, 0], [(11 + r5)/120, (25 - r5)/120, (25 - 13*r5)/120, (-1 + r5)/120],
        [(11 - r5)/120, (25 + 13*r5)/120, (25 + r5)/120, (-1 - r5)/120], [1/12, 5/12, 5/12, 1/12]
    ], [1/12, 5/12, 5/12, 1/12], [0, (5 - r5)/10, (5 + r5)/10, 1]""",
    ("lobatto_iiib", 2): "[[1/2, 0], [1/2, 0]], [1/2, 1/2], [0, 1]",
    ("lobatto_iiib", 3): "[[1/6, -1/6, 0], [1/6, 1/3, 0], [1/6, 5/6, 0]], [1/6, 2/3, 1/6], [0, 1/2, 1]",
    ("lobatto_iiib", 4): """[
        [1/12, (-1 - r5)/24, (-1 + r5)/24, 0], [1/12, (25 + r5)/120, (25 - 13*r5)/120, 0],
        [1/12, (25 + 13*r5)/120, (25 - r5)/120, 0], [1/12, (11 - r5)/24, (11 + r5)/24, 0]
    ], [1/12, 5/12, 5/12, 1/12], [0, (5 - r5)/10, (5 + r5)/10, 1]""",
}
"""Tableaux (A, b, c) as they stand in the books; r5 is the square root of 5."""


def test_a_tableau_is_the_one_in_the_books():
    roots = {f"r{k}": mp.sqrt(k) for k in (3, 5, 6, 15)}
    for (family, s), text in BOOKS.items():
        right = eval(re.sub(r"(?<!r)\b\d+\b", r"mpf(\g<0>)", text), {"mpf": mp.mpf, **roots})
        assert distance(FAMILIES[family](s, digits=40), Tableau(*right)) < 1e-39, (family, s)


@pytest.mark.parametrize("family", FAMILIES)
def test_the_simplifying_assumptions_hold_as_far_as_they_should_and_no_farther(family):
    for s in STAGES[family]:
        tableau = FAMILIES[family](s, digits=40)
        for assumption, highest in zip((B, C, D), ASSUMPTIONS[family](s), strict=True):
            assert max((assumption(tableau, k) for k in range(1, highest + 1)), default=0) < DIGITS, s
            # the quadrature error of Gauss with 8 nodes at degree 16 is 4e-11
            assert assumption(tableau, highest + 1) > 1e-12, s


@pytest.mark.parametrize("s", STAGES["lobatto_iiia"], ids=str)
def test_lobatto_iiia_and_iiib_are_a_symplectic_pair(s):
    for digits, tolerance in ((40, DIGITS), (None, 1e-16)):
        iiia, iiib = lobatto_iiia(s, digits=digits), lobatto_iiib(s, digits=digits)
        assert symplecticity(iiia, iiib) < tolerance
        assert (iiia.b, iiia.c) == (iiib.b, iiib.c)
        assert symplecticity(iiia, iiia) > 1e-3
        assert symplecticity(iiib, iiib) > 1e-3


def test_lobatto_iiib_is_what_its_definition_by_discontinuous_collocation_gives():
    """The first column is b_1, the last zero, and C(s-2), HLW II.1.4: s conditions on the s entries of each row."""
    for s in STAGES["lobatto_iiib"]:
        b, c = lobatto_iiia(s, digits=60).b, lobatto_iiia(s, digits=60).c
        with mp.workdps(60):
            first, last = ([mp.mpf(i == j) for j in range(s)] for i in (0, s - 1))
            conditions = mp.matrix([first, last, *([x ** (k - 1) for x in c] for k in range(1, s - 1))])
            rows = [list(mp.lu_solve(conditions, mp.matrix([b[0], 0, *(x**k / k for k in range(1, s - 1))]))) for x in c]
        assert distance(rows, lobatto_iiib(s, digits=40).A) < DIGITS, s


def test_the_ends_of_the_tableaux_are_exact():
    for s, digits in itertools.product(STAGES["lobatto_iiia"], (None, 40)):
        iiia, iiib, radau = (family(s, digits=digits) for family in (lobatto_iiia, lobatto_iiib, radau_iia))
        assert (iiia.c[0], iiia.c[-1], radau.c[-1]) == (0, 1, 1)
        assert set(iiia.A[0]) == {0}
        assert iiia.A[-1] == iiia.b
        assert {row[-1] for row in iiib.A} == {0}
        assert {row[0] for row in iiib.A} == {iiib.b[0]}
        assert radau.A[-1] == radau.b


@pytest.mark.parametrize("family", FAMILIES)
def test_the_floats_are_the_exact_numbers_rounded_once(family):
    for s in STAGES[family]:
        with mp.workdps(70):
            exact = FAMILIES[family](s, digits=60)
            rounded = Tableau(tuple(tuple(map(float, row)) for row in exact.A), tuple(map(float, exact.b)), tuple(map(float, exact.c)))
        assert FAMILIES[family](s) == rounded, s
        assert {type(a) for row in FAMILIES[family](s).A for a in row} == {float}


def test_many_stages_keep_every_digit():
    for family in FAMILIES.values():
        assert distance(family(12, digits=25), family(12, digits=50)) < 1e-24


def test_a_number_of_stages_that_is_none_is_refused():
    for family, s in itertools.product(FAMILIES, (0, -1, 2.0, "2", True)):
        with refused("too-few-stages" if s in (0, -1) else "not-whole"):
            FAMILIES[family](s)
    for family in ("lobatto_iiia", "lobatto_iiib"):
        with refused("too-few-stages"):
            FAMILIES[family](1)


def test_the_modules_import_without_mpmath():
    code = "import sys, daebench.methods.fixed_step.compositions, daebench.schemes.kernels.tableaux; sys.exit('mpmath' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0

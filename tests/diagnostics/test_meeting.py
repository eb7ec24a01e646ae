"""How constraints meet, measured as a classifier: families of starts whose kind is known, over twelve orders of magnitude of sizes."""

import zlib
from collections import Counter
from contextlib import nullcontext
from dataclasses import replace

import numpy as np
import pytest
import sympy as sp
from meetings import BROKEN, MEETINGS, four_bar, in_line, parallelogram, points, points_at, scattered
from refusals import refused

from daebench.compiler.definition import source_of
from daebench.diagnostics.contradiction import contradiction
from daebench.diagnostics.freedom import freedom, require_freedom, undetermined
from daebench.diagnostics.second_order import require_motion
from daebench.runs.make_ivp import make_ivp
from daebench.systems.constrained import Case, ConstrainedHamiltonian, coordinates


def drawn(families, name, count):
    """Problems of a family, and the random numbers that go on from there: the same for each name, whatever runs before."""
    random = np.random.default_rng(zlib.crc32(name.encode()))
    return list(families[name].problems(count, random)), random


def kind(ivp):
    return "gauge" if undetermined(ivp) else freedom(ivp).kind


def displaced(ivp, random, sized):
    extent = np.ptp(ivp.q0) if sized else 1.0
    return replace(ivp, q0=ivp.q0 + 10.0 ** random.uniform(-3, 0.5) * extent * random.normal(size=ivp.d))


DEGREES = {
    "3 points in a line in the plane": 3,
    "3 points in a line in space": 5,
    "4 points in a line in space": 5,
    "3 points in a line and 1 mixture": 5,
    "all distances of 5 points in space": 6,
    "all distances of 5 points in the plane": 3,
    "a parallelogram with its middle bar": 1,
    "a flat parallelogram with its middle bar": 1,
    "a flat four-bar": 1,
    "a flat four-bar and 1 mixture": 1,
    "two cylinders that touch": 1,
    "a stretched four-bar": 0,
    "a ring of four bonds": 8,
}


USUAL = (
    "all distances of 5 points in the plane",
    "a triangle and 3 mixtures",
    "a four-bar by angles and 1 mixture",
    "3 points in a line in space",
    "two cylinders that touch",
    "a flat four-bar",
    "a flat parallelogram with its middle bar",
    "a stretched four-bar by angles",
    "a square and a cubic",
    "two quaternions, the second with its term",
    "a ring of four bonds",
    "a line that is bent by 1e-3",
)
"""Families of each kind, which the gate takes."""


@pytest.mark.sampled(by=lambda case: case in USUAL)
@pytest.mark.parametrize("name", MEETINGS)
def test_a_start_is_called_by_the_kind_of_its_family(name):
    """Where degrees of freedom are known, so are they; a start off constraints that can be obeyed is no contradiction."""
    family, (problems, random) = MEETINGS[name], drawn(MEETINGS, name, 2)
    assert [kind(ivp) for ivp in problems] == [family.kind] * 2
    if name in DEGREES:
        assert {freedom(ivp).degrees for ivp in problems} == {DEGREES[name]}
    if not family.H:
        assert [contradiction(displaced(ivp, random, family.sized)) for ivp in problems] == [""] * 2
    if name in DEGREES.keys() - {"a ring of four bonds"}:
        for ivp in problems:
            assert goes_on(ivp, random) == (family.kind == "redundant")


def goes_on(ivp, random):
    """Hold `require_motion` against G a + g_qq(v, v) = 0 in the sense of least squares, with second differences of g for g_qq."""
    G = ivp.value("G", ivp.q0)
    free = np.linalg.svd(G / np.linalg.norm(G, axis=1)[:, None])[2][freedom(ivp).rank :]
    v = random.normal(size=len(free)) @ free
    v *= np.ptp(ivp.q0) / np.linalg.norm(v)
    small = 3e-4
    second = sum(s * ivp.value("g", ivp.q0 + k * small * v) for k, s in ((-1, 1), (0, -2), (1, 1))) / small**2
    rest = np.linalg.lstsq(G, -second, rcond=1e-9)[0] @ G.T + second
    solved = np.linalg.norm(rest) < 1e-3 * np.linalg.norm(second)
    moving = replace(ivp, p0=np.diag(1 / np.diag(ivp.value("H_pp", ivp.p0, ivp.q0))) @ v)
    with nullcontext() if solved else refused("no-motion-at-second-order"):
        require_motion(moving)
    return solved


@pytest.mark.sampled(left_out=("a flat four-bar", "a tetrahedron"))
@pytest.mark.parametrize(
    "name", ["3 points in a line in space", "a flat four-bar", "a four-bar and 2 mixtures", "a tetrahedron", "a cubic"]
)
def test_the_units_of_each_constraint_do_not_matter(name):
    problems, random = drawn(MEETINGS, name, 2)
    for ivp in problems:
        units = 10.0 ** random.uniform(-6, 6, size=ivp.m)
        values = {key: x * units[int(key[1:].split("_")[0])] if "_" in key else x for key, x in ivp.parameters.items()}
        assert kind(replace(ivp, parameters=values)) == MEETINGS[name].kind


@pytest.mark.exhaustive
@pytest.mark.parametrize("count", [5, 6])
def test_a_longer_line_and_more_mixtures_are_no_different(count, random):
    for ivp in points_at("", in_line(count, 3), count, 3).problems(1, random):
        assert (kind(ivp), freedom(ivp).degrees) == ("tangential", 5)
    for ivp in points_at("", scattered(3, 3), 3, 3, more=2 * count).problems(1, random):
        assert (kind(ivp), freedom(ivp).degrees) == ("redundant", 6)


@pytest.mark.sampled(by=lambda case: case in ("a triangle against its inequality", "two spheres apart"))
@pytest.mark.parametrize("name", BROKEN)
def test_constraints_that_nothing_obeys_are_called_contradictory(name):
    (ivp,), _ = drawn(BROKEN, name, 1)
    assert "no configuration exists" in contradiction(ivp)


@pytest.mark.exhaustive
def test_the_table_of_kinds_that_are_mistaken():
    """The table of the page "Constraints that meet badly", from fewer draws: one in a hundred of a kind may be mistaken."""
    kinds, contradictions = Counter(), Counter()
    for name, family in MEETINGS.items():
        problems, random = drawn(MEETINGS, name, 20)
        kinds.update((family.kind, kind(ivp)) for ivp in problems)
        if not family.H:
            contradictions.update((False, bool(contradiction(displaced(ivp, random, family.sized)))) for ivp in problems[:15])
    for name in BROKEN:
        contradictions.update((True, bool(contradiction(ivp))) for ivp in drawn(BROKEN, name, 5)[0])
    for table in (kinds, contradictions):
        for right in {right for right, _ in table}:
            counts = {said: count for (true, said), count in table.items() if true == right}
            assert sum(counts.values()) - counts[right] <= 0.01 * sum(counts.values()), (right, counts)


def test_only_a_start_that_cannot_move_is_refused(random):
    (stretched,), (free,) = (family.problems(1, random) for family in (four_bar("", fold=-1), points_at("", scattered(2, 2), 2, 2)))
    require_freedom(free)
    with refused("no-degree-of-freedom", says=("g3",)):
        require_freedom(stretched)


# ---- sentences -----------------------------------------------------------------------------------------------------------

SAID = {
    "tangential": (points_at("", in_line(3, 3), 3, 3), "keep g3"),
    "both": (points_at("", in_line(3, 3), 3, 3, [(0, 1), (0, 1), (1, 2), (0, 2)]), "remove g2, and keep g4"),
    "redundant": (points_at("", scattered(3, 3), 3, 3, more=1), "remove g4"),
    "change point": (parallelogram("", flat=True), "start elsewhere"),
    "undetermined": (MEETINGS["a cubic"], "write the constraints"),
}


@pytest.mark.parametrize("name", SAID)
def test_each_kind_has_its_cure(name, random):
    family, cure = SAID[name]
    (ivp,) = family.problems(1, random)
    if name == "both":  # not in mixtures, in which all dependent constraints are tangential
        values = {f"a{i}_{j}": float(i == j) for i in range(4) for j in range(4)}
        ivp = replace(ivp, parameters={**ivp.parameters, **values})
    found = freedom(ivp)
    assert name in (found.kind, "both")
    assert found.cure.startswith(cure)
    assert found.cure in found.remedy


def test_the_cure_of_a_line_has_its_degrees_of_freedom_with_independent_constraints():
    q, p = coordinates(9)
    X = points(q, 3)
    g = [*(X[1] - (X[0] + X[2]) / 2), (X[0] - X[2]).dot(X[0] - X[2]) - 4]
    case = Case(q=(-1, 0, 0, 0, 0, 0, 1, 0, 0), p=(0, -1, 0, 0, 0, 0, 0, 1, 0))
    cured = freedom(make_ivp(source_of(ConstrainedHamiltonian(q=q, p=p, M=sp.eye(9), U=0, g=g, cases={"a": case}), "co2"), "a"))
    assert (cured.kind, cured.degrees) == ("independent", 5)

"""References of Poisson systems: built, held against other work, verified, altered, exported, compared with, and asserted against."""

import csv
import json
from dataclasses import replace

import mpmath as mp
import numpy as np
import pytest
import sympy as sp
from kept_stages import computations, spoiled
from refusals import refused
from tampered import altered, failing, nudged

from daebench.methods.fixed_step.poisson import PoissonStep
from daebench.methods.solvers.taylor_equations import Translation, library
from daebench.reference.check.file_agreement import agreement
from daebench.reference.check.verify import verify
from daebench.reference.keep.definition import define
from daebench.reference.keep.dense_evaluation import states_at
from daebench.reference.make import poisson
from daebench.reference.make.build import build
from daebench.reference.make.certify import NotCertified, certify
from daebench.reference.make.coordinates import Own
from daebench.reference.make.independent_computations import integrated
from daebench.reference.make.mathematics import mathematics
from daebench.reference.make.poisson import Poisson, canonical, lifted, skewed
from daebench.testing import assert_agrees, assert_converges, assert_solver_converges, reference_trajectory

NAME = "lotka_volterra-4,2"
MIDDLE = 5


@pytest.fixture(scope="module", autouse=True)
def uncompiled_methods():
    """Have our own method run uncompiled."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("daebench.methods.names.PoissonStep", lambda *a: replace(PoissonStep(*a), compiled=False))
        yield


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Build predator and prey to t = 1, and return the folder it is in."""
    place = tmp_path_factory.mktemp("references")
    build(NAME, folder=place, t_end=1)
    return place


@pytest.fixture
def reference(folder):
    return reference_trajectory(NAME, folder=folder)


@pytest.fixture
def copy(folder, tmp_path):
    import shutil

    return shutil.copytree(folder, tmp_path / "references")


def rates(_, y):
    """The right side, written by hand from HLW (2.13)."""
    return [y[0] * (y[1] - 2), y[1] * (1 - y[0])]


@pytest.fixture(scope="module")
def solution():
    """A function of time by mpmath's own Taylor series, good to 37 digits."""
    with mp.workdps(38):
        return mp.odefun(rates, 0, [4, 2])


# ---- digits --------------------------------------------------------------------------------------------------------------


def test_stored_digits_lie_within_their_bound_of_the_solution_by_mpmath(reference, solution):
    with mp.workdps(38):
        for k, t in enumerate(reference.t):
            errors = [abs(mp.mpf(reference.text[f"y{i + 1}"][k]) - x) for i, x in enumerate(solution(mp.mpf(float(t))))]
            assert np.all(np.array(errors, dtype=float) <= reference.bound["y"][k])
    assert reference.bound["y"].max() < 1e-31
    assert reference.y.shape == reference.bound["y"].shape == (9, 2)


def test_the_certificate_says_what_was_done(reference):
    found = reference.certificate
    assert found["drift"] == {"energy": pytest.approx(0, abs=1e-32)}
    assert "rank" not in found
    assert len(found["made"]["checks"]) == 2
    assert [(row["method"], row["status"]) for row in found["ida"]] == [("ida:ode", "reached the end")] * 5
    for row in found["ida"]:
        assert 0.2 * row["error"]["y"] < row["estimate"]["y"] < 1e3 * row["tol"]


def test_amplification_is_that_of_the_tangent_map_in_every_direction(reference, solution):
    with mp.workdps(38):
        eps = mp.mpf("1e-12")
        beside = [mp.odefun(rates, 0, start)(mp.mpf(1)) for start in ([4 + eps, 2], [4, 2 + eps])]
        tangent = np.array((np.array(beside) - np.array(solution(mp.mpf(1)))) / eps, dtype=float)
    assert reference.amplification[-1] == pytest.approx(np.linalg.norm(tangent, 2), rel=0.011)


# ---- other coordinates ---------------------------------------------------------------------------------------------------

COORDINATES = {
    "canonical": ("lotka_volterra", "4,2", canonical),
    "canonical, with a Casimir function": ("lotka_volterra_3d", "late", canonical),
    "lifted": ("free_rigid_body", "hlw", lifted),
    "skewed": ("heavy_top_lie_poisson", "lagrange", skewed),
}


@pytest.mark.parametrize(("problem", "case", "kind"), COORDINATES.values(), ids=COORDINATES)
def test_the_motion_in_other_coordinates_is_the_same(problem, case, kind, forty_digits):
    found = computations(problem, case, 0.5, 2)
    other = kind(found.definition)
    first, *_, last = found.own().rows
    rows = other.left(integrated(other.equations, other.entered(first), found.times))
    assert max(abs(x - y) for x, y in zip(rows[-1], last, strict=True)) < 1e-30
    assert max(abs(x - y) for x, y in zip(first, last, strict=True)) > 0.01


def test_the_closed_form_of_the_rigid_body_is_held_against_two_series(forty_digits):
    found = certify(computations("free_rigid_body", "hlw", 1, 8))
    assert found.method.startswith("closed form")
    assert len(found.checks) == 3
    assert found.bound["y"].max() < 1e-30


def test_a_lattice_is_written_out(forty_digits):
    definition, n = define("ablowitz_ladik", "hlw16"), 16
    y = definition.start_numbers()[0]
    found = mathematics(definition).conserved(y)
    u, v = y[:n], y[n:]
    norm = n**2 * sum(mp.log(1 + (a**2 + b**2) / n**2) for a, b in zip(u, v, strict=True))
    coupling = sum(u[k] * u[k - 1] + v[k] * v[k - 1] for k in range(n))
    assert tuple(found) == ("energy", "norm", "coupling", "momentum")
    assert abs(found["energy"][0] - n**2 * (coupling - norm)) < 1e-30


def test_a_power_of_what_is_zero_has_a_series():
    x, t = sp.symbols("x t")
    hy = library()
    say = Translation({x: hy.make_vars("x"), t: hy.make_vars("t")})
    with mp.workdps(40):
        rows = integrated([(say(x), say(t**3)), (say(t), say(sp.Integer(1)))], [mp.mpf(0)] * 2, [mp.mpf(0), mp.mpf(1) / 2])
        assert abs(rows[-1][0] - mp.mpf(1) / 64) < 1e-34


# ---- wrong motions -------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("place", [("lotka_volterra", "4,2"), ("free_rigid_body", "hlw")], ids=lambda place: place[0])
def test_an_equation_that_is_wrong_by_a_little_is_refused(place, monkeypatch, forty_digits):
    right = Poisson.first.func
    monkeypatch.setattr(Poisson, "first", property(lambda self: Own(spoiled(right(self).equations, 0, "1e-26"))))
    with refused("reference-computations-differ", NotCertified, says=("y",)):
        certify(computations(*place, 1, 8))


def test_canonical_coordinates_that_are_not_are_refused(monkeypatch, forty_digits):
    def off(definition):
        right = canonical(definition)
        return replace(right, equations=spoiled(right.equations, 0, "1e-26"))

    monkeypatch.setattr(poisson, "canonical", off)
    with refused("reference-computations-differ", NotCertified):
        certify(computations("lotka_volterra", "4,2", 1, 8))


# ---- verification --------------------------------------------------------------------------------------------------------


def late(by):
    """Move a row along the motion, by the midpoint rule, which keeps the energy to the cube of the time."""

    def change(text):
        with mp.workdps(50):
            y = np.array([mp.mpf(text[name][MIDDLE]) for name in ("y1", "y2")])
            middle = y + mp.mpf(by) / 2 * np.array(rates(0, y))
            for name, x in zip(("y1", "y2"), y + mp.mpf(by) * np.array(rates(0, middle)), strict=True):
                text[name][MIDDLE] = mp.nstr(x, 34)

    return change


def test_an_intact_reference_passes_with_the_digits_of_double_precision(folder):
    found = verify(NAME, folder)
    assert [check for check in found.checks if not check.ok] == []
    assert [each.part for each in found.digits] == ["y"] * 3
    for each, (least, most, visible) in zip(found.digits, [(14, 16, 1e-13)] * 2 + [(9, 13, 1e-8)], strict=True):
        assert least < each.overall < most
        assert 10**-each.overall < each.visible < visible


ALTERED = {
    "far out": (nudged("y1", "1e-31", MIDDLE), None, "drift of energy", "by strang"),
    "in the motion": (nudged("y2", "1e-12", MIDDLE), None, "y by strang/kahan_li8 from each row to the next", "start"),
    "along the motion": (late("1e-13"), None, "y by strang/kahan_li8, h = ", "drift"),
    "start": (nudged("y1", "1e-33", row=0), None, "start", "by strang"),
    "drift": (None, lambda claims: claims["drift"].update(energy=1e-20), "drift of energy", "start"),
    "bound": (None, lambda claims: claims["bound"].update(y=[[1e-36] * 2] * 9), "bound of y, least", "by strang"),
    "IDA": (None, lambda claims: claims.update(ida=[]), "the certificate's row of ida:ode", "by strang"),
    "B": (None, lambda claims: claims["definition"].update(B="[[0, 1], [-1, 0]]"), "text of the definition", "drift"),
    "column": (lambda text: text.pop("y2"), None, "form", "drift"),
    "all columns": (lambda text: [text.pop(name) for name in ("y1", "y2")], None, "form", "drift"),
}


@pytest.mark.parametrize(("digits", "certificate", "seen", "unseen"), ALTERED.values(), ids=ALTERED)
def test_what_was_altered_is_seen_though_the_checksums_are_right(copy, digits, certificate, seen, unseen):
    altered(NAME, copy, digits, certificate)
    found = failing(NAME, copy)
    assert seen in found
    assert unseen not in found


# ---- what they are for ---------------------------------------------------------------------------------------------------


@pytest.mark.usefixtures("plain_functions")
def test_states_between_stored_times_lie_within_their_bounds(reference, solution, random):
    times = random.uniform(0, 1, 6)
    found = states_at(reference, times)
    assert not found.stored.any()
    with mp.workdps(38):
        exact = np.array([solution(mp.mpf(float(t))) for t in times])
        errors = np.abs(found.states["y"] * mp.mpf(1) - exact).astype(float)
    assert np.all(errors <= found.bound["y"])
    assert found.bound["y"].max() < 1e-11


def test_the_commands_list_show_at_and_export_have_y_in_place_of_q_and_p(folder, daebench, reference, tmp_path):
    where = ("--folder", folder)
    (row,) = json.loads(daebench("reference", "list", *where, "--json")[1])
    assert (row["name"], row["bound"]) == (NAME, reference.bound["y"][-1].max())
    assert "|dy|" in daebench("reference", "show", NAME, *where)[1]
    found = json.loads(daebench("reference", "at", "lotka_volterra", "--case", "4,2", "--t", 0.5, *where, "--json")[1])
    assert found["digits"] == {"y": [reference.text["y1"][4], reference.text["y2"][4]]}
    assert not {"q", "p", "lam"} & set(found)
    path = tmp_path / "x.csv"
    assert daebench("reference", "export", NAME, *where, "--out", path)[0] == 0
    rows = list(csv.reader(path.read_text().splitlines()))
    assert rows[0] == ["t", "y1", "y2", "bound_y1", "bound_y2"]
    assert [row[1] for row in rows[1:]] == reference.text["y1"]


def test_a_file_is_compared_to_any_digit(folder, reference, tmp_path):
    path, text = tmp_path / "own.csv", {name: list(column) for name, column in reference.text.items()}
    nudged("y2", "-3e-20", 3)(text)
    rows = zip(text["t"], text["y2"], text["y2"], text["y1"], strict=True)
    path.write_text("".join(",".join(row) + "\n" for row in [("t", "y2", "q1", "y1"), *rows]))
    found = agreement(path, NAME, folder)
    assert (found.worst.name, found.worst.error, found.worst.t) == ("y2", pytest.approx(3e-20, rel=1e-6, abs=0), 0.375)
    assert found.digits == pytest.approx(-np.log10(3e-20 / np.abs(reference.y).max()), abs=1e-6)
    assert found.ignored == ("q1",)


def strang(y, h):
    """HLW (4.6), written by hand."""
    u, v = y
    u = u * np.exp(h / 2 * (v - 2))
    v = v * np.exp(h * (1 - u))
    return [u * np.exp(h / 2 * (v - 2)), v]


def test_a_step_from_y_to_y_has_its_order_and_no_more(reference):
    assert_converges(strang, reference, 2)
    with pytest.raises(AssertionError, match=r"order in y is 2\.0"):
        assert_converges(strang, reference, 3)


def test_a_whole_run_is_judged_too(reference):
    def euler(y, h, t):
        rows, n = [], 0
        for steps in np.rint(t / h):
            while n < steps:
                y, n = y + h * np.array(rates(0, y)), n + 1
            rows.append(y)
        return rows

    assert_solver_converges(euler, reference, 1, halvings=8)


def test_what_is_no_state_is_refused(reference):
    for step, code in ((lambda y, h: (y, y), "state-shape-wrong"), (lambda y, h: y + 1j, "state-complex")):
        with refused(code):
            assert_converges(step, reference, 2)


def test_a_trajectory_agrees_to_the_digits_it_has(reference):
    y = reference.y + 1e-6 * np.abs(reference.y).max() * (reference.t[:, None] == 0.5) * [0, 1]
    assert_agrees(reference, t=reference.t, y=y, digits=5.99)
    with pytest.raises(AssertionError, match=r"First: 6\.0 digits of y2 at t = 0\.5"):
        assert_agrees(reference, t=reference.t, y=y, digits=6.01)


def test_states_of_another_kind_are_refused(reference):
    with refused("reference-state-of-other-kind"):
        assert_agrees(reference, t=reference.t, q=reference.y, p=reference.y, digits=5)
    with pytest.raises(AttributeError, match="lotka_volterra-4,2 has y, but no q"):
        assert reference.q is None

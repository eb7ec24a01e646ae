"""References of Poisson systems: built, held against other work, verified, altered, exported, compared with, and asserted against."""

import csv
import json
from dataclasses import replace
from decimal import Decimal, localcontext
from functools import partial

import mpmath as mp
import numpy as np
import pytest
import sympy as sp
import tampered
from refusals import refused

from daebench.compiler.definition import source_of
from daebench.methods.fixed_step.poisson import PoissonStep
from daebench.methods.solvers.taylor_equations import Translation, library
from daebench.reference.check.file_agreement import agreement
from daebench.reference.check.verify import verify
from daebench.reference.keep.definition import Definition, define
from daebench.reference.keep.dense_evaluation import states_at
from daebench.reference.make import poisson
from daebench.reference.make.build import build
from daebench.reference.make.certify import NotCertified, certify
from daebench.reference.make.coordinates import Own
from daebench.reference.make.independent_computations import Computations, integrated
from daebench.reference.make.mathematics import mathematics
from daebench.reference.make.poisson import Poisson, canonical, lifted, skewed
from daebench.runs.make_ivp import make_ivp
from daebench.systems.poisson import PoissonCase, PoissonSystem
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


def computations(problem, case, t_end=1, n=8):
    """Return the motions of a case, each made once."""
    made = {}

    def keep(stage, make):
        if stage not in made:
            made[stage] = make()
        return made[stage]

    return Computations(define(problem, case), [mp.mpf(t_end) * k / n for k in range(n + 1)], keep)


# ---- digits --------------------------------------------------------------------------------------------------------------


def test_stored_digits_lie_within_their_bound_of_the_solution_by_mpmath(reference, solution):
    with mp.workdps(38):
        for k, t in enumerate(reference.t):
            errors = [abs(mp.mpf(reference.text[f"y{i + 1}"][k]) - x) for i, x in enumerate(solution(mp.mpf(float(t))))]
            assert np.all([float(x) for x in errors] <= reference.bound["y"][k])
    assert reference.bound["y"].max() < 1e-31
    assert reference.y.shape == reference.bound["y"].shape == (9, 2)


def test_the_certificate_says_what_was_done(reference):
    found = reference.certificate
    assert found["definition"]["B"] == "[[0, u*v], [-u*v, 0]]"
    assert found["definition"]["parameters"] == {"a": "1.0", "b": "2.0"}
    assert found["definition"]["y0"] == ["4", "2"]
    assert [check["against"] for check in found["made"]["checks"]] == [
        "second run with another order and other steps",
        "Taylor series in canonical coordinates",
    ]
    assert set(found["drift"]) == {"energy"}
    assert found["drift"]["energy"] < 1e-32
    assert "rank" not in found
    assert [(row["method"], row["status"]) for row in found["ida"]] == [("ida:ode", "reached the end")] * 5
    for row in found["ida"]:
        assert 0.2 * row["error"]["y"] < row["estimate"]["y"] < 1e3 * row["tol"]


def test_amplification_is_that_of_the_tangent_map_in_every_direction(reference, solution):
    with mp.workdps(38):
        eps = mp.mpf("1e-12")
        base = solution(mp.mpf(1))
        beside = [mp.odefun(rates, 0, start)(mp.mpf(1)) for start in ([4 + eps, 2], [4, 2 + eps])]
        columns = np.array([[float((x - y) / eps) for x, y in zip(each, base, strict=True)] for each in beside]).T
    assert reference.amplification[-1] == pytest.approx(np.linalg.norm(columns, 2), rel=0.011)


def test_the_hash_changes_with_the_structure_matrix():
    def hashed(B):
        u, v = sp.symbols("u v", real=True)
        system = PoissonSystem(y=(u, v), B=B(u, v), H=u + v - sp.log(u), domain=[u], cases={"one": PoissonCase(y=(1, 2))})
        return Definition(make_ivp(source_of(system, "own"), "one"), {}).hash

    one, again, other = (hashed(lambda u, v, k=k: sp.Matrix([[0, k * u * v], [-k * u * v, 0]])) for k in (1, 1, 2))
    assert one == again != other


# ---- other coordinates ---------------------------------------------------------------------------------------------------

COORDINATES = {
    "canonical": ("lotka_volterra", "4,2", canonical),
    "canonical, with a Casimir function": ("lotka_volterra_3d", "late", canonical),
    "lifted": ("free_rigid_body", "hlw", lifted),
    "skewed": ("heavy_top_lie_poisson", "lagrange", skewed),
}


@pytest.mark.parametrize(("problem", "case", "kind"), COORDINATES.values(), ids=COORDINATES)
def test_the_motion_in_other_coordinates_is_the_same(problem, case, kind, forty_digits):
    found = computations(problem, case, t_end=0.5, n=2)
    own = found.own()
    other = kind(found.definition)
    start = own.rows[0]
    rows = other.left(integrated(other.equations, other.entered(start), found.times))
    assert max(abs(x - y) for x, y in zip(rows[-1], own.rows[-1], strict=True)) < 1e-30
    assert max(abs(x - y) for x, y in zip(own.rows[0], own.rows[-1], strict=True)) > 0.01


def test_the_closed_form_of_the_rigid_body_is_held_against_two_series(forty_digits):
    found = certify(computations("free_rigid_body", "hlw"))
    assert found.method.startswith("closed form")
    assert [check["against"] for check in found.checks][1:] == [
        "Taylor series of y' = B(y) grad H(y) in quadruple precision",
        "Taylor series in canonical coordinates",
    ]
    assert found.bound["y"].max() < 1e-30


def test_a_lattice_is_written_out(forty_digits):
    definition = define("ablowitz_ladik", "hlw16")
    found = mathematics(definition)
    y = definition.start_numbers()[0]
    names = ("energy", "norm", "coupling", "momentum")
    u, v, n = y[:16], y[16:], 16
    norm = n**2 * sum(mp.log(1 + (a**2 + b**2) / n**2) for a, b in zip(u, v, strict=True))
    coupling = sum(u[k] * u[k - 1] + v[k] * v[k - 1] for k in range(n))
    assert tuple(found.conserved(y)) == names
    assert abs(found.conserved(y)["energy"][0] - (n**2 * coupling - n**2 * norm)) < 1e-30


def test_a_power_of_what_is_zero_has_a_series():
    x, t = sp.symbols("x t")
    hy = library()
    say = Translation({x: hy.make_vars("x"), t: hy.make_vars("t")})
    with mp.workdps(40):
        rows = integrated([(say(x), say(t**3)), (say(t), say(sp.Integer(1)))], [mp.mpf(0)] * 2, [mp.mpf(0), mp.mpf(1) / 2])
        assert abs(rows[-1][0] - mp.mpf(1) / 64) < 1e-34


# ---- wrong motions -------------------------------------------------------------------------------------------------------


def spoiled(equations, share):
    """Return equations with the first rate off by a part of it."""
    hy = library()
    (x, rate), *rest = equations
    return [(x, rate * (hy.real128(1) + hy.real128(share))), *rest]


@pytest.mark.parametrize("place", [("lotka_volterra", "4,2"), ("free_rigid_body", "hlw")], ids=lambda place: place[0])
def test_an_equation_that_is_wrong_by_a_little_is_refused(place, monkeypatch, forty_digits):
    right = Poisson.first.func
    monkeypatch.setattr(Poisson, "first", property(lambda self: Own(spoiled(right(self).equations, "1e-26"))))
    with refused("reference-computations-differ", NotCertified, says=("y",)):
        certify(computations(*place))


def test_canonical_coordinates_that_are_not_are_refused(monkeypatch, forty_digits):
    def off(definition):
        right = canonical(definition)
        return replace(right, equations=spoiled(right.equations, "1e-26"))

    monkeypatch.setattr(poisson, "canonical", off)
    with refused("reference-computations-differ", NotCertified, says=("canonical coordinates",)):
        certify(computations("lotka_volterra", "4,2"))


# ---- verification --------------------------------------------------------------------------------------------------------


altered = partial(tampered.altered, NAME)


def nudged(column, by, row=MIDDLE):
    def change(text):
        with localcontext(prec=50):
            text[column][row] = str(Decimal(text[column][row]) + Decimal(by))

    return change


def late(by, row=MIDDLE):
    """Move one row along the motion, by the midpoint rule, which keeps the energy to the cube of the time."""

    def change(text):
        with mp.workdps(50):
            y = [mp.mpf(text[name][row]) for name in ("y1", "y2")]
            middle = [x + mp.mpf(by) / 2 * f for x, f in zip(y, rates(0, y), strict=True)]
            moved = [x + mp.mpf(by) * f for x, f in zip(y, rates(0, middle), strict=True)]
            for name, x in zip(("y1", "y2"), moved, strict=True):
                text[name][row] = mp.nstr(x, 34)

    return change


def failing(place):
    """Return what fails, as one text."""
    return "; ".join(check.what for check in verify(NAME, place).checks if not check.ok)


def test_an_intact_reference_passes_with_the_digits_of_double_precision(folder):
    found = verify(NAME, folder)
    assert [check for check in found.checks if not check.ok] == []
    methods = {each.method: each for each in found.digits}
    assert [name.split(",")[0] for name in methods] == ["strang/kahan_li8", "strang/kahan_li8 from each row to the next", "ida:ode"]
    for name, each in methods.items():
        assert each.part == "y"
        least, most = (14, 16) if name.startswith("strang") else (9, 13)
        assert least < each.overall < most
        assert 10**-each.overall < each.visible < (1e-13 if name.startswith("strang") else 1e-8)
    assert "A change of y along the motion, which keeps energy to the certificate's drift, is seen from" in found.unseen


ALTERED = {
    "far out": (nudged("y1", "1e-31"), None, "drift of energy", "by strang"),
    "in the motion": (nudged("y2", "1e-12"), None, "y by strang/kahan_li8 from each row to the next", "start"),
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
    altered(copy, digits, certificate)
    found = failing(copy)
    assert seen in found
    assert unseen not in found


# ---- what they are for ---------------------------------------------------------------------------------------------------


@pytest.mark.usefixtures("plain_functions")
def test_states_between_stored_times_lie_within_their_bounds(reference, solution, random):
    times = random.uniform(0, 1, 6)
    found = states_at(reference, times)
    assert not found.stored.any()
    with mp.workdps(38):
        for k, t in enumerate(times):
            errors = [float(abs(mp.mpf(float(x)) - y)) for x, y in zip(found.states["y"][k], solution(mp.mpf(float(t))), strict=True)]
            assert np.all(errors <= found.bound["y"][k])
    assert found.bound["y"].max() < 1e-11


def test_the_commands_list_show_at_and_export_have_y_in_place_of_q_and_p(folder, daebench, reference, tmp_path):
    where = ("--folder", folder)
    (row,) = json.loads(daebench("reference", "list", *where, "--json")[1])
    assert (row["name"], row["bound"]) == (NAME, reference.bound["y"][-1].max())
    shown = daebench("reference", "show", NAME, *where)[1]
    for words in ("grad H(y) in quadruple precision", "max |dy|", "|dy|", "ida:ode"):
        assert words in shown
    found = json.loads(daebench("reference", "at", "lotka_volterra", "--case", "4,2", "--t", 0.5, *where, "--json")[1])
    assert found["digits"] == {"y": [reference.text["y1"][4], reference.text["y2"][4]]}
    assert found["y"] == reference.y[4].tolist()
    assert not {"q", "p", "lam"} & set(found)
    path = tmp_path / "x.csv"
    assert daebench("reference", "export", NAME, *where, "--out", path)[0] == 0
    rows = list(csv.reader(path.read_text().splitlines()))
    assert rows[0] == ["t", "y1", "y2", "bound_y1", "bound_y2"]
    assert [row[1] for row in rows[1:]] == reference.text["y1"]


def test_a_file_is_compared_to_any_digit(folder, reference, tmp_path):
    path = tmp_path / "own.csv"
    rows = [
        ["t", "y2", "q1", "y1"],
        *zip(reference.text["t"], reference.text["y2"], reference.text["y2"], reference.text["y1"], strict=True),
    ]
    with localcontext(prec=50):
        rows[4] = [rows[4][0], str(Decimal(rows[4][1]) - Decimal("3e-20")), *rows[4][2:]]
    path.write_text("".join(",".join(row) + "\n" for row in rows))
    found = agreement(path, NAME, folder)
    assert (found.worst.name, found.worst.error, found.worst.t) == ("y2", pytest.approx(3e-20, rel=1e-6, abs=0), 0.375)
    assert found.digits == pytest.approx(-np.log10(3e-20 / np.abs(reference.y).max()), abs=1e-6)
    assert found.ignored == ("q1",)


def test_a_file_of_a_constrained_problem_is_refused(folder, tmp_path):
    path = tmp_path / "own.csv"
    path.write_text("t,q1,p1\n0,1,2\n0.5,1,2\n")
    with refused("csv-without-component"):
        agreement(path, NAME, folder)


def strang(y, h):
    """HLW (4.6), written by hand."""
    u, v = y
    u = u * np.exp(h / 2 * (v - 2))
    v = v * np.exp(h * (1 - u))
    return [u * np.exp(h / 2 * (v - 2)), v]


def test_a_step_from_y_to_y_has_its_order_and_no_more(reference):
    assert_converges(strang, reference, 2)
    with pytest.raises(AssertionError, match=r"order in y is 2\.0.*but 3 was claimed") as stop:
        assert_converges(strang, reference, 3)
    assert "(a = 1, b = 2)" in str(stop.value)


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
    for step, code in (
        (lambda y, h: None, "state-not-arrays"),
        (lambda y, h: (y, y), "state-shape-wrong"),
        (lambda y, h: y[:1], "state-shape-wrong"),
        (lambda y, h: y + 1j, "state-complex"),
    ):
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

"""Verification of stored references: an intact one passes, and every kind of alteration is seen by the check that is there for it."""

import json
from dataclasses import replace
from functools import partial

import mpmath as mp
import numpy as np
import pytest
import tampered
import uncompiled
from measures import error_of
from rotating import COMPONENTS, NAME, texts
from tampered import altered, failing

from daebench.methods.fixed_step.constrained import FixedStep
from daebench.reference.check import independent_runs
from daebench.reference.check.recomputation import RATTLE as METHOD
from daebench.reference.check.recomputation import followed
from daebench.reference.check.verify import verify
from daebench.reference.keep import store

PARTS = ("q", "p", "lam")
MIDDLE = 17
"""A row in the middle, t = 17/8."""

OWN = "{} by rattle/kahan_li8, h = "
SHORT = "{} by rattle/kahan_li8 from each row to the next"


@pytest.fixture(scope="module", autouse=True)
def recomputed_once():
    """Have each run made once, uncompiled: altered references are compared with the same ones."""
    runs = {}

    def once(make):

        def kept(*arguments):
            ivp = next(each for each in arguments if hasattr(each, "parameters") and hasattr(each, "p0"))
            key = (make, *ivp.parameters.values(), *ivp.q0, *ivp.p0, *(each for each in arguments if isinstance(each, int | float)))
            if key not in runs:
                runs[key] = make(*arguments)
            return runs[key]

        return kept

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("daebench.methods.formulations.constrained._module", uncompiled.kept_module)
        patch.setattr("daebench.methods.names.FixedStep", lambda *a, **k: FixedStep(*a, **k | {"compiled": False}))
        patch.setattr(independent_runs, "FINEST", 64)
        patch.setattr(independent_runs, "stepped", once(independent_runs.stepped))
        patch.setattr(independent_runs, "_by_tolerance", once(independent_runs._by_tolerance))
        yield


def growing():
    """Return the amplification of a motion that is lost in double precision before its end."""
    values = np.geomspace(1, 1e16, 33).tolist()
    return {"values": values, "worst": values, "step": [1.0, *[values[1]] * 32], "largest": values[-1]}


nudged = partial(tampered.nudged, row=MIDDLE)


def delayed(shift):
    """Return an alteration of one row to the exact motion a little later: on the manifold, with the right energy and multiplier."""

    def change(text):
        with mp.workdps(50):
            later = mp.mpf(text["t"][MIDDLE]) + mp.mpf(shift)
        for name, x in zip(COMPONENTS, texts(later, 34), strict=True):
            text[name][MIDDLE] = x

    return change


def test_an_intact_reference_passes_with_the_digits_of_double_precision_and_of_ida(references):
    told = []
    found = verify(NAME, references, lambda fraction, doing: told.append(fraction))
    assert [check for check in found.checks if not check.ok] == []
    assert found.ok
    assert told == sorted(told)
    assert (told[0], told[-1]) == (0.0, 1.0)
    assert [each.part for each in found.digits] == [*PARTS, *PARTS, *PARTS]
    for each in found.digits:
        least, most, visible = (14.5, 16, 1e-13) if each.method.startswith(METHOD) else (8, 12, 1e-8)
        assert [t for t, _ in each.at] == [1.0, 2.0, 4.0]
        assert least < each.overall < most
        assert 10**-each.overall < each.visible < visible


@pytest.mark.parametrize(
    ("digits", "seen", "unseen"),
    [
        (nudged("q1", "1e-10"), "drift of g", "start"),
        (nudged("q1", "1e-10"), OWN.format("q"), OWN.format("p")),
        (nudged("q2", "1e-31"), "drift of g", OWN.format("q")),
        (nudged("p1", "1e-12"), OWN.format("p"), OWN.format("q")),
        (nudged("p2", "1e-12"), "drift of Gv", "drift of g"),
        (nudged("p1", "1e-31"), "drift of energy", OWN.format("p")),
        (nudged("lam1", "1e-10"), OWN.format("lam"), "drift"),
        (nudged("lam1", "1e-31"), "lam against lam(p, q)", "by"),
        (nudged("p1", "1e-33", row=0), "start", "definition"),
        (nudged("q1", "1e-10", row=32), OWN.format("q"), "start"),
        (delayed("1e-12"), OWN.format("q"), "drift"),
        (delayed("1e-12"), OWN.format("p"), "drift"),
    ],
)
def test_an_altered_digit_is_seen_though_the_checksums_are_right(copied, digits, seen, unseen):
    altered(NAME, copied, digits)
    found = failing(NAME, copied)
    assert seen in found
    assert unseen not in found.replace("by ida", "")


def test_what_is_below_double_precision_along_the_motion_is_what_is_said_to_be_unseen(copied):
    altered(NAME, copied, delayed("1e-20"))
    found = verify(NAME, copied)
    assert found.ok
    short = max(each.visible for each in found.digits if each.method.endswith("to the next") and each.part != "lam")
    assert short < 5e-14
    assert f"{short:.1e}" in found.unseen


def test_after_errors_have_grown_an_alteration_is_seen_from_row_to_row(copied):
    def grown(claims):
        claims["amplification"] |= growing()
        claims["horizon"]["double"] = 3.5

    altered(NAME, copied, delayed("1e-12"), grown)
    found = failing(NAME, copied)
    assert SHORT.format("q") in found
    assert OWN.format("q") not in found
    assert "own error of" not in found


def test_each_row_is_carried_on_from_its_own_digits(references, copied):
    altered(NAME, copied, delayed("1e-6"))
    intact, late = (independent_runs.row_by_row(store.load(NAME, folder))[0].states for folder in (references, copied))
    for part in PARTS:
        moved = np.flatnonzero(np.abs(late[part] - intact[part]).max(axis=1))
        assert moved.tolist() == [MIDDLE + 1]


def setting(*path, to):
    """Return an alteration of one entry of the certificate."""

    def change(claims):
        for key in path[:-1]:
            claims = claims[key]
        claims[path[-1]] = to(claims[path[-1]]) if callable(to) else to

    return change


@pytest.mark.parametrize(
    ("certificate", "seen"),
    [
        (setting("definition", "parameters", "gravity", to="1.5"), "text of the definition"),
        (setting("definition", "U", to="2*q2"), "text of the definition"),
        (setting("definition", "sha256", to="0" * 64), "hash of the definition"),
        (setting("problem", to="pendulum_of_doom"), "certificate"),
        (setting("case", to="horizontal"), "name"),
        (lambda claims: claims.pop("drift"), "form"),
        (lambda claims: claims.pop("bound"), "form"),
        (lambda claims: claims.pop("rank"), "certificate"),
        (setting("drift", "energy", to=lambda x: 0.9 * x), "drift of energy"),
        (setting("drift", "g", to=0.0), "drift of g"),
        (lambda claims: claims["drift"].pop("Gv"), "quantities of the certificate's drift"),
        (setting("bound", "q", MIDDLE, 0, to=1e-36), "bound of q, least"),
        (setting("bound", "p", MIDDLE, 1, to=lambda x: 0.9 * x), "bound of p along the motion"),
        (setting("bound", "lam", MIDDLE, 0, to=1e-40), "lam against lam(p, q), in units of its bound"),
        (setting("bound", "q", 32, 1, to=1e-16), "bound of q, largest"),
        (setting("bound", "p", to=lambda rows: rows[:-1]), "form"),
        (setting("amplification", "values", to=lambda values: values[:-1]), "form"),
        (setting("amplification", "values", 0, to=2.0), "amplification at the start"),
        (setting("amplification", "largest", to=7.0), "largest amplification"),
        (setting("amplification", "worst", MIDDLE, to=1.0), "worst amplification"),
        (setting("drift", "energy", to=1.0), "drift of energy"),
        (setting("rank", "largest", to=5.0), "largest of the smallest singular values"),
        (setting("rank", "t", to=0.3), "time of the smallest"),
        (setting("horizon", "asked", to=1.0), "horizon that was asked for"),
        (setting("horizon", "truth", to=8.0), "horizon"),
        (setting("horizon", "double", to=2.0), "horizon of double precision"),
        (setting("rank", "smallest_singular_value", to=3.9), "smallest singular value"),
        (setting("ida", 2, "error", "p", to=lambda x: x / 20), "error of ida:index2 in p"),
        (setting("ida", 2, "error", "lam", to=lambda x: x * 20), "error of ida:index2 in lam"),
        (setting("ida", to=[]), "row of ida:index2"),
    ],
    ids=lambda value: value if isinstance(value, str) else "",
)
def test_an_altered_certificate_is_seen_though_its_checksum_is_right(copied, certificate, seen):
    altered(NAME, copied, certificate=certificate)
    assert seen in failing(NAME, copied)


def test_a_drift_that_was_raised_to_hide_an_altered_digit_is_not_explained_by_the_bounds(copied):
    altered(NAME, copied, nudged("q1", "1e-20"), lambda claims: claims["drift"].update(dict.fromkeys(claims["drift"], 1e-15)))
    assert "drift of g, in units" in failing(NAME, copied)


@pytest.mark.parametrize(
    ("column", "row", "text", "seen"),
    [
        (slice(None), slice(-3, None), [], "form"),
        ("lam1", None, "", "form"),
        ("t", MIDDLE, "2.15625", "distances of times"),
        ("t", MIDDLE, "2.1250000000000000001", "times in double precision"),
        ("t", 0, "0.01", "first time"),
        ("q1", MIDDLE, "nan", "form"),
        ("q1", MIDDLE, "", "form"),
    ],
    ids=["truncated", "column", "uneven", "inexact", "late start", "nan", "empty"],
)
def test_a_file_of_another_layout_is_seen_and_its_digits_are_said_not_to_be_looked_at(copied, column, row, text, seen):
    def change(columns):
        if row is None:
            del columns[column]
            return
        for name in columns if column == slice(None) else [column]:
            columns[name][row] = text

    altered(NAME, copied, change)
    found = verify(NAME, copied)
    assert any(check.what.startswith(seen) for check in found.checks if not check.ok)
    assert (found.checks[-1].found, found.digits) == ("not looked at", ())


def test_a_run_that_stops_early_is_a_check_that_fails(references, monkeypatch):
    monkeypatch.setattr(independent_runs, "stepped", lambda *_: None)
    stopped = independent_runs._by_tolerance
    monkeypatch.setattr(independent_runs, "_by_tolerance", lambda *a: replace(stopped(*a), failure="IDA stopped at t = 1."))
    found = verify(NAME, references)
    wrong = {check.what: check.found for check in found.checks if not check.ok}
    assert {METHOD, f"{METHOD} from each row to the next"} < set(wrong)
    assert wrong["ida:index2, tol = 1e-12"] == "IDA stopped at t = 1."
    assert (found.digits, found.unseen) == ((), "")


@pytest.mark.parametrize(("rows", "failed"), [(20, ""), (5, "ida:index2, tol = 1e-12")], ids=["far", "at-once"])
def test_a_tenth_of_the_tolerance_may_be_too_small_for_ida(references, monkeypatch, rows, failed):
    make = independent_runs._by_tolerance

    def collapsing(ivp, ida, tol, *more):
        run = make(ivp, ida, tol, *more)
        few = {part: x[:rows] for part, x in run.states.items()}
        return run if tol == independent_runs.TOL else replace(run, t=run.t[:rows], **few, failure="the step size has collapsed.")

    monkeypatch.setattr(independent_runs, "_by_tolerance", collapsing)
    assert failing(NAME, references) == failed


def test_a_method_with_a_large_error_of_its_own_does_not_pass_for_a_check(references, monkeypatch):
    make = independent_runs.stepped
    error = dict.fromkeys(PARTS, 1e-2)
    monkeypatch.setattr(independent_runs, "stepped", lambda *a: {x: rows + error[x] / a[-1] for x, rows in make(*a).items()})
    monkeypatch.setattr(independent_runs, "FINEST", 32)
    assert f"own error of {METHOD}" in failing(NAME, references)


def test_a_comparison_ends_where_rounding_hides_everything(references):
    reference = store.load(NAME, references)
    grown = replace(reference, certificate={**reference.certificate, "amplification": growing()})
    assert followed(reference) == 33
    n = followed(grown)
    assert grown.worst_amplification[n - 1] * 10 * 2.0**-53 <= 1e-6 < grown.worst_amplification[n] * 10 * 2.0**-53


def test_what_an_inexact_parameter_does_is_taken_from_the_motion(references):
    reference, count = store.load(NAME, references), 8
    ivp = reference.ivp()

    def run(gravity):
        return independent_runs.stepped(reference, replace(ivp, parameters={**ivp.parameters, "gravity": gravity}), 33, count)

    exact, far = run(1.0), run(1.0 + 1e-6)
    assert all(not np.any(moved) for moved in independent_runs._inexact(reference, ivp, count, exact).values())
    beside = replace(ivp, parameters={**ivp.parameters, "gravity": 1.0 + 2.0**-52})
    found = independent_runs._inexact(reference, beside, count, exact)
    for part in PARTS:
        assert found[part][-1, 0] == pytest.approx(error_of(far[part], exact[part]) * 2.0**-52 / 1e-6, rel=1e-4, abs=0)


def test_the_command_gives_one_json_object(references, daebench):
    status, out, _ = daebench("reference", "verify", "--folder", references, "--json")
    found = json.loads(out)
    assert (status, found["ok"], [each["name"] for each in found["references"]]) == (0, True, [NAME])
    assert len(found["references"][0]["digits"]) == 9


def test_the_command_exits_1_naming_each_check_that_fails_of_each_reference_and_a_damaged_one(copied, daebench):
    store.save("other-one", {"problem": "", "case": ""}, store.load(NAME, copied).text, copied)
    (copied / "other-one" / "other-one.csv").write_text("t\n")
    altered(NAME, copied, nudged("lam1", "1e-31"))
    status, out, err = daebench("reference", "verify", "--folder", copied)
    assert (status, err) == (1, "")
    assert "other-one fails: files" in out
    assert f"{NAME} fails: lam against lam(p, q)" in out


def test_a_folder_without_references_is_refused(tmp_path, daebench):
    status, out, _ = daebench("reference", "verify", "--folder", tmp_path)
    assert (status, out, daebench.error.code) == (2, "", "no-references-in-folder")

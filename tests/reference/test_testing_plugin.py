"""The functions for testers, and the pytest plugin that hands them out: right codes pass, and wrong ones fail with reasons."""

import importlib.metadata
import json
import math
import subprocess
import sys
import tomllib
from pathlib import Path

import numpy as np
import pytest
from refusals import refused
from rotating import COMPONENTS, NAME, UNIT, texts

from daebench import testing
from daebench.cli import pytest_plugin
from daebench.reference.check.convergence import convergence
from daebench.reference.keep.store import save
from daebench.systems.files.package import folder as folder_of
from daebench.testing import assert_agrees, assert_converges, assert_solver_converges, reference_trajectory

pytest_plugins = ["pytester"]

UP = np.array([0.0, 1.0])


OUTSIDE = """
from pathlib import Path

import numpy as np
import pytest

NAME, UP = "planar_pendulum-rotating", np.array([0.0, 1.0])


@pytest.fixture
def reference(reference_trajectory):
    return reference_trajectory(NAME, folder=Path({folder!r}))


def rattle(p, q, h, share=0.5):
    u = q + h * (p - h / 2 * UP)
    q1 = u - (u @ q - np.sqrt((u @ q) ** 2 - u @ u + 1)) * q
    p1 = (q1 - q) / h - share * h * UP
    return p1 - (p1 @ q1) * q1, q1


def test_the_reference_is_there(reference):
    assert reference.q.shape == reference.p.shape == (17, 2)
    assert reference.horizon == 2 and reference.bound["q"].max() < 1e-30


def test_rattle(assert_converges, reference):
    assert_converges(rattle, reference, 2)


def test_wrong_half_kick(assert_converges, reference):
    assert_converges(lambda p, q, h: rattle(p, q, h, share=0.6), reference, 2)


def test_order_3(assert_converges, reference):
    assert_converges(rattle, reference, 3)


def test_unknown(reference_trajectory):
    reference_trajectory("planar_pendulum-rotatin", folder=Path({folder!r}))
"""


def keep(folder, *, bound=1e-33, amplification=1.0, double=None):
    """Store the rotating pendulum up to t = 2 from its closed form, with a certificate that says what it is told to."""
    t = [k / 8 for k in range(17)]
    text = dict(zip(("t", *COMPONENTS), zip(*([str(x), *texts(x, 34)] for x in t), strict=True), strict=True))
    certificate = json.loads((folder_of("daebench.reference") / "data" / NAME / "certificate.json").read_text())
    for name in ("data", "format", "checksum"):
        del certificate[name]
    certificate["definition"]["parameters"] = {name: str(value) for name, value in UNIT.items()}
    certificate["horizon"]["double"] = double
    certificate["amplification"] |= dict.fromkeys(("values", "worst", "step"), [amplification] * len(t))
    certificate["bound"] |= {part: [[bound] * 2] * len(t) for part in "qp"} | {"lam": [[bound]] * len(t)}
    save(NAME, certificate, text, folder)
    return reference_trajectory(NAME, folder=folder)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    place = tmp_path_factory.mktemp("references")
    keep(place)
    return place


@pytest.fixture
def reference(folder):
    return reference_trajectory(NAME, folder=folder)


def rattle(p, q, h):
    """HLW (1.26) on the unit circle, its first multiplier in closed form."""
    u = q + h * (p - h / 2 * UP)
    q1 = u - (u @ q - math.sqrt((u @ q) ** 2 - u @ u + 1)) * q
    p1 = (q1 - q) / h - h / 2 * UP
    return p1 - (p1 @ q1) * q1, q1


def shake(p, q, h, t):
    """HLW (1.22), of two steps, with the central difference for p."""
    past, n = [q, rattle(p, q, h)[1]], round(t[-1] / h)
    for _ in range(n):
        u = 2 * past[-1] - past[-2] - h**2 * UP
        past.append(u - (u @ past[-1] - math.sqrt((u @ past[-1]) ** 2 - u @ u + 1)) * past[-1])
    Q, rows = np.array(past), np.rint(t / h).astype(int)
    return (Q[rows + 1] - Q[rows - 1]) / (2 * h), Q[rows]


@pytest.fixture
def outside(pytester, folder, monkeypatch):
    """Run a file of tests that knows nothing of ours, with no plugin but this one and every warning an error."""
    monkeypatch.setenv("PYTEST_DISABLE_PLUGIN_AUTOLOAD", "1")
    pytester.makepyfile(OUTSIDE.replace("{folder!r}", repr(str(folder))))
    return pytester.runpytest_subprocess("-p", "daebench.cli.pytest_plugin", "-W", "error", "-p", "no:cacheprovider")


def test_in_a_test_file_outside_right_codes_pass_and_wrong_ones_say_why_in_lines_of_the_tester(outside):
    outside.assert_outcomes(passed=2, failed=3)
    outside.stdout.fnmatch_lines(
        [
            "E*AssertionError: The order in q and p cannot be determined*",
            "E*0.0625*plateau*plateau",
            "E*AssertionError: The order in q is 2.00 (standard error *), but 3 was claimed.",
            "E*The order in p is 2.00 (standard error *), but 3 was claimed.",
            "E*BadInput: *'planar_pendulum-rotatin'*planar_pendulum-rotating?",
        ]
    )
    shown = {line.split(":")[0] for line in outside.outlines if ".py:" in line and not line.startswith(("E ", "FAILED"))}
    assert shown == {"test_in_a_test_file_outside_right_codes_pass_and_wrong_ones_say_why_in_lines_of_the_tester.py"}


def test_the_plugin_is_fixtures_and_nothing_else():
    public = {name for name in vars(pytest_plugin) if name.isidentifier() and not name.startswith("_")}
    assert public == {*testing.__all__, "Any", "import_module", "pytest"} - {"Step"}


HEAVY = {"sympy", "llvmlite", "pandas", "mpmath", "scipy", "heyoka", "typer"}


@pytest.mark.parametrize(
    ("module", "without"),
    [("daebench.cli.pytest_plugin", {*HEAVY, "numpy", "daebench.reference"}), ("daebench.testing", {*HEAVY, "pytest"})],
)
def test_importing_the_plugin_or_its_functions_needs_no_heavy_package(module, without):
    before = "pytest" if "pytest" not in without else "os"
    code = f"import sys, {before}; before = {{*sys.modules}}; import {module}; print(*{{*sys.modules}} - before)"
    told = subprocess.run([sys.executable, "-W", "error", "-c", code], capture_output=True, text=True, check=True)
    assert not without & {*told.stdout.split()}


def test_the_project_registers_the_plugin_under_its_own_name():
    project = tomllib.loads((Path(__file__).parents[2] / "pyproject.toml").read_text())["project"]
    points = project["entry-points"]["pytest11"]
    assert list(points) == ["daebench"]
    assert importlib.metadata.EntryPoint("daebench", points["daebench"], "pytest11").load() is pytest_plugin


def test_a_problem_and_a_case_name_a_reference_as_well(folder, reference):
    assert reference_trajectory("planar_pendulum", "rotating", folder=folder).text == reference.text


def test_a_case_without_a_reference_is_told_how_to_build_it(folder):
    with refused("no-reference", says=("planar_pendulum-horizontal",)):
        reference_trajectory("planar_pendulum", folder=folder)


def test_rattle_has_order_2_and_neither_less_nor_more(reference):
    assert_converges(rattle, reference, 2)
    assert_converges(rattle, reference, 2.1)
    with pytest.raises(AssertionError, match=r"(?s)order in q is 2\.00.*order in p is 2\.00"):
        assert_converges(rattle, reference, 2.2)


def test_a_method_whose_momenta_alone_are_of_first_order_is_found_out(reference):
    def late(p, q, h):
        p1, q1 = rattle(p, q, h)
        return p1 * (1 + h**2 / 10), q1

    assert_converges(late, reference, 1)
    with pytest.raises(AssertionError, match="but 2 was claimed"):
        assert_converges(late, reference, 2)


def test_a_two_step_method_is_judged_by_its_whole_run(reference):
    assert_solver_converges(shake, reference, 2)
    with pytest.raises(AssertionError, match="but 3 was claimed"):
        assert_solver_converges(shake, reference, 3)


def test_a_step_that_writes_into_its_arguments_is_judged_the_same(reference):
    def in_place(p, q, h):
        p[:], q[:] = rattle(p, q, h)
        return p, q

    assert_converges(in_place, reference, 2)


def wrong_gravity(p, q, h):
    p1, q1 = rattle(p, q, h)
    return p1 - 0.01 * h * (UP - q1[1] * q1), q1


WRONG = {
    "another parameter": (wrong_gravity, {}, "q and p .* stop decreasing far above rounding"),
    "p and q exchanged": (lambda p, q, h: rattle(q, p, h)[::-1], {"h": 2**-6}, "stop decreasing far above rounding"),
    "not finite": (lambda p, q, h: (p * math.nan, q * math.nan), {}, "not finite; give a smaller h"),
    "too coarse": (rattle, {"h": 0.25, "halvings": 2}, "give a smaller h, or a shorter t_end"),
}


@pytest.mark.parametrize("name", WRONG)
def test_without_an_asymptotic_part_the_message_says_what_to_change(reference, name):
    step, options, message = WRONG[name]
    with pytest.raises(AssertionError, match=message):
        assert_converges(step, reference, 2, **options)


def test_a_code_that_is_at_rounding_throughout_is_told_to_take_larger_steps(reference):
    def exact(p, q, h, t):
        rows = np.searchsorted(reference.t, t)
        return reference.p[rows] * (1 + 2**-52), reference.q[rows] * (1 + 2**-52)

    with pytest.raises(AssertionError, match=r"q and p .* at rounding; give a larger h"):
        assert_solver_converges(exact, reference, 2)


@pytest.mark.parametrize(("bound", "amplification"), [(1e-3, 1.0), (1e-33, 1e12)], ids=["bound", "amplification"])
def test_errors_that_the_reference_cannot_tell_from_none_are_left_out(tmp_path, bound, amplification):
    reference = keep(tmp_path, bound=bound, amplification=amplification)
    found = convergence(shake, reference, t_end=1, h=1 / 16, halvings=6)
    floor = bound * math.sqrt(2) + 10 * 2**-53 * amplification * np.abs(reference.q).max()
    np.testing.assert_allclose(found.floor["q"], floor, rtol=1e-14)
    assert [reason == "round-off" for reason in found.fits["q"].reasons] == list(found.errors["q"] <= floor)


def test_errors_are_the_largest_norms_over_the_stored_times_that_every_run_meets(reference):
    def off(p, q, h, t):
        np.testing.assert_array_equal(t, [0.25, 0.5, 0.75, 1.0])
        rows, d = np.searchsorted(reference.t, t), np.array([[1, 0], [0, 0], [3, 4], [0, 2]])
        return reference.p[rows] + h**3 * d, reference.q[rows] - h**2 * d

    found = convergence(off, reference, t_end=1, h=1 / 4, halvings=3)
    h = np.array([1 / 4, 1 / 8, 1 / 16, 1 / 32])
    np.testing.assert_array_equal(found.h, h)
    np.testing.assert_allclose(found.errors["q"], 5 * h**2, rtol=1e-11)
    np.testing.assert_allclose(found.errors["p"], 5 * h**3, rtol=1e-10)


REFUSED = {
    "beyond the horizon": ({"t_end": 4}, "end-beyond-horizon"),
    "beyond doubles": ({"t_end": 1.75}, "end-beyond-double-precision"),
    "no stored time": ({"t_end": 0.3, "h": 0.1}, "end-not-a-stored-time"),
    "no whole number of steps": ({"h": 0.3}, "end-not-a-stored-time"),
    "one halving": ({"halvings": 1}, "halvings-below-two"),
    "too many": ({"halvings": 40}, "halved-steps-too-many"),
    "half a halving": ({"halvings": 2.5}, "not-whole"),
    "no step": ({"h": 0}, "not-positive"),
    "no order": ({"order": math.nan}, "not-finite"),
    "no pair": ({"step": lambda p, q, h: None}, "state-not-arrays"),
    "wrong shape": ({"step": lambda p, q, h: (p, q[:1])}, "state-shape-wrong"),
}


def test_what_cannot_be_meant_is_refused(tmp_path):
    reference = keep(tmp_path, double=1.5)
    for changes, code in REFUSED.values():
        with refused(code):
            assert_converges(**{"step": rattle, "problem": reference, "order": 2} | changes)


def test_what_a_step_raises_is_raised_with_the_step_size(reference):
    def breaking(p, q, h):
        return rattle(p, q, h) if h > 1 / 40 else 1 / 0

    with pytest.raises(ZeroDivisionError) as stop:
        assert_converges(breaking, reference, 2)
    assert "h = 0.015625" in stop.value.__notes__[0]


def test_a_trajectory_agrees_with_itself_in_any_order_of_times(reference):
    rows = [5, 0, 16]
    assert_agrees(reference, t=reference.t[rows], q=reference.q[rows], p=reference.p[rows], digits=17)


def test_digits_are_counted_in_units_of_the_largest_modulus(reference):
    q, p = reference.q.copy(), reference.p.copy()
    q[9, 1] += 1e-6
    q[12, 0] -= 1e-5
    assert np.abs(reference.q).max() == pytest.approx(1)
    assert_agrees(reference, t=reference.t, q=q, p=p, digits=4.99)
    with pytest.raises(
        AssertionError, match=r"First: 6\.0 digits of q2 at t = 1\.125, .* 16\.0(?s:.*)Least: 5\.0 digits of q1 at t = 1\.5"
    ):
        assert_agrees(reference, t=reference.t, q=q, p=p, digits=7)
    p[3, 0] = math.nan
    with pytest.raises(AssertionError, match=r"-inf digits of p1 at t = 0\.375"):
        assert_agrees(reference, t=reference.t, q=q, p=p, digits=-5)


def test_momenta_are_counted_in_their_own_units(reference):
    size = np.abs(reference.p).max()
    assert size > 2
    assert_agrees(reference, t=reference.t, q=reference.q, p=reference.p + 1e-6 * size, digits=5.99)
    with pytest.raises(AssertionError, match=r"First: 6.0 digits of p\d at t = 0,"):
        assert_agrees(reference, t=reference.t, q=reference.q, p=reference.p + 1e-6 * size, digits=6.01)


def test_a_time_that_is_not_stored_and_a_trajectory_of_another_length_are_refused(reference):
    with refused("reference-time-not-stored", says=("0.1",)):
        assert_agrees(reference, t=[0, 0.1], q=reference.q[:2], p=reference.p[:2], digits=3)
    with refused("state-shape-wrong"):
        assert_agrees(reference, t=reference.t, q=reference.q[:5], p=reference.p[:5], digits=3)

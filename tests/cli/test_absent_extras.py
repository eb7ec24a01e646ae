"""Studies of several methods of which some need a package that is not installed: the others are run, and what is missing is said."""

import itertools
import sys

import pytest

STUDIES = {
    "work-precision": ("--methods", "{},scipy:RK23", "--tol", "1e-3", "--t-end", 0.25, "--repeat", 0),
    "precision": ("--methods", "{},strang", "--ways", "float64", "--h", "0.0625", "--t-end", 0.25, "--repeat", 0),
    "stability": ("--methods", "{},strang", "--only", "step-limit", "--t-end", 0.25),
}
"""Requests whose methods are one that is not installed and one that is."""


@pytest.mark.sampled(by=lambda case: case in ("work-precision-planar_pendulum-heyoka", "stability-planar_pendulum-heyoka solve_dae"))
@pytest.mark.parametrize(
    ("problem", "absent"),
    [*itertools.product(["planar_pendulum"], ["heyoka", "solve_dae", "heyoka solve_dae"]), ("lotka_volterra", "heyoka")],
)
@pytest.mark.parametrize("study", STUDIES)
@pytest.mark.usefixtures("uncompiled_schemes", "uncompiled_poisson_schemes")
def test_what_is_not_installed_is_left_out_of_a_study_and_said(study, absent, problem, daebench, monkeypatch, tmp_path):
    names, absent = {"heyoka": "heyoka:taylor", "solve_dae": "solve_dae:Radau"}, absent.split()
    for package in absent:
        monkeypatch.setitem(sys.modules, package, None)
    asked = [str(word).format(",".join(names[package] for package in absent)) for word in STUDIES[study]]
    status, out, err = daebench(study, problem, *asked, "--workers", 1, "--out", tmp_path)
    assert (status, err) == (0, "")
    for package in absent:
        assert f"{names[package]} needs {package}, which is not installed; install it by pip install 'daebench[peers]'" in out
    assert out.count("is not installed") == len(absent)
    tables = [path.read_text(encoding="utf-8") for path in tmp_path.glob("*.csv")]
    assert tables
    assert all(("strang" in table or "RK23" in table) and "heyoka" not in table for table in tables)


@pytest.mark.parametrize("study", ["precision"])
def test_a_study_of_what_is_not_installed_alone_is_refused(study, daebench, monkeypatch, tmp_path):
    monkeypatch.setitem(sys.modules, "heyoka", None)
    monkeypatch.setitem(sys.modules, "solve_dae", None)
    asked = [word for word in map(str, STUDIES[study]) if "," not in word]
    place = asked.index("--methods") + 1
    status, _, err = daebench(
        study, "planar_pendulum", *asked[:place], "heyoka:taylor,solve_dae:Radau", *asked[place:], "--out", tmp_path / "new"
    )
    assert status == 2
    assert err.count("is not installed; install it by pip install") == 2
    assert len(err.splitlines()) == 1
    assert not (tmp_path / "new").exists()

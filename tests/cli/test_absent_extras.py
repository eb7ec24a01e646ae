"""Studies of several methods of which some need a package that is not installed: the others are run, and what is missing is said."""

import itertools
import sys

import pytest

STUDIES = {
    "work-precision": "--methods {},scipy:RK23 --tol 1e-3 --t-end 0.25 --repeat 0",
    "precision": "--methods {},strang --ways float64 --h 0.0625 --t-end 0.25 --repeat 0",
    "stability": "--methods {},strang --only step-limit --t-end 0.25",
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
    asked = STUDIES[study].format(",".join(names[package] for package in absent)).split()
    status, out, err = daebench(study, problem, *asked, "--workers", 1, "--out", tmp_path)
    assert (status, err, out.count("is not installed")) == (0, "", len(absent))
    assert [package for package in absent if f"{names[package]} needs {package}" not in out] == []
    tables = [path.read_text(encoding="utf-8") for path in tmp_path.glob("*.csv")]
    assert tables
    assert all(("strang" in table or "RK23" in table) and "heyoka" not in table for table in tables)


def test_a_study_of_what_is_not_installed_alone_is_refused(daebench, monkeypatch, tmp_path):
    for package in ("heyoka", "solve_dae"):
        monkeypatch.setitem(sys.modules, package, None)
    words = "precision planar_pendulum --methods heyoka:taylor,solve_dae:Radau --ways float64 --h 0.0625 --t-end 0.25 --repeat 0 --out"
    status, _, err = daebench(*words.split(), tmp_path / "new")
    assert (status, err.count("is not installed"), err.count("\n")) == (2, 2, 1)
    assert not (tmp_path / "new").exists()

"""The report on extremes: small runs make a whole page, its claims are refuted by faults, and its sections can be made as declared."""

from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from functools import partial

import pandas as pd
import pytest
from pages import standalone

from daebench.pages.report import build
from daebench.pages.report.claims import ClaimRefuted
from daebench.reports.extremes import sections
from daebench.reports.extremes.findings import horizons, limits, ratios
from daebench.studies.precision import WAYS, specifications_of
from daebench.studies.stability.extreme import Asked
from daebench.studies.stability.study import EXTREMES

PENDULUM = Asked(problem="planar_pendulum", case="near_top", methods=("rattle", "rk4"), t_end=4.0, h=(0.25, 0.125))
SMALL = {
    "steps": PENDULUM,
    "map": replace(PENDULUM, parameters={"gravity": (1.0, 100.0)}),
    "masses": Asked(problem="double_pendulum", case="swing", methods=("rattle",), t_end=0.5, h=(0.05,), parameters={"mass1": (0.1, 1e3)}),
    "chaos": PENDULUM,
}


@pytest.fixture
def small(monkeypatch):
    """Make a small report without the compiler."""
    few = tuple(replace(section, asked=SMALL[section.key]) for section in sections.SECTIONS if section.key in SMALL)
    monkeypatch.setattr(sections, "SECTIONS", few)
    monkeypatch.setattr(sections, "PRECISION", replace(PENDULUM, methods=("rattle",), h=(0.125,), t_end=0.5))
    one_thread = partial(ThreadPoolExecutor, 1)
    monkeypatch.setattr(sections, "measure", partial(sections.measure, processes=one_thread))
    return few


@pytest.mark.slow
@pytest.mark.usefixtures("uncompiled_schemes")
def test_a_small_report_is_a_whole_page(small, tmp_path):
    told = []
    page = build("extremes", tmp_path, lambda fraction, doing: told.append(fraction)).read_text(encoding="utf-8")
    assert told == sorted(told)
    assert told[-1] == 1.0
    for section in small:
        assert f'id="{section.key}"' in page
        assert (tmp_path / "extremes" / "figures" / f"{section.key}.csv").exists()
    assert page.count("<figure") == len(small) + 1
    standalone(tmp_path / "extremes" / "index.html")
    assert (tmp_path / "extremes" / "tables" / "precision.csv").exists()


def test_a_run_that_keeps_the_energy_and_does_not_end_refutes_it():
    steps = pd.DataFrame({"method": "a", "h": [0.5, 0.1], "fails": [0.6, 0.2]}, index=["completes", "keeps the energy"])
    steps = steps.rename_axis("verdict").reset_index()
    assert limits(steps).room == pytest.approx([5.0])
    two = pd.concat([steps, steps.assign(method="b", h=[0.5, 0.25], fails=[float("inf"), 0.3])])
    assert (limits(two).most, limits(two).least, limits(two).best) == (["b"], True, ["b"])
    with pytest.raises(ClaimRefuted):
        limits(steps.assign(h=[0.5, 0.6]))


def test_rattle_off_its_manifold_refutes_it():
    runs = pd.DataFrame({"method": "rattle", "failure": "", "g": [1e-16, 1e-15], "outcome": "fine", "varied": [0.1, 1.0]})
    assert ratios(runs).fine == ratios(runs).through == ["rattle"]
    assert ratios(runs.assign(outcome=["fine", "coarse"])).fine == []
    assert ratios(runs.assign(failure=["", "stopped"])).through == []
    with pytest.raises(ClaimRefuted):
        ratios(runs.assign(g=[1e-16, 1e-9]))


def test_a_run_that_follows_longer_than_its_digits_can_refutes_it():
    runs = pd.DataFrame({"method": ["a", "b"], "horizon": [12.0, 17.0]}).assign(double_horizon=19.0, tenfold=1.4, t_end=20.0, grown=1e9)
    assert horizons(runs).methods == ["b"]
    with pytest.raises(ClaimRefuted):
        horizons(runs.assign(horizon=[25.0, 17.0]))


def test_every_section_has_its_extreme():
    for section in sections.SECTIONS:
        assert EXTREMES[section.extreme].refusal(section.asked) == "", section.key
    assert {way for way, _ in specifications_of(sections.PRECISION)[0]} == set(WAYS)

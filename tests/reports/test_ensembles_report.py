"""The report on ensembles: runs by themselves, conclusions from numbers that are known, claims that faults refute, and the page."""

import itertools
from functools import cache

import numpy as np
import pandas as pd
import pytest
from reported import tables_of_page
from tampered import changed

import daebench
from daebench.diagnostics.energy_verdict import energy_scales, energy_verdict, size
from daebench.pages.report import build
from daebench.pages.report.claims import ClaimRefuted
from daebench.reports import ensembles
from daebench.reports.ensembles import check, measured
from daebench.reports.ensembles.errors import errors, winners
from daebench.reports.ensembles.measured import Numbers, measure
from daebench.reports.ensembles.motions import FRACTIONS, METHODS, MOTIONS, STRUCTURED, Motion
from daebench.reports.ensembles.verdicts import trends

STARTS = 40
MEDIANS = dict(zip(METHODS, (1e-3, 1e-4, 1e-5, 1e-6, 1e-2), strict=True))


@cache
def made(*, stops=0.25):
    """Return numbers with known answers: errors are uniform in the logarithm over two decades, the case's own is the smallest.

    From a tenth of the starts, and from that of the case, rattle changes places with lobatto3; the last motion stops from a quarter.
    """
    rows = []
    for motion, fraction, method in itertools.product(MOTIONS, FRACTIONS, METHODS):
        start = np.arange(STARTS)
        other = {"rattle": "lobatto3", "lobatto3": "rattle"}.get(method, method)
        medians = np.where(start < STARTS // 10, MEDIANS[other], MEDIANS[method])
        own = pd.DataFrame({"start": start, "size": medians / fraction**2 * 10 ** np.linspace(-1, 1, STARTS)})
        own = own.assign(motion=motion.key, method=method, price=fraction, h=motion.h / fraction, failure="")
        own["verdict"] = np.where(start == 0, "undetermined", "bounded" if method in STRUCTURED else "drifts")
        if motion is MOTIONS[-1] and stops:
            own.loc[start >= STARTS * (1 - stops), ["size", "verdict", "failure"]] = [np.inf, "failed", "no convergence"]
        rows.append(own)
    alone = pd.DataFrame({"motion": [motion.key for motion in MOTIONS], "together": 10.0, "alone": 60.0, "starts": 6.0})
    prices = pd.concat([pd.DataFrame({"motion": motion.key, "method": METHODS, "together": 10.0, "ratio": 1}) for motion in MOTIONS])
    return Numbers(MOTIONS, pd.concat(rows, ignore_index=True), prices, alone, {motion.key: "drawn." for motion in MOTIONS})


def test_conclusions_are_those_that_the_numbers_were_made_for():
    found = check(made())
    assert found.starts == STARTS
    assert found.errors.n == (len(MOTIONS) - 1) * len(METHODS) * len(FRACTIONS)
    assert found.errors.off == found.errors.n
    assert found.first.n == len(MOTIONS) * len(FRACTIONS)
    assert len(found.first.wrong) == found.first.n
    assert set(found.first.wrong["own"]) == {"rattle"}
    assert set(found.first.wrong["most"]) == {"lobatto3"}
    assert found.first.least == pytest.approx(0.9 - 0.1 / 3, abs=1e-12)
    assert found.hidden.n == found.hidden.of == len(METHODS) * len(FRACTIONS)
    assert found.hidden.worst["part"] == 0.25
    assert found.verdict.differs == found.verdict.n
    assert found.verdict.least_flat == 1
    assert (found.price.least, found.price.most) == (6, 6)


def test_quantiles_ranks_and_parts_are_those_of_the_definitions():
    some = pd.DataFrame({"motion": "m", "method": METHODS[0], "price": 1, "h": 0.1, "start": range(5), "failure": ["", "", "", "", "stop"]})
    some = some.assign(size=[3.0, 1.0, 2.0, 4.0, np.inf], verdict=["drifts", "bounded", "kept", "bounded", "failed"])
    (row,) = errors(some).to_dict("records")
    assert (row["own"], row["low"], row["median"], row["high"], row["rank"], row["stopped"]) == (3, 1, 3, np.inf, 0.4, 0.2)
    (row,) = trends(some).to_dict("records")
    assert (row["own"], row["drifts"], row["failed"], row["most"]) == ("drifts", 0.2, 0.2, "bounded")
    assert row["flat"] == pytest.approx(0.6, abs=1e-15)
    assert row["undetermined"] == pytest.approx(0, abs=1e-15)
    others = [some.assign(method=method, size=[9.0, 9.0, 1.0, 9.0, np.inf]) for method in METHODS[1:]]
    (row,) = winners(pd.concat([some, *others])).to_dict("records")
    assert (row["own"], row["most"], row["part"], row["none"]) == (METHODS[0], METHODS[0], 0.75, 0.2)


@pytest.mark.slow
@pytest.mark.usefixtures("uncompiled_schemes")
def test_errors_and_verdicts_are_those_of_runs_by_themselves(monkeypatch):
    monkeypatch.setattr(measured, "METHODS", ("rattle", "rk4"))
    monkeypatch.setattr(measured, "TIMED", 2)
    monkeypatch.setattr(measured, "LONGER", 3)
    motion = Motion("spherical_pendulum", "fig1.2", "pendulum", 0.04, 4.0)
    numbers = measure(lambda part, doing: None, [motion], 4)
    runs = numbers.runs
    assert len(runs) == 2 * len(FRACTIONS) * 4
    some, about = measured.drawn(motion, 4)
    assert "energy" in about
    assert len({round(float(some.member(i).value("H", *some.member(i).start)), 9) for i in range(4)}) == 1
    for row in runs[runs["start"] < 2].to_dict("records"):
        ivp = some.member(row["start"])
        alone = daebench.run(ivp, method=row["method"], h=row["h"], t_end=4.0)
        assert row["size"] == pytest.approx(float(size(alone.maxima["energy"], energy_scales(ivp, alone))), rel=1e-12)
        assert row["verdict"] == energy_verdict(ivp, alone).verdict
    assert runs.groupby("price")["h"].max().tolist() == [h * numbers.prices["ratio"].max() for h in (0.04, 0.02, 0.01)]


@pytest.mark.sampled(left_out=("0",))
@pytest.mark.parametrize("stops", [0, 0.25])
def test_the_page_is_made_of_its_numbers(tmp_path, monkeypatch, stops):
    rows = tables_of_page(ensembles, "ensembles", made(stops=stops), ("errors", "winners", "verdicts"), tmp_path, monkeypatch)
    assert rows["errors"] == rows["verdicts"] == len(MOTIONS) * len(METHODS) * len(FRACTIONS)


FAULTS = {
    "symplectic methods drift": changed("runs", "verdict", "drifts", "method == 'rattle'"),
    "nothing drifts": changed("runs", "verdict", "bounded"),
    "many starts cost more": changed("alone", "starts", 0.9),
}


@pytest.mark.parametrize("fault", FAULTS.values(), ids=FAULTS)
def test_a_number_that_refutes_a_claim_stops_the_page(fault, tmp_path, monkeypatch):
    monkeypatch.setattr(ensembles, "measure", lambda tell: fault(made()))
    with pytest.raises(ClaimRefuted):
        build("ensembles", tmp_path)
    assert not (tmp_path / "ensembles" / "index.html").exists()

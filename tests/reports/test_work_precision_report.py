"""The report on work against precision: a small one of real runs, kept and resumed, and its sentences on planted numbers."""

import re
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from pages import standalone
from uncompiled import Uncompiled

from daebench.errors import Interrupted
from daebench.pages.report import build
from daebench.pages.report.claims import ClaimRefuted
from daebench.pages.report.tables import write_tables
from daebench.records.store import opened
from daebench.reports import work_precision
from daebench.reports.work_precision import tables
from daebench.reports.work_precision.conclusions import check
from daebench.reports.work_precision.works import WANTED, WORKS, Numbers, Work, measure
from daebench.studies.grid.claimed import THINGS
from daebench.studies.grid.measure import row_of
from daebench.studies.work_precision.study import LEVELS, standard, with_conserved, with_costs


@dataclass(frozen=True)
class Small(Work):
    """A motion with three methods and four values of each."""

    def study(self):
        steps, tol = [1 / 8, 1 / 16, 1 / 32, 1 / 64], [1e-4, 1e-6, 1e-8, 1e-10]
        methods = ["rattle", "rk4", "scipy:DOP853"]
        return standard(self.problem, case=self.case, methods=methods, h=steps, tol=tol, t_end=self.t_end, repeat=1)


SMALL = Small("planar_pendulum", "rotating", 4.0, "Pendulum", "one that turns over")


def stems(work):
    """Return paths with the names of the figures of a report of one motion."""
    return [Path(name) for name in ("overview", work.key, f"{work.key}-all", f"{work.key}-evaluations")]


@pytest.fixture
def pools(monkeypatch):
    """Have methods run uncompiled; return what opens a pool of one thread, and a list of those opened."""
    monkeypatch.setattr("daebench.methods.names.FixedStep", Uncompiled)
    opened = []
    return lambda: opened.append("a pool") or ThreadPoolExecutor(1), opened


def test_a_small_report_is_made_kept_and_made_again_without_a_run(tmp_path, monkeypatch, pools):
    monkeypatch.setattr(work_precision, "measure", lambda folder, tell: measure(folder, tell, [SMALL], pools[0]))
    monkeypatch.setattr("daebench.pages.report.page.picture", lambda *arguments: "")
    monkeypatch.setattr(work_precision, "draw", lambda *_: stems(SMALL))
    first = build("work-precision", tmp_path).read_text(encoding="utf-8")
    assert len(pools[1]) == 1
    monkeypatch.setattr("daebench.studies.grid.measure.row_of", lambda specification: pytest.fail("a run"))
    told = []
    second = build("work-precision", tmp_path, lambda fraction, doing: told.append(fraction)).read_text(encoding="utf-8")
    assert len(pools[1]) == 1
    assert told == sorted(told)
    strip = re.compile(r"The last call took \d+ s")
    assert strip.sub("", first) == strip.sub("", second)
    defects = pd.read_csv(tmp_path / "work-precision" / "tables" / "defects.csv").set_index("method")["defect"]
    assert defects["rattle"] < 1e-13 < 1e-6 < defects["rk4"]
    assert set(defects.index) == {"rattle", "rk4"}
    for link in re.findall(r'href="(tables/[^"#]+)"', first):
        assert (tmp_path / "work-precision" / link).is_file(), link


def test_an_interruption_says_what_is_kept(tmp_path, monkeypatch, pools):
    real, made = row_of, []

    def one_only(specification):
        if made:
            raise KeyboardInterrupt
        made.append(specification)
        return real(specification)

    monkeypatch.setattr("daebench.studies.grid.measure.row_of", one_only)
    with pytest.raises(Interrupted, match=r"1 runs"):
        measure(tmp_path, lambda *told: None, [SMALL], pools[0])
    with opened(tmp_path / "studies.db") as store:
        assert len(store) == 1


# ---- planted numbers


H = 0.5 ** np.arange(3, 11)


def power_law(method, order, price, *, verdict="bounded", knob="h", drift=1e-3, **more):
    """Return runs whose error is h^order, at this price a step."""
    errors = np.maximum(H**order, 1e-15)
    columns = {"problem": "planar_pendulum", "case": "rotating", "method": method, "knob": knob, "value": H}
    columns |= {"error_q": errors, "bound_q": 1e-16, "seconds": price / H, "callback_seconds": np.nan, "steps": 1 / H, "failure": ""}
    columns |= {
        "energy_error": drift,
        "energy_verdict": verdict,
        "energy_scale": 1.0,
        "t_end": 10.0,
        "g": 1e-16,
        "Gv": 1e-15,
        "integrals": 1e-9,
        "n_H_p": 4 / H,
        "n_steps": 1 / H,
    }
    return pd.DataFrame(columns | more)


PLANTED = replace(WORKS[0], problem="planar_pendulum", case="rotating", title="Pendulum")
DEFECTS = {"verlet": 1e-15, "fourth": 1e-15, "drifter": 1e-3}
CLAIMS = {"verlet": THINGS, "fourth": THINGS}


@pytest.fixture
def numbers():
    """Return runs of four methods by power laws: a symplectic pair, a cheap one that drifts, an expensive solver."""
    kinds = {"verdict": "drifts", "g": 1e-3}
    parts = [power_law("verlet", 2, 1e-6), power_law("fourth", 4, 5e-6), power_law("drifter", 4, 2e-6, **kinds)]
    parts += [power_law("solver", 4, 1e-3, knob="tol", **kinds).assign(n_H_p=1 / H)]
    failed = power_law("fourth", 4, 5e-6).iloc[:1].assign(value=1.0, error_q=np.nan, seconds=np.nan, failure="it stopped.")
    table = with_conserved(with_costs(pd.concat([*parts, failed], ignore_index=True)), DEFECTS, CLAIMS)
    rows = [(PLANTED.key, name, 0.1, name != "drifter", defect) for name, defect in DEFECTS.items()]
    defects = pd.DataFrame(rows, columns=["key", "method", "h", "claimed", "defect"])
    left_out = pd.DataFrame([(PLANTED.key, "other", "other needs what is not there.")], columns=["key", "method", "why"])
    return Numbers((PLANTED,), {PLANTED.key: table}, defects, left_out)


def test_winners_and_prices_are_those_of_the_power_laws(numbers):
    found = check(numbers)
    own = found.found[PLANTED.key]
    winners = own.winners.set_index("level")
    # verlet costs 1e-6 level^(-1/2), the drifter 2e-6 level^(-1/4): the same at level 1/16
    assert set(winners["method"][winners.index <= 1e-4]) == {"drifter"}
    assert winners["ratio"][1e-6] == pytest.approx(2.5, rel=1e-9)
    assert winners["next"][1e-6] == "fourth"
    assert set(winners["method_counted"][winners.index <= 1e-4]) == {"solver"}
    assert found.price["energy"].most == pytest.approx(2.5, rel=1e-9)
    assert found.price["energy"].n == 3
    advice = own.advice.set_index(["level", "conserve"])["method"]
    assert advice[1e-6].to_dict() == {"nothing": "drifter", "energy": "fourth", "constraints": "fourth", "two_form": "fourth"}
    assert (found.total, found.failed) == (33, 1)
    assert (found.structure.claiming, found.structure.level, found.structure.others_level) == (2, 2, 0)
    assert set(winners.index) == {level for level in LEVELS if level >= 1e-12}


def altered(**columns):
    """Return what sets columns of the runs of one method, or of all."""

    def tamper(numbers):
        table = numbers.runs[PLANTED.key]
        chosen = table["failure"] != "" if "seconds" in columns else table["method"] == "fourth"
        table = table.assign(**{name: table[name].where(~chosen, value) for name, value in columns.items()})
        return replace(numbers, runs={PLANTED.key: table})

    return tamper


def defect(method, value):
    def tamper(numbers):
        frame = numbers.defects
        return replace(numbers, defects=frame.assign(defect=frame["defect"].where(frame["method"] != method, value)))

    return tamper


TAMPERED = {
    "a symplectic method is none": defect("verlet", 1e-6),
    "a claim is too modest": defect("drifter", 1e-15),
    "a failed run shows a number": altered(seconds=1.0),
}


@pytest.mark.parametrize("tamper", TAMPERED.values(), ids=TAMPERED)
def test_a_tampered_number_refutes_the_story(numbers, tamper):
    with pytest.raises(ClaimRefuted):
        check(tamper(numbers))


def test_the_page_is_made_of_the_runs(numbers, tmp_path, monkeypatch):
    monkeypatch.setattr(work_precision, "draw", lambda *_: stems(PLANTED))
    monkeypatch.setattr("daebench.pages.report.page.picture", lambda *arguments: "")
    monkeypatch.setattr(work_precision, "measure", lambda folder, tell: numbers)
    text = standalone(build("work-precision", tmp_path)).text
    assert all(words in text for words in ("drifter", "solver", "it stopped.", "other needs"))


def test_tables_are_kept_as_csv_with_all_rows(numbers, tmp_path):
    made = write_tables(tmp_path, tables(numbers, check(numbers)))
    assert len(pd.read_csv(tmp_path / f"runs-{PLANTED.key}.csv")) == 33
    assert len(pd.read_csv(tmp_path / f"advice-{PLANTED.key}.csv")) == 4 * len(WANTED)
    for name, make in made.items():
        assert "nan" not in str(make("A caption")), name


def test_the_standard_set_has_references_that_reach_its_horizons():
    from daebench.reference.keep import store

    assert len({work.key for work in WORKS}) == len(WORKS) >= 5
    assert any(work.poisson for work in WORKS)
    for work in WORKS:
        reference = store.find(work.problem, work.case)
        assert work.t_end <= min(reference.horizon, reference.double_horizon)


def test_a_method_that_begins_to_drift_is_no_longer_recommended(numbers):
    table = numbers.runs[PLANTED.key]
    drifting = with_conserved(
        table.assign(energy_verdict=table["energy_verdict"].where(table["method"] != "fourth", "drifts")), DEFECTS, CLAIMS
    )
    advice = check(replace(numbers, runs={PLANTED.key: drifting})).found[PLANTED.key].advice.set_index(["level", "conserve"])["method"]
    assert advice[1e-6, "energy"] == "verlet"
    assert advice[1e-6, "two_form"] == "fourth"

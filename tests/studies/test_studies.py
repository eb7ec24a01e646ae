"""Studies: grids are checked before the first run, numbers are those of the runs, and what was computed is never computed again."""

import json
import math
import os
import runpy
import signal
import sqlite3
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from contextlib import closing
from dataclasses import replace

import numpy as np
import pytest
from own_files import ORBIT
from refusals import refused

from daebench.methods import run as api
from daebench.methods.fixed_step.constrained import FixedStep
from daebench.methods.fixed_step.poisson import PoissonStep
from daebench.records import code
from daebench.records.rows import StoredRow
from daebench.records.store import LAYOUT, Store, StoreFull, opened
from daebench.reference.keep.store import load
from daebench.reference.solution import reference_solution
from daebench.starts.members import neighbour
from daebench.studies.grid.measure import row_of
from daebench.studies.grid.metrics import METRICS
from daebench.studies.grid.run_specification import GridRun
from daebench.studies.grid.schedulers import dask_cluster
from daebench.studies.grid.specification import key_of, require_possible
from daebench.studies.grid.study import Study
from daebench.systems.files import package as package_files

pytestmark = pytest.mark.usefixtures("uncompiled_schemes")

ROW_OF = "daebench.studies.grid.measure.row_of"
PENDULUM = {"problem": "planar_pendulum", "cases": ["rotating"], "t_end": 4.0}


@pytest.fixture
def store(tmp_path):
    with opened(tmp_path / "rows.db") as found:
        yield found


def study(**more):
    return Study(**{**PENDULUM, "methods": ["rattle"], "values": {"h": [1 / 16, 1 / 32]}, **more})


def one(**more):
    given = {"problem": "planar_pendulum", "case": "rotating", "method": "rattle", "value": 1 / 16, "t_end": 4.0, "metrics": ("energy",)}
    return GridRun(**{**given, **more})


def kept(key, row, specification=(), maker=""):
    return StoredRow(key, dict(specification), row, maker, 0.0)


# ---- the grid


def test_starts_are_an_axis_and_each_run_is_that_from_its_start(store):
    found = study(methods=["rattle", "ida:index2"], values={"h": [1 / 16], "tol": [1e-6]}, starts=range(3), spread=0.02, metrics=["energy"])
    table, ivp = found.table(store), one().ivp
    assert table["start"].tolist() == [0, 1, 2, 0, 1, 2]
    for row in table.itertuples():
        where = neighbour(ivp, 0.02, row.start) if row.start else ivp
        run = api.run(where, method=row.method, t_end=row.t_end, **{"h" if row.method == "rattle" else "tol": row.value})
        assert run.steps == row.steps
        assert row.method != "rattle" or row.energy_error == run.maxima["energy"]
    assert len(set(table["energy_error"])) == len({key_of(run) for run in found.specifications()}) == 6
    assert key_of(one(start=1, spread=0.01)) != key_of(one(start=1, spread=0.02))


def test_errors_from_other_starts_are_not_taken_against_the_reference_of_the_case(store):
    table = study(values={"h": [1 / 64]}, starts=[0, 1], spread=0.05, metrics=["q"]).table(store)
    assert table["error_q"].max() < 1e-2
    assert len(set(table["error_q"])) == 2


def test_a_grid_is_every_method_with_its_own_values_on_every_case_and_parameter():
    found = study(
        methods=["rattle", "scipy:DOP853", "lobatto3"],
        values={"h": [0.1, 0.05], "tol": [1e-6], "lobatto3": [0.2]},
        cases=["rotating", "near_top"],
        parameters={"gravity": [1.0, 2.0, 3.0]},
        precisions=["float64"],
    ).specifications()
    assert len(found) == (2 + 1 + 1) * 2 * 3
    assert {(each.method, each.value) for each in found} == {("rattle", 0.1), ("rattle", 0.05), ("scipy:DOP853", 1e-6), ("lobatto3", 0.2)}
    assert {each.parameters for each in found} == {(("gravity", x),) for x in (1.0, 2.0, 3.0)}


def test_the_ways_to_compute_are_an_axis():
    ways = {
        "mixed": {"precision": "mixed"},
        "compensated": {"compensated": True},
        "sweeps=2": {"sweeps": 2},
        "newton=1e-6": {"newton": 1e-6},
    }
    plain, *others = study(precisions=["float64", *ways], values={"h": [0.1]}).specifications()
    assert others == [replace(plain, **way) for way in ways.values()]


def test_options_go_to_the_methods_that_have_them_and_others_may_be_beside():
    told = {
        "generalized_alpha": (("rho_inf", 0.5),),
        "ida:index1": (),
        "scipy:DOP853": (),
        "ida:baumgarte": (("alpha", 3.0),),
    }
    found = study(methods=list(told), values={"h": [1 / 16], "tol": [1e-6]}, options={"rho_inf": 0.5, "alpha": 3.0})
    assert {specification.method: specification.options for specification in found.specifications()} == told


BLOW_UP = {"problem": "lotka_volterra_3d", "cases": ["blow_up"]}
CONTRADICTIONS = [
    ("study-starts-not-numbers", {"starts": [-1]}),
    ("below-least", {"repeat": -1}),
    ("study-entry-empty", {"methods": []}),
    ("study-entry-twice", {"values": {"h": [0.1, 0.05, 0.1]}}),
    ("values-missing", {"values": {}}),
    ("not-finite", {"values": {"h": ["small"]}}),
    ("unknown-name", {"metrics": ["enrgy"]}),
    ("unknown-name", {"precisions": ["float16"]}),
    ("study-not-measurable", {**BLOW_UP, "methods": ["strang"], "metrics": ["y"], "t_end": 3.0}),
    ("study-not-measurable", {"methods": ["scipy:DOP853"], "values": {"tol": [1e-6]}, "metrics": ["defect"]}),
    ("study-not-measurable", {"metrics": ["y"]}),
]


def test_a_contradiction_is_told_before_anything_is_run(monkeypatch):
    monkeypatch.setattr(ROW_OF, lambda specification: pytest.fail("run"))
    for wrong, more in CONTRADICTIONS:
        with refused(wrong):
            study(**more).specifications()


# ---- the numbers


OWN = {
    "parameter": {"parameters": {"gravity": [3.0]}},
    "beyond the reference": {"t_end": 101.0, "values": {"h": [101 / 8192]}},
    "no reference": {"problem": "torus", "cases": ["inner"]},
    "a file": {"problem": "./ring.py", "cases": ["turning"]},
    "poisson": {"problem": "lotka_volterra", "cases": ["4,2"], "methods": ["strang"], "metrics": ["y"], "parameters": {"b": [2.5]}},
}


@pytest.mark.usefixtures("plain_functions")
@pytest.mark.sampled(left_out=("beyond the reference", "no reference"))
@pytest.mark.parametrize("more", OWN.values(), ids=OWN)
def test_without_a_certified_reference_errors_are_against_a_finer_run_with_its_bound(folder, more, monkeypatch):
    """The oracle is RATTLE or the splitting itself with much smaller steps, by Richardson of order 2."""
    text = (folder / "ring.py").read_text()
    (folder / "ring.py").write_text(text.replace("        closed_form=closed_form,\n", ""))
    monkeypatch.setattr("daebench.methods.names.PoissonStep", lambda *a, **k: PoissonStep(*a, **k | {"compiled": False}))
    (specification,) = study(**{"metrics": ["q"], "values": {"h": [1 / 64]}, "t_end": 2.0} | more).specifications()
    row = row_of(specification)
    letter = "y" if "y" in specification.metrics else "q"
    assert (row["failure"], row["reference"][:8]) in {("", "own fine"), ("", "closed f")}
    assert 0 < row[f"bound_{letter}"] < 1e-3 * row[f"error_{letter}"]
    states = [
        getattr(specification.at(specification.value / k).solver.solve(specification.ivp, _same_outputs(specification, k)), letter)
        for k in (1, 8, 16)
    ]
    true = (4 * states[2] - states[1]) / 3
    assert row[f"error_{letter}"] == pytest.approx(np.abs(states[0] - true).max(), rel=1e-2)


def _same_outputs(specification, k):
    asked = specification.asked("h")
    return replace(asked, value=specification.value / k, every=k * asked.every)


def test_errors_are_those_against_the_reference_and_have_its_bounds():
    row = row_of(one(metrics=("q", "p", "lam", "manifold")))
    run = api.run("planar_pendulum", case="rotating", method="rattle", h=1 / 16, t_end=4.0, multipliers=True)
    reference = load("planar_pendulum-rotating")
    at, rows = np.arange(0, 65, 2), slice(0, 33)
    assert np.array_equal(run.t[at], reference.t[rows])
    for part in ("q", "p", "lam"):
        assert row[f"error_{part}"] == pytest.approx(np.abs(getattr(run, part)[at] - reference.values[part][rows]).max(), rel=1e-12)
        assert 0 < row[f"bound_{part}"] < 1e-15
    assert row["g"] == run.maxima["g"]
    assert (row["steps"], row["t_reached"], row["failure"]) == (64, 4.0, "")
    assert row["n_solve"] == run.work["solve"]


def test_the_phase_is_the_time_by_which_a_motion_is_late(monkeypatch):
    def slow(self, ivp, request, real=FixedStep.solve):
        t = np.arange(33) / 8
        late = reference_solution(ivp, t[1:] * (1 - 1e-4)).states
        q, p = (np.vstack([start, late[name]]) for name, start in (("q", ivp.q0), ("p", ivp.p0)))
        return replace(real(self, ivp, request), t=t, q=q, p=p)

    monkeypatch.setattr(FixedStep, "solve", slow)
    assert row_of(one(metrics=("phase",)))["phase"] == pytest.approx(4e-4, rel=1e-3)


def test_a_run_that_tells_nothing_shows_no_number():
    failed = row_of(one(problem="spherical_pendulum", case="fig1.2", value=2.0, t_end=50.0, metrics=("energy", "manifold")))
    two = row_of(one(outputs=1))
    for row, why in ((failed, "stopped at t"), (two, "2 states tell nothing")):
        assert why in row["failure"]
        assert np.isnan([row[name] for name in ("energy_error", "energy_slope", "growth")]).all()
    assert math.isnan(failed["g"])


def test_newton_that_is_ended_early_loses_the_two_form_by_as_much_as_sweeps_are_missing():
    fast = {"problem": "spherical_pendulum", "case": "fig1.2", "value": 1 / 64, "metrics": ("defect", "manifold")}
    whole, once, twice, loose = (row_of(one(**fast, **how)) for how in ({}, {"sweeps": 1}, {"sweeps": 2}, {"newton": 1e-4}))
    assert whole["defect"] < 1e-14 < 1e3 * twice["defect"] < once["defect"]
    assert whole["n_newton"] > twice["n_newton"] == 2 * once["n_newton"] == 2 * once["steps"]
    assert once["g"] > 1e3 * twice["g"] > 1e6 * whole["g"]
    assert loose["defect"] > 1e3 * whole["defect"]
    with refused("newton-ended-early-elsewhere"):
        require_possible(one(method="scipy:DOP853", value=1e-6, sweeps=1))


def test_a_parameter_that_is_called_like_a_column_is_refused():
    for name in ("steps", "g", "n_rhs"):
        with refused("parameter-named-as-column", says=(name,)):
            require_possible(one(parameters=((name, 1.0),), metrics=("manifold",)))


def test_time_is_the_best_of_several_runs_and_only_where_it_is_asked_for():
    assert math.isnan(row_of(one())["seconds"])
    assert row_of(one(repeat=2))["seconds"] > 0


def test_every_metric_fills_the_columns_it_names():
    for metric in METRICS.values():
        place = {} if metric.constrained else {"problem": "lotka_volterra", "case": "4,2", "method": "strang"}
        row = row_of(one(metrics=(metric.name,), **place))
        assert row["failure"] == ""
        assert set(metric.columns) <= set(row)


# ---- what is kept


CHANGES = {
    "a": lambda own: None,
    "b": lambda own: own.rename(own.with_name("bead.py")),
    "the file": lambda own: own.write_text(own.read_text().replace("rate: float = 2.0", "rate: float = 2.5")),
    "an imported file": lambda own: own.with_name("speeds_of_own.py").write_text("SPEED = 4\n"),
    "a file that it reads": lambda own: own.with_name("speed.txt").write_text("4"),
}


def test_a_problem_file_that_is_moved_and_changed_has_other_rows(tmp_path):
    text = ORBIT.replace("import sympy", "from pathlib import Path\n\nimport speeds_of_own\nimport sympy", 1)
    text = text.replace("(1, 3)", "(1, speeds_of_own.SPEED * int((Path(__file__).parent / 'speed.txt').read_text()))")
    keys = {}
    for folder, change in CHANGES.items():
        own = tmp_path / folder / "own.py"
        own.parent.mkdir()
        own.write_text(text)
        own.with_name("speeds_of_own.py").write_text("SPEED = 3\n")
        own.with_name("speed.txt").write_text("1")
        change(own)
        own = own if own.exists() else own.with_name("bead.py")
        keys[folder] = key_of(one(problem=str(own), case="even", method="strang"))
    assert keys["a"] == keys["b"]
    assert len(set(keys.values())) == len(keys) - 1, keys


def test_a_wider_grid_computes_what_is_missing_alone(store, monkeypatch):
    first, seen = study().table(store), []
    monkeypatch.setattr(ROW_OF, lambda specification: seen.append(specification.value) or row_of(specification))
    again = study().table(store)
    assert (seen, again.equals(first)) == ([], True)
    found = study(values={"h": [1 / 8, 1 / 16, 1 / 32, 1 / 64]}).table(store)
    assert seen == [1 / 8, 1 / 64]
    assert list(found["value"]) == [1 / 8, 1 / 16, 1 / 32, 1 / 64]


DECIDING = [
    {"value": 1 / 32},
    {"t_end": 5.0},
    {"method": "lobatto2"},
    {"case": "near_top"},
    {"parameters": (("gravity", 2.0),)},
    {"metrics": ("energy", "manifold")},
    {"precision": "float32"},
    {"compensated": True},
    {"outputs": 32},
    {"repeat": 3},
    {"beside": True},
    {"sweeps": 1},
    {"newton": 1e-6},
    {"on_singular": "continue"},
]


def test_all_that_decides_a_run_is_in_its_key(monkeypatch):
    keys, again = ([key_of(one(**more)) for more in ({}, *DECIDING)] for _ in range(2))
    assert len(set(keys)) == len(keys)
    assert keys == again
    monkeypatch.setattr("daebench.studies.grid.specification.made_by", lambda: "another version")
    assert key_of(one()) != keys[0]


def test_the_code_of_linked_folders_is_in_what_numbers_are_made_by(tmp_path, monkeypatch):
    here = code.deciding_files()
    assert {"studies/grid/run_specification.py", "methods/solvers/drive.py", "reference/keep/store.py", "problems/torus.py"} <= set(here)
    assert not any(name.startswith(("cli/", "reports/")) for name in here)
    assert len({file.resolve() for file in here.values()}) == len(here)
    for name, file in here.items():
        installed = tmp_path / "daebench" / name
        installed.parent.mkdir(parents=True, exist_ok=True)
        installed.write_bytes(file.read_bytes())
    monkeypatch.setattr(package_files, "folder", lambda package: tmp_path.joinpath(*package.split(".")))
    assert sorted(code.deciding_files()) == sorted(here)


def test_the_reference_is_in_the_key_of_what_is_measured_against_it(monkeypatch):
    errors, energy = key_of(one(metrics=("q",))), key_of(one())
    found = load("planar_pendulum-rotating")
    other = replace(found, certificate={**found.certificate, "checksum": "another"})
    monkeypatch.setattr("daebench.reference.keep.store.find", lambda problem, case: other)
    assert key_of(one(metrics=("q",))) != errors
    assert key_of(one()) == energy


def test_a_cell_goes_through_json_unchanged():
    specification = one(parameters=(("gravity", 2.0),), options=(("rho_inf", 0.5),))
    assert GridRun.of_plain(json.loads(json.dumps(specification.plain()))) == specification
    with refused("run-column-unknown"):
        GridRun.of_plain(specification.plain() | {"colour": "red"})


def test_numbers_that_json_does_not_have_come_back(store):
    row = {"a": math.nan, "b": math.inf, "c": -math.inf, "d": 0.1, "e": "word", "f": 3, "g": None}
    store.put([kept("key", row)])
    found = store.get("key")
    assert math.isnan(found.pop("a"))
    assert found == {name: value for name, value in row.items() if name != "a"}


def test_a_file_of_something_else_or_of_another_layout_is_refused_and_left_as_it_is(tmp_path):
    contents = {"text.db": b"no database at all, but long enough to be taken for one" * 20}
    (tmp_path / "text.db").write_bytes(contents["text.db"])
    for name, statement in {
        "other.db": "CREATE TABLE books (name TEXT)",
        "newer.db": f"PRAGMA user_version = {LAYOUT + 1}",
        "older.db": f"PRAGMA user_version = {LAYOUT - 1}",
    }.items():
        if name != "other.db":
            Store(tmp_path / name).close()
        with closing(sqlite3.connect(tmp_path / name)) as base:
            base.execute(statement)
        contents[name] = (tmp_path / name).read_bytes()
    wrong = ("not-a-store", "store-of-other-program", "store-of-other-version", "store-of-other-version")
    for why, (name, content) in zip(wrong, contents.items(), strict=True):
        with refused(why):
            Store(tmp_path / name)
        assert (tmp_path / name).read_bytes() == content


def test_rows_of_other_versions_are_told_from_those_of_other_cells(store, monkeypatch):
    study(values={"h": [1 / 16, 1 / 32]}).table(store)
    for module in ("records.code", "studies.grid.specification"):
        monkeypatch.setattr(f"daebench.{module}.made_by", lambda: "another version")
    later = study(values={"h": [1 / 32, 1 / 64]})
    wanted = {key_of(each): each.plain() for each in later.specifications()}
    assert len(store.outdated(wanted)) == 1
    later.table(store)
    assert (store.outdated(wanted), len(store)) == ([], 4)


def test_a_full_disk_keeps_what_there_is(store):
    store.put([kept("one", {"a": 1})])
    store._base.execute(f"PRAGMA max_page_count = {store._base.execute('PRAGMA page_count').fetchone()[0]}")
    with refused("store-not-writable", StoreFull, says=("1",)):
        store.put([kept("small", {"b": 2}), kept("two", {"text": "x" * 50_000})])
    assert store.get("one") == {"a": 1}
    assert store.get("small") is None


def test_another_executor_gives_the_same_rows(store, tmp_path):
    with ThreadPoolExecutor(2) as pool:
        found = study().table(store, executor=pool)
    with opened(tmp_path / "other.db") as other:
        assert found.equals(study().table(other))


KILLED = """
from pathlib import Path
from daebench.records.store import opened
from daebench.studies.grid.schedulers import local_processes
from daebench.studies.grid.study import Study

VALUES = [1 / k for k in range(16, 200)]
STUDY = Study(problem="planar_pendulum", methods=["rattle"], values={"h": VALUES}, t_end=50.0)
if __name__ == "__main__":
    with opened(Path("rows.db")) as store, local_processes(2) as pool:
        STUDY.table(store, executor=pool, tell=lambda done, *_: print(done, flush=True))
"""


@pytest.mark.slow
def test_a_study_that_is_killed_keeps_what_was_done_and_goes_on(tmp_path, monkeypatch):
    monkeypatch.setattr("daebench.methods.names.FixedStep", FixedStep)
    (tmp_path / "killed.py").write_text(KILLED)
    setting = {"cwd": tmp_path, "env": os.environ | {"PYTHONPATH": os.pathsep.join(sys.path)}, "start_new_session": True}
    with subprocess.Popen([sys.executable, "killed.py"], stdout=subprocess.PIPE, text=True, **setting) as process:
        for _ in range(10):
            process.stdout.readline()
        os.killpg(process.pid, signal.SIGKILL)
    whole, seen = runpy.run_path(tmp_path / "killed.py")["STUDY"], []
    with opened(tmp_path / "rows.db") as store:
        done = len(store)
        assert done > 5
        found = whole.table(store, tell=lambda _, of, specification: seen.append(of))
    assert len(found) == len(whole.specifications())
    assert len(seen) == len(found) - done


@pytest.mark.exhaustive
@pytest.mark.filterwarnings("ignore::ResourceWarning", "ignore::DeprecationWarning", "ignore::pytest.PytestUnraisableExceptionWarning")
def test_a_cluster_gives_the_same_rows_though_a_worker_is_killed(store, tmp_path, monkeypatch):
    distributed = pytest.importorskip("distributed", reason="the extra scale is not installed")
    monkeypatch.setattr("daebench.methods.names.FixedStep", FixedStep)
    wide = study(values={"h": [1 / k for k in range(16, 216)]}, t_end=200.0)
    with distributed.LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=":0") as cluster:
        killed = []

        def tell(done, of, specification):
            if done == 20:
                worker = next(iter(cluster.workers.values()))
                killed.append(worker.pid)
                os.kill(worker.pid, signal.SIGKILL)

        with dask_cluster(cluster.scheduler_address) as executor:
            found = wide.table(store, executor=executor, tell=tell)
    assert len(killed) == 1
    with opened(tmp_path / "other.db") as other:
        assert found.equals(wide.table(other))


def test_a_scheduler_that_is_not_there_is_said(monkeypatch):
    pytest.importorskip("distributed", reason="the extra scale is not installed")
    monkeypatch.setattr("daebench.studies.grid.schedulers.REACHED_SECONDS", 0.5)
    with (
        refused("no-dask-scheduler", says=("tcp://127.0.0.1:1",)),
        dask_cluster("tcp://127.0.0.1:1"),
    ):
        pass

"""The report on engines: adapters pose the same motions, numbers are what they say, and without engines the page says so."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest
from pages import standalone
from said import ROOT

from daebench.diagnostics.drift import FAILED
from daebench.pages.report import build
from daebench.pages.report.claims import ClaimRefuted
from daebench.pages.report.tables import write_tables
from daebench.reference.keep.dense_evaluation import states_at
from daebench.reference.solution import certified_for, integrated
from daebench.reports import engines
from daebench.reports.engines import motions, tables
from daebench.reports.engines.adapters import ENGINES, Engine
from daebench.reports.engines.contender import Contender, States, mass_matrix, stepped
from daebench.reports.engines.documentation import HOLDS, NOT, PART
from daebench.reports.engines.findings import check, race
from daebench.reports.engines.measured import OWN, measure, swept
from daebench.reports.engines.motions import BY_KEY, T_END

pytestmark = pytest.mark.filterwarnings("ignore::DeprecationWarning")
"""Engines use what Python or NumPy deprecate, and are not ours to mend."""

ADAPTED = [engine for engine in ENGINES if engine.module]

ORDERS = {"RK4": 4, "RK44": 4, "Euler": 1, "implicit": 1, "implicitfast": 1, "connect": 1, "tendons": 1, "shipped": 0, "CCMA": 1}
"""Orders that settings promise at least, by a word of their names; others have two. What is shipped is another model, with soft loops."""

ROUNDED = 1e-9
"""Errors that orders are not read from: tolerances of iterations inside engines."""

RESULTS = ROOT / "docs" / "results" / "index.md"

LOOPS = ("connect", "tendons", "loops")
"""Settings whose constraints are corrected and not met: energies agree up to what is left of g."""


def entries():
    """Return contenders of engines that are installed, those of Mici in the gate and others where someone has put them."""
    found = []
    for engine in ADAPTED:
        if not engine.installed:
            found.append(pytest.param(None, id=engine.name, marks=pytest.mark.skip(reason=f"{engine.name} is not installed")))
            continue
        for entry in engine.adapter.contenders():
            if entry.motion != "chain100" and "no hint" not in entry.setting:
                marks = () if engine.name == "Mici" else pytest.mark.slow
                found.append(pytest.param(entry, id=f"{entry.name} on {entry.motion}", marks=marks))
    return found


def known_at(motion, t):
    """Return the positions of a motion at a time near its start."""
    reference = certified_for(motion.ivp, t)
    if reference:
        return states_at(reference, np.array([t])).states["q"][0]
    if motion.problem == "pendulum_chain":
        return motions.method_of(motion.ivp, motions.FINE).solve(motion.ivp, motions.Request(value=1 / 512, t_end=t)).complete().q[-1]
    return integrated(motion.ivp, [t]).states["q"][0]


def early(entry, value):
    """Return the time to which contenders are run here, and the values that go into it as whole steps."""
    t = 1 / 16 if entry.motion == "top" else 1.0
    return t, (value if entry.knob == "tol" else min(value, t / 16))


def order_of(entry):
    """Return the order that a setting promises at least, 0 where it promises none."""
    words = entry.setting.replace(",", "").split()
    return min([order for word, order in ORDERS.items() if word in words] or [2])


@pytest.mark.sampled(by=lambda case: "Mici" not in case or case.endswith(" pendulum"))
@pytest.mark.parametrize("entry", entries())
def test_an_adapter_poses_the_motion_of_the_problem(entry):
    """Its error falls with the step as its method says, towards the certified motion: any other model would have a floor."""
    motion = BY_KEY[entry.motion]
    t, first = early(entry, entry.values[0])
    if motion.key == "iftomm":
        t = 0.5
    first = first / 16 if order_of(entry) == 1 else first
    values = [first, first / 4] if entry.knob == "h" else [1e-6, 1e-10]
    known = known_at(motion, t)
    coarse, fine = (float(np.max(np.abs(entry.run(motion.ivp, value, np.array([t])).q[-1] - known))) for value in values)
    if "1e-5" in entry.setting or "1e-6" in entry.setting:
        assert fine <= max(coarse, 1e-3)
    elif order := order_of(entry):
        assert fine <= max(coarse / 4 ** (0.75 * order), ROUNDED)
    assert fine < 0.05


@pytest.mark.sampled(by=lambda case: "Mici" not in case or case.endswith(" pendulum"))
@pytest.mark.parametrize("entry", entries())
def test_the_energy_of_the_engine_is_that_of_daebench_up_to_a_constant(entry):
    motion = BY_KEY[entry.motion]
    t, value = early(entry, entry.values[min(3, len(entry.values) - 1)])
    times = np.array([t / 2, t])
    states = entry.run(motion.ivp, value, times)
    assert states.p.shape == states.q.shape == (2, motion.ivp.d)
    assert states.seconds > 0
    if np.isnan(states.energy).all():
        pytest.skip("the engine gives no energy")
    off = np.ptp(motion.ivp.along("H", states.p, states.q) - states.energy)
    g = float(np.max(np.abs(motion.ivp.along("g", states.q))))
    scale = float(np.max(np.abs(motion.ivp.along("H", states.p, states.q)))) + float(np.max(np.abs(states.p @ np.ones(motion.ivp.d)))) + 1
    loose = "tolerance 1e-5" in entry.setting or any(entry.setting.startswith(word) for word in LOOPS)
    assert off <= 1e-9 * scale + (100 * g * scale if loose else 0)
    if not entry.constrained:
        assert g < 1e-12 * max(1.0, float(np.max(np.abs(states.q))) ** 2)


@pytest.mark.parametrize("engine", ADAPTED, ids=lambda engine: engine.name)
def test_contenders_are_of_motions_of_the_page_and_from_coarse_to_fine(engine):
    found = engine.adapter.contenders() if engine.installed else []
    assert len({(entry.setting, entry.motion) for entry in found}) == len(found)
    assert {entry.engine for entry in found} <= {engine.name}
    assert {entry.motion for entry in found} <= BY_KEY.keys()
    assert all(list(entry.values) == sorted(entry.values, reverse=True) for entry in found)


@pytest.mark.exhaustive
def test_the_vertical_seen_from_the_top_is_that_of_its_certified_motion():
    motion, known = BY_KEY["top"], motions.reference_of("top")
    assert known.bound < 1e-12
    q = integrated(motion.ivp, [T_END]).states["q"]
    assert np.max(np.abs(motions.compared(motion, q[0]) - known.value)) < 1e-6


def test_the_mass_matrix_is_that_of_the_problem():
    for key in ("slider", "fourbar", "butane"):
        ivp = BY_KEY[key].ivp
        v = np.linalg.solve(mass_matrix(ivp), ivp.p0 + 1)
        assert v == pytest.approx(ivp.value("H_p", ivp.p0 + 1, ivp.q0), rel=1e-13)


def test_only_the_stepping_is_timed_and_states_are_read_after_whole_steps():
    taken, seen = [], []

    def read():
        seen.append(sum(taken))
        return np.zeros(1), np.full(1, sum(taken)), 0.0

    states = stepped(taken.append, read, 0.25, np.array([0.5, 1.0, 2.0]))
    assert taken == [2, 2, 4]
    assert states.q.ravel().tolist() == [2, 4, 8]


SMALL = replace(BY_KEY["pendulum"], budget=0.02, long=20.0)


def exact(wrong=0.0, cost=1.0, *, fails=False):
    """Return runs of a made-up engine: the certified motion, a first-order error times ``wrong``, and seconds that grow with the steps."""

    def run(ivp, h, times):
        if fails:
            raise ArithmeticError("no steps\nto take")
        known = states_at(certified_for(ivp, float(times[-1])), np.asarray(times)).states
        return States(known["p"], known["q"] + wrong * h, cost * 1e-3 / h, np.full(len(times), np.nan))

    return run


def contender(run, setting="made up", **more):
    return Contender("Fake", setting, "pendulum", "h", (1 / 8, 1 / 16, 1 / 32, 1 / 64, 1 / 128), run, **more)


@pytest.fixture
def small(monkeypatch):
    monkeypatch.setitem(BY_KEY, "pendulum", SMALL)
    return SMALL


def test_a_sweep_ends_with_the_first_run_beyond_the_budget_after_three(small):
    """Seconds are 1e-3/h: 8, 16, 32, 64 ms against a budget of 20."""
    assert [row["value"] for row in swept(contender(exact()), "")] == [1 / 8, 1 / 16, 1 / 32]
    assert [row["value"] for row in swept(contender(exact(cost=0.1)), "")] == [1 / 8, 1 / 16, 1 / 32, 1 / 64, 1 / 128]
    assert [row["value"] for row in swept(contender(exact(cost=20)), "")] == [1 / 8]


@pytest.fixture(scope="module")
def numbers():
    """Return the numbers of a made-up engine of three settings beside daebench's own, on the pendulum with a small budget."""
    fake = SimpleNamespace(
        name="Fake",
        installed=True,
        module="fake",
        version="1",
        about="made up",
        adapter=SimpleNamespace(
            contenders=lambda: [
                contender(exact(1e-6), "exact", constrained=False),
                contender(exact(0.1), "swept", variants={"a": exact(0.1), "b": exact(0.2)}),
                contender(exact(fails=True), "broken"),
            ]
        ),
    )
    with pytest.MonkeyPatch.context() as patch:
        patch.setitem(BY_KEY, "pendulum", SMALL)
        found = measure(lambda fraction, doing: None, None, [SMALL], [fake])
    said = [
        {"engine": "Fake", "place": "p", "sentence": f"says {k}", "measured": "m", "verdict": v} for k, v in enumerate((HOLDS, PART, NOT))
    ]
    return replace(found, sentences=pd.DataFrame(said))


RACES = {
    "rattle first": ({}, (1, 1, [], [], 0)),
    "ida before rattle": ({"ida:ggl": 1.0}, (1, 1, [], [], 0)),
    "an engine before rattle, ida before it": ({"connect": 2.5, "ida:ggl": 1.0}, (0, 1, [], [], 0)),
    "an engine with constraints first": ({"connect": 0.5}, (0, 0, ["pendulum"], [], 0)),
    "an engine in angles first": ({"hinges": 0.5}, (0, 0, [], ["pendulum"], 0)),
    "rattle too coarse": ({"rattle": np.nan}, (0, 1, [], [], 0)),
    "nobody": (dict.fromkeys(("rattle", "ida:ggl", "connect", "hinges"), np.nan), (0, 0, [], [], 1)),
    "no engine": (dict.fromkeys(("connect", "hinges"), np.nan), (1, 1, [], [], 0)),
}
"""Seconds to an error of 1e-4 where they are not 3 of rattle, 4 of ida, 5 and 6 of an engine, NaN: never; and what is said."""


@pytest.mark.parametrize(("changed", "said"), RACES.values(), ids=RACES)
def test_who_is_the_first_to_reach_an_error(changed, said):
    seconds = {"rattle": 3.0, "ida:ggl": 4.0, "connect": 5.0, "hinges": 6.0} | changed
    rows = [
        {
            "motion": "pendulum",
            "engine": OWN if name in ("rattle", "ida:ggl") else "MuJoCo",
            "setting": name,
            "constrained": name != "hinges",
            "error": error * (1 if np.isfinite(value) else 1e4),
            "seconds": cost * (value if np.isfinite(value) else 1.0),
            "failure": "",
        }
        for name, value in seconds.items()
        for error, cost in ((9e-5, 1.0), (1e-6, 10.0), (1e-3, 0.1))
    ]
    found = race(pd.DataFrame(rows), 1e-4)
    titles = {BY_KEY["pendulum"].title: "pendulum"}
    assert (found.rattle, found.own, [titles[x] for x in found.tied], [titles[x] for x in found.reduced], found.nobody) == said


def test_what_the_page_of_results_says_of_engines_holds_in_the_kept_runs():
    kept = pd.read_csv(ROOT / "reports" / "gallery" / "engines.csv", keep_default_na=False, na_values={"error": [""], "seconds": [""]})
    one = race(kept, 1e-4)
    assert "on all but the heavy top RATTLE" in RESULTS.read_text(encoding="utf-8")
    assert (one.rattle, one.motions, one.tied) == (8, 9, [BY_KEY["top"].title])


@pytest.mark.slow
def test_numbers_of_a_made_up_engine(small, numbers, tmp_path):
    chosen = numbers.chosen.set_index(["engine", "setting"])
    assert chosen.loc[("Fake", "exact"), "error"] == pytest.approx(1e-6 / 16, rel=1e-6)
    assert chosen.loc[("Fake", "exact"), "order"] == pytest.approx(1.0, abs=0.01)
    assert chosen.loc[("Fake", "broken"), "verdict"] == FAILED
    assert chosen.loc[("Fake", "swept"), "variant"] == "a"
    assert chosen.loc[(OWN, "rattle"), "order"] == pytest.approx(2.0, abs=0.1)
    assert chosen.loc[(OWN, "rattle"), "verdict"] == "bounded"
    assert (numbers.chosen["seconds"][numbers.chosen["within"]] <= small.budget).all()
    found = check(numbers)
    assert found.firsts[0].best["setting"] == "exact"
    assert found.firsts[0].closed["setting"] == "swept"
    assert found.reduced.won == [] or found.reduced.won == [small.title]
    assert [row[1] for row in found.unfinished] == ["broken"]
    assert (found.sentences.holds, found.sentences.part, found.sentences.no) == (1, 1, 1)
    write_tables(tmp_path, tables(numbers, None))
    assert len(pd.read_csv(tmp_path / "runs.csv")) == len(numbers.runs)
    require_refusals(numbers)


def worse(numbers, **cells):
    """Return the numbers with cells of the first run changed."""
    runs = numbers.runs.copy()
    for name, value in cells.items():
        runs.loc[runs.index[0], name] = value
    return replace(numbers, runs=runs)


def require_refusals(numbers):
    """Require that claims refuse what the numbers do not bear out."""
    chosen = numbers.chosen.copy()
    chosen.loc[chosen["within"].idxmax(), "seconds"] = 1.0
    for wrong in (worse(numbers, failure="it broke"), worse(numbers, error=1e-30), replace(numbers, chosen=chosen)):
        with pytest.raises(ClaimRefuted):
            check(wrong)
    twin = numbers.runs[(numbers.runs["engine"] == OWN) & (numbers.runs["setting"] == "rattle")].assign(
        engine="Mici", setting="constrained leapfrog"
    )
    assert check(replace(numbers, runs=pd.concat([numbers.runs, twin], ignore_index=True))).twins.worst == 0
    off = replace(numbers, runs=pd.concat([numbers.runs, twin.assign(error=1.1 * twin["error"])], ignore_index=True))
    with pytest.raises(ClaimRefuted):
        check(off)


def test_without_engines_the_page_is_made(tmp_path, monkeypatch):
    monkeypatch.setattr(Engine, "installed", property(lambda engine: False))
    text = standalone(build("engines", tmp_path)).text
    assert text.count("not installed here") == len(ADAPTED)


@pytest.mark.slow
@pytest.mark.exhaustive
def test_a_page_of_mici_alone(tmp_path, monkeypatch):
    pytest.importorskip("mici")
    (mici,) = (engine for engine in ENGINES if engine.name == "Mici")
    motion = replace(BY_KEY["pendulum"], budget=0.3, long=20.0)
    monkeypatch.setattr(engines, "measure", lambda tell, folder: measure(tell, folder, [motion], [mici]))
    text = standalone(build("engines", tmp_path), quotes=True).text
    assert "constrained leapfrog" in text
    frame = pd.read_csv(tmp_path / "engines" / "tables" / "runs.csv")
    kept = list((tmp_path / "engines" / engines.KEPT).glob("*.json"))
    assert len(kept) == 4
    monkeypatch.setattr("daebench.reports.engines.measured.swept", lambda *_: pytest.fail("a run"))
    assert standalone(build("engines", tmp_path), quotes=True).text.count("constrained leapfrog") == text.count("constrained leapfrog")
    kept[0].write_text("damaged")
    with pytest.raises(BaseException, match="a run"):
        build("engines", tmp_path)
    both = frame.pivot_table(index="value", columns="engine", values="error")[["Mici", OWN]].dropna()
    assert both["Mici"].to_numpy() == pytest.approx(both[OWN].to_numpy(), rel=1e-6)

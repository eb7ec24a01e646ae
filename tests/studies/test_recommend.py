"""Recommendations: what a run was measured to keep, and the cheapest run that is as accurate and keeps it, on tables made by hand."""

import numpy as np
import pandas as pd
import pytest

from daebench.methods.catalogue import problems
from daebench.methods.initial_value_problem import initial_value_problem
from daebench.methods.names import methods_of
from daebench.methods.registry import poisson_registry, registry
from daebench.studies.grid.claimed import THINGS, claimed, claims_of, feasible
from daebench.studies.work_precision.study import CONSERVED, recommended, with_conserved

LEVEL, SLOPING, UNKNOWN = "bounded", "drifts", "undetermined"
"""Verdicts on the energy."""


def runs(method, errors=(1e-2, 1e-4, 1e-6), costs=(1, 2, 4), *, verdict=LEVEL, drift=1e-3, **more):
    energy = {"energy_error": drift, "energy_verdict": verdict, "energy_scale": 1.0}
    columns = {"method": method, "knob": "h", "value": 0.5 ** np.arange(len(errors)), "error_q": errors, "bound_q": 1e-16, "seconds": costs}
    columns |= {"t_end": 10.0, "g": 1e-15, "Gv": 1e-15, "steps": 100, "failure": ""} | energy
    return pd.DataFrame(columns | more)


def of_claimants(table, defects):
    """Return a table with what its runs keep, where every method claims everything."""
    return with_conserved(table, defects, dict.fromkeys(table["method"], THINGS))


def kept(table, name, defects=None):
    return of_claimants(table, defects or {})[f"keeps_{name}"].tolist()


def test_a_run_that_is_level_by_chance_keeps_nothing():
    four = [1e-2, 1e-4, 1e-6, 1e-8], [1.0, 2.0, 4.0, 8.0]
    for verdicts, energy in (
        ([LEVEL, LEVEL, SLOPING, LEVEL], [False] * 4),
        ([SLOPING, LEVEL, LEVEL, LEVEL], [False, True, True, True]),
        ([LEVEL, SLOPING, LEVEL, LEVEL], [False] * 4),
        ([LEVEL, LEVEL, UNKNOWN, LEVEL], [False] * 4),
    ):
        assert kept(runs("a", *four, verdict=verdicts), "energy") == energy
    assert kept(runs("a", [1e-2, 1e-4], [1, 2]), "energy") == [False] * 2


def test_the_order_of_rows_does_not_matter_and_methods_are_judged_apart():
    table = pd.concat([runs("a"), runs("b", verdict=SLOPING)], ignore_index=True).sample(frac=1, random_state=1)
    shuffled = of_claimants(table, {})
    assert shuffled["keeps_energy"].tolist() == (shuffled["method"] == "a").tolist()


def test_energy_without_drift_needs_a_bound_and_not_the_absence_of_a_drift():
    """An energy error of 1e-14 that nobody can judge is not kept, however small it is."""
    for verdict, keeps in [("kept", True), ("bounded", True), ("drifts", False), ("undetermined", False), (np.nan, False)]:
        table = runs("a", verdict=verdict, drift=1e-14)
        assert kept(table, "energy") == [keeps] * 3


@pytest.mark.parametrize(
    ("verdict", "defect", "claims", "keeps"),
    [
        ("undetermined", 1e-15, {"energy", "two_form"}, True),
        ("undetermined", 1e-6, {"energy", "two_form"}, False),
        ("undetermined", np.nan, {"energy", "two_form"}, False),
        ("undetermined", 1e-15, {"energy"}, False),
        ("drifts", 1e-15, {"energy", "two_form"}, False),
        ("failed", 1e-15, {"energy", "two_form"}, False),
    ],
)
def test_a_short_run_does_not_withdraw_a_two_form_that_is_claimed_and_measured(verdict, defect, claims, keeps):
    told = with_conserved(runs("a", verdict=verdict), {"a": defect}, {"a": claims})
    assert told["keeps_energy"].tolist() == [keeps] * 3


def test_constraints_are_kept_at_both_levels_or_not_at_all():
    assert kept(runs("a"), "constraints") == [True] * 3
    assert kept(runs("a", Gv=1e-6), "constraints") == [False] * 3
    assert kept(runs("a", g=np.nan), "constraints") == [False] * 3


def test_failed_runs_keep_nothing_and_do_not_speak_for_others():
    table = runs("a", [1e-2, 1e-4, 1e-6, np.nan], [1, 2, 4, np.nan])
    table.loc[3, "failure"] = "stopped"
    assert kept(table, "energy") == [True, True, True, False]
    assert kept(table, "nothing") == [True, True, True, False]


def test_the_two_form_is_a_matter_of_the_method():
    table = pd.concat([runs(name) for name in "abc"], ignore_index=True)
    assert kept(table, "two_form", {"a": 1e-14, "b": 1e-6}) == [True] * 3 + [False] * 6


def test_there_is_a_column_for_what_can_be_conserved_alone():
    table = runs("a")
    assert "keeps_casimirs" not in of_claimants(table, {})
    poisson = table.drop(columns=["g", "Gv"])
    assert "keeps_constraints" not in of_claimants(poisson, {})
    assert "keeps_casimirs" not in of_claimants(poisson.assign(casimirs=np.nan), {})
    assert kept(poisson.assign(casimirs=1e-14), "casimirs") == [True] * 3
    assert kept(poisson.assign(casimirs=1e-9), "casimirs") == [False] * 3


@pytest.fixture
def table():
    """Return three methods: a cheap one that drifts, one that keeps the energy alone, and a dear one that keeps everything."""
    errors = [1e-1, 1e-3, 1e-5, 1e-7]
    drifting = runs("cheap", errors, [1.0, 10.0, 100.0, 1000.0], verdict=SLOPING, g=1e-3)
    bounded = runs("middle", errors, [3.0, 30.0, 300.0, 3000.0], g=1e-3)
    whole = runs("dear", errors, [5.0, 50.0, 500.0, 5000.0])
    return of_claimants(pd.concat([drifting, bounded, whole], ignore_index=True), {"cheap": 1e-3, "middle": 1e-3, "dear": 1e-15})


def test_the_cheapest_that_keeps_what_it_must_is_recommended(table):
    found = recommended(table, "error_q", "seconds", [1e-3]).set_index("conserve")
    rows = {"nothing": ("cheap", "middle", 10.0), "energy": ("middle", "dear", 30.0)} | dict.fromkeys(
        ("constraints", "two_form"), ("dear", "", 50.0)
    )
    assert {row.Index: (row.method, row.next, row.cost) for row in found.itertuples()} == rows
    assert found["ratio"][["nothing", "energy"]].tolist() == pytest.approx([3, 5 / 3], rel=1e-12)
    assert (found["value"] == 0.5).all()


def test_between_two_runs_the_finer_one_is_taken_and_the_price_is_that_of_the_accuracy(table):
    (row,) = recommended(table, "error_q", "seconds", [1e-4]).query("conserve == 'nothing'").to_dict("records")
    assert (row["value"], row["cost"], row["error"]) == (0.25, 100.0, 1e-5)
    assert row["price"] == pytest.approx(10**1.5, rel=1e-12)


def test_what_nobody_reaches_or_keeps_has_a_row_without_a_method(table):
    found = recommended(table.assign(keeps_energy=False), "error_q", "seconds", [1e-3, 1e-9])
    assert len(found) == 2 * 4
    empty = found[(found["level"] == 1e-9) | (found["conserve"] == "energy")]
    assert (empty["method"] == "").all()
    assert empty[["value", "cost", "error", "price", "ratio"]].isna().all(axis=None)
    assert set(found["conserve"]) <= set(CONSERVED)


def test_a_method_is_recommended_with_a_value_that_keeps_and_not_with_a_coarser_one():
    errors = [1e-4, 1e-5, 1e-6, 1e-7]
    late = runs("late", errors, [1.0, 2.0, 4.0, 8.0], verdict=[SLOPING, LEVEL, LEVEL, LEVEL])
    found = recommended(of_claimants(late, {}), "error_q", "seconds", [1e-3]).set_index("conserve")
    assert (found["value"]["nothing"], found["value"]["energy"]) == (1.0, 0.5)
    assert found["cost"]["energy"] == 2.0


# ---- no recommendation without a claim -------------------------------------------------------------------------------------


def test_what_is_measured_and_not_claimed_is_not_kept():
    for thing in THINGS:
        table = pd.concat([runs(name) for name in ("modest", "boasting")], ignore_index=True).assign(casimirs=1e-15)
        claims = {"modest": set(THINGS) - {thing}, "boasting": set(THINGS)}
        found = with_conserved(table, dict.fromkeys(claims, 1e-15), claims)
        assert found[f"keeps_{thing}"].tolist() == [False] * 3 + [True] * 3
        assert found[[f"keeps_{name}" for name in CONSERVED if name != thing]].all(axis=None)
        assert found["measured_energy"].all()
        advice = recommended(found[found["method"] == "modest"], "error_q", "seconds", [1e-3]).set_index("conserve")["method"]
        assert {name for name, method in advice.items() if not method} == {thing}


def test_a_claim_that_the_measurement_refutes_is_worth_nothing():
    table = runs("boasting", verdict=SLOPING, g=1e-3)
    for thing in ("energy", "constraints", "two_form"):
        assert kept(table, thing, {"boasting": 1e-3}) == [False] * 3


SYMPLECTIC = {
    "symplectic_euler",
    "symplectic_euler_adjoint",
    "rattle",
    "lie",
    "lie_adjoint",
    "strang",
    *(f"lobatto{s}" for s in range(2, 7)),
}
"""Schemes on the manifold that the book calls symplectic there: HLW (1.19), (1.25), (1.27), (1.45)."""

AT_REST, MOVING = ("double_pendulum", "horizontal"), ("spherical_pendulum", "fig1.2")
SYMMETRIC = {"midpoint+symproj", "local:midpoint", "local:gauss2", "local:gauss3"}
NEVER = {"rk4", "rk4+proj", "se", "seproj", "implicit_euler", "radau3_ggl", "radau2_index2", "generalized_alpha", "rattle_gauss_seidel"}
NEVER |= {
    "midpoint",
    "gauss3",
    "local:rk4",
    "midpoint/suzuki4+proj",
    "baumgarte:rk4",
    "ida:ggl",
    "scipy:Radau",
}


@pytest.mark.parametrize("setting", [AT_REST, MOVING], ids=["at-rest", "moving"])
def test_energy_without_drift_is_claimed_by_what_the_book_says_and_by_symmetry_on_motions_that_are_their_own_reverse(setting):
    ivp = initial_value_problem(*setting)
    names = [*registry(), *SYMMETRIC, *NEVER, "rattle/suzuki4", "lobatto2/kahan_li8"]
    given = {name: claimed(ivp, methods_of(ivp, [name])[0]) for name in dict.fromkeys(names)}
    claiming = {name for name, things in given.items() if "energy" in things}
    wanted = SYMPLECTIC | {"energy_momentum", "rattle/suzuki4", "lobatto2/kahan_li8"}
    if setting == AT_REST:  # a double pendulum, whose kinetic energy has no flow in closed form
        wanted = (wanted | SYMMETRIC) - {"lie", "lie_adjoint", "strang"}
    assert claiming == wanted
    assert not claiming & NEVER


@pytest.mark.sampled(by=lambda case: case in ("free_rigid_body", "lotka_volterra"))
@pytest.mark.parametrize("problem", problems("poisson"))
def test_rk4_claims_no_casimir_function_that_is_not_linear_and_no_energy(problem):
    ivp = initial_value_problem(problem)
    names, _ = feasible(ivp, [*poisson_registry(), "darboux:midpoint"], anyway=True)
    given = {name: claimed(ivp, methods_of(ivp, [name], anyway=True)[0]) for name in names}
    assert "energy" not in given["rk4"]
    assert ("casimirs" in given["rk4"]) == (bool(ivp.casimirs) and set(ivp.casimirs) <= set(ivp.facts.LINEAR))
    if "strang" in given:
        assert given["strang"] >= {"energy", "two_form"}
        assert ("casimirs" in given["strang"]) == bool(ivp.casimirs)


def test_claims_are_those_on_all_cases_and_a_stranger_claims_nothing():
    cases = [
        {"problem": "double_pendulum", "case": case, "method": name} for case in ("horizontal", "swing") for name in ("rattle", "./m.py:f")
    ]
    found = claims_of(pd.DataFrame(cases))
    assert found == {"rattle": frozenset({"energy", "constraints", "two_form"}), "./m.py:f": frozenset()}
    one = claims_of(pd.DataFrame([{"problem": name, "case": case, "method": "local:midpoint"} for name, case in [AT_REST]]))
    assert "energy" in one["local:midpoint"]

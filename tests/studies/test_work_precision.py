"""Work against precision: which runs are made, which method is called the cheapest, and what the command says."""

import json
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from refusals import require_refusals

from daebench.errors import BadInput
from daebench.methods import run as api
from daebench.methods.catalogue import problems
from daebench.methods.fixed_step.constrained import FixedStep
from daebench.methods.initial_value_problem import initial_value_problem
from daebench.methods.names import methods_of
from daebench.methods.registry import poisson_registry, registry
from daebench.methods.solvers.scipy_ode import ScipyOde
from daebench.reference.keep import store
from daebench.reference.solution import own_run
from daebench.runs.request import Request
from daebench.schemes.kernels.claims import WATER
from daebench.studies.grid.measure import row_of
from daebench.studies.grid.reference import OWN
from daebench.studies.grid.run_specification import GridRun
from daebench.studies.work_precision.figure import FAMILIES, draw, families, figure
from daebench.studies.work_precision.study import cheapest, front, standard, with_costs


def power_law(method, order, price, floor=1e-15):
    """Return runs whose error is h^order, at this price a step."""
    h = 0.5 ** np.arange(12)
    return pd.DataFrame({"method": method, "value": h, "error_q": h**order, "bound_q": floor, "seconds": price / h, "failure": ""})


def test_the_cheapest_is_the_one_that_the_power_laws_say():
    table = pd.concat([power_law("low", 2, 1.0), power_law("high", 4, 10.0)])
    found = cheapest(table, "error_q", "seconds", [1e-1, 1e-3]).set_index("level")
    # h^2 costs level^(-1/2), h^4 costs 10 level^(-1/4): the same at 1e-4 h
    assert list(found["method"]) == ["low", "low"]
    assert found.loc[1e-3, "seconds"] == pytest.approx(1e-3**-0.5, rel=1e-9)
    assert found.loc[1e-3, "ratio"] == pytest.approx(10 * 1e-3**-0.25 / 1e-3**-0.5, rel=1e-9)
    (fine,) = cheapest(table, "error_q", "seconds", [1e-5]).itertuples()
    assert (fine.method, fine.next) == ("high", "low")
    assert fine.ratio == pytest.approx(1e-5**-0.5 / (10 * 1e-5**-0.25), rel=1e-9)


def test_a_level_that_nobody_reaches_has_no_row_and_errors_count_as_their_bound():
    table = power_law("one", 2, 1.0, floor=1e-5)
    assert list(cheapest(table, "error_q", "seconds", [1e-4, 1e-6])["level"]) == [1e-4]


def test_failed_and_untimed_runs_do_not_count():
    table = power_law("one", 2, 1.0)
    table.loc[table["error_q"] <= 1e-2, "seconds"] = np.nan
    assert cheapest(table, "error_q", "seconds", [1e-3]).empty
    assert not cheapest(table, "error_q", "seconds", [1e-1]).empty


def evaluations_of(problem, **counts):
    """Return the evaluations of one run with these counts."""
    return with_costs(pd.DataFrame({"problem": [problem], "seconds": [2.0], "callback_seconds": [np.nan], **counts}))["evaluations"].item()


def test_evaluations_are_those_of_functions_and_a_call_of_a_whole_right_side_counts_as_what_it_evaluates():
    assert evaluations_of("torus", n_H_p=2.0, n_G=3.0, n_solve=100.0, n_newton=100.0, n_steps=100.0, n_residual=np.nan) == 5.0
    assert evaluations_of("torus", n_rhs=10.0, n_jacobian=1.0) == 44.0
    assert evaluations_of("lotka_volterra", n_rhs=10.0, n_jacobian=1.0) == 11.0


def test_a_stage_of_a_fixed_step_counts_as_much_as_a_call_of_a_solver():
    run = FixedStep("rk4", compiled=False).solve(initial_value_problem("planar_pendulum", "rotating"), Request(value=1 / 8, steps=10))
    found = evaluations_of("planar_pendulum", **{f"n_{name}": float(count) for name, count in run.work.items()})
    assert found == 4 * run.steps * evaluations_of("planar_pendulum", n_rhs=1.0)


def test_the_front_has_the_runs_than_which_none_is_better():
    errors, seconds = [1e-1, 1e-2, 1e-2, 1e-1, 1e-3, np.nan], [1.0, 2.0, 3.0, 2.5, 4.0, 0.1]
    table = pd.DataFrame({"method": list("abcdef"), "error_q": errors, "seconds": seconds})
    for bound, methods in ((1e-16, "abe"), (5e-3, "abe"), (5e-2, "ab")):
        assert "".join(front(table.assign(bound_q=bound), "error_q", "seconds")["method"]) == methods
    assert front(table.iloc[:0].assign(bound_q=0.0), "error_q", "seconds").empty


def family_of(method, problem="spherical_pendulum", case="fig1.2"):
    """Return the family of one method, whose runs in the table look as if they kept everything, and drifted."""
    resolution = "tol" if method.startswith(("ida:", "scipy:", "cvode:", "heyoka:", "solve_dae:")) else "h"
    table = power_law(method, 2, 1.0).assign(problem=problem, case=case, knob=resolution)
    ((family, names),) = families(table).items()
    assert names == [method]
    return family


CLAIMING, OTHERS, COMPOSED, BY_TOLERANCE = FAMILIES
FAMILY = {
    **dict.fromkeys(("symplectic_euler", "symplectic_euler_adjoint", "rattle", "lobatto3", "strang", "lie", "energy_momentum"), CLAIMING),
    **dict.fromkeys(("radau3_ggl", "generalized_alpha", "rk4", "rk4+proj", "implicit_euler", "se", "midpoint+symproj"), OTHERS),
    **dict.fromkeys(("rattle/suzuki4", "strang/kahan_li8"), COMPOSED),
    **dict.fromkeys(("ida:ggl", "scipy:DOP853"), BY_TOLERANCE),
}


def test_the_family_of_a_method_is_that_of_its_claim_whatever_ten_seconds_show():
    assert {method: family_of(method) for method in FAMILY} == FAMILY


def test_every_scheme_is_in_the_family_of_its_claims():
    for method, (_, scheme) in registry().items():
        claims = scheme.claims
        kept = claims.conserves_energy or (claims.symplectic and claims.keeps_g and claims.keeps_Gv)
        where = ("rigid_water", "tumbling") if claims.constraints == WATER else ()
        assert family_of(method, *where) == (CLAIMING if kept else OTHERS), method
    for problem in ("lotka_volterra", "free_rigid_body"):
        ivp = initial_value_problem(problem)
        for method in poisson_registry():
            (solver,) = methods_of(ivp, [method], anyway=True)
            kept = solver.is_poisson(ivp) or "energy" in solver.keeps(ivp)
            assert family_of(method, problem, ivp.case) == (CLAIMING if kept else OTHERS), (problem, method)


def test_nothing_is_drawn_below_the_bound_of_the_reference(tmp_path, monkeypatch):
    from matplotlib.axes import Axes

    def plot(self, x, y, *rest, real=Axes.plot, **more):
        drawn.extend(np.asarray(y, dtype=float))
        return real(self, x, y, *rest, **more)

    drawn, table = [], power_law("rattle", 2, 1.0, floor=1e-5)
    monkeypatch.setattr(Axes, "plot", plot)
    table = table.assign(problem="torus", case="inner", knob="h", callback_seconds=np.nan, n_H_p=1.0, energy_error=1e-3)
    table = with_costs(table.assign(energy_verdict="bounded", energy_scale=1.0, t_end=10.0, g=0.0, Gv=0.0, steps=1))
    table.loc[0, "bound_q"] = 1e-2  # of another row: it hides none of the others
    svg = draw(tmp_path, table, "error_q", "error")
    assert min(table["error_q"]) < 1e-5 < min(drawn) < 1e-4
    assert len(pd.read_csv(svg.with_suffix(".csv"))) == len(table)
    for reference, style, hatches in (("certified torus-inner", ":", set()), (f"{OWN} (DOP853)", "--", {"///"})):
        axis = figure(table.assign(reference=reference), "error_q", "error").axes[0]
        assert [line.get_linestyle() for line in axis.lines if line.get_ydata()[0] == table["bound_q"].max()] == [style]
        assert {patch.get_hatch() for patch in axis.patches} == hatches


def test_an_error_with_a_sign_is_taken_by_its_modulus():
    table = power_law("one", 2, 1.0).assign(energy_slope=lambda runs: -runs["error_q"])
    by_slope, by_error = (cheapest(table, error, "seconds", [1e-3]) for error in ("energy_slope", "error_q"))
    assert by_slope.equals(by_error)


MOTION = {"problem": "planar_pendulum", "case": "rotating", "t_end": 4.0}


def test_a_run_by_tolerance_is_given_up_after_so_many_calls():
    specification = GridRun(**MOTION, method="scipy:DOP853", value=1e-10, metrics=("energy",), calls=100)
    assert "100 calls of the rhs were not enough" in row_of(specification)["failure"]
    assert row_of(replace(specification, calls=100_000))["failure"] == ""


@pytest.mark.parametrize(("method", "value"), [("scipy:DOP853", 1e-3), ("rattle", 1 / 8)], ids=["tolerance", "fixed steps"])
def test_a_long_run_is_timed_once(monkeypatch, uncompiled_schemes, method, value):
    monkeypatch.setattr("daebench.studies.grid.measure.LONG", 0.0)
    specification = GridRun(**MOTION, method=method, value=value, metrics=("energy",), repeat=5)
    owner, solved = type(specification.solver), []
    real = owner.solve
    monkeypatch.setattr(owner, "solve", lambda self, ivp, request: solved.append(real(self, ivp, request)) or solved[-1])
    assert row_of(specification)["seconds"] == solved[-1].seconds
    assert len(solved) == 2


def test_time_and_work_of_a_run_by_tolerance_are_those_of_one_that_keeps_nothing():
    specification = GridRun(**MOTION, method="scipy:DOP853", value=1e-6, metrics=("energy",))
    looked, timed, more = (
        row_of(each) for each in (specification, replace(specification, repeat=1), replace(specification, repeat=1, outputs=256))
    )
    assert timed["energy_error"] == looked["energy_error"]
    assert timed["steps"] == looked["steps"]
    assert timed["n_rhs"] == more["n_rhs"] < looked["n_rhs"]


def test_where_the_timed_run_fails_the_work_is_that_of_the_one_looked_at(monkeypatch):
    def solve(self, ivp, request, real=ScipyOde.solve):
        run = real(self, ivp, request)
        return replace(run, failure="stopped", work={"rhs": 1}) if request.points == 2 else run

    specification = GridRun(**MOTION, method="scipy:DOP853", value=1e-6, metrics=("energy",))
    before = row_of(specification)
    monkeypatch.setattr(ScipyOde, "solve", solve)
    row = row_of(replace(specification, repeat=2))
    assert (row["failure"], row["n_rhs"]) == ("", before["n_rhs"])
    assert np.isnan(row["seconds"])


@pytest.mark.parametrize("which", [0, 1], ids=["measured", "timed"])
def test_an_interrupted_run_is_no_row(monkeypatch, which):
    real, made = ScipyOde.solve, []

    def solve(self, ivp, request):
        made.append(request)
        if len(made) == which + 1:
            raise KeyboardInterrupt
        return real(self, ivp, request)

    monkeypatch.setattr(ScipyOde, "solve", solve)
    with pytest.raises(KeyboardInterrupt):
        row_of(GridRun(**MOTION, method="scipy:DOP853", value=1e-3, metrics=("energy",), repeat=1))


def test_momenta_are_measured_where_the_problem_has_some():
    asked = {"t_end": 4.0, "method": "scipy:DOP853"}
    of = {"value": 1e-6, "metrics": ("integrals",)}
    assert np.isnan(row_of(GridRun(problem="lotka_volterra", case="4,2", **asked, **of))["integrals"])
    found = row_of(GridRun(problem="spherical_pendulum", case="fig1.1", **asked, **of))["integrals"]
    run = api.run("spherical_pendulum", case="fig1.1", tol=1e-6, points=65, **asked)
    L3 = run.q[:, 0] * run.p[:, 1] - run.q[:, 1] * run.p[:, 0]
    assert found == pytest.approx(np.max(np.abs(L3 - L3[0])), rel=1e-6)


STANDARD = ("planar_pendulum", "torus", "lotka_volterra", "slider_crank")
"""Problems whose study the gate makes."""


@pytest.mark.sampled(by=lambda case: case in STANDARD)
@pytest.mark.parametrize("name", [each for each in problems() if any(x.startswith(f"{each}-") for x in store.names())])
def test_the_standard_study_of_a_problem_can_be_made(name):
    case = next(x for x in store.names() if x.startswith(f"{name}-")).removeprefix(f"{name}-")
    study, left_out = standard(name, case=case)
    specifications = study.specifications()
    assert {specification.method for specification in specifications}.isdisjoint(left_out)
    assert len({specification.method for specification in specifications}) >= 5
    assert all(why.endswith(".") for why in left_out.values())
    times = store.find(name, case).t
    for specification in specifications:
        if specification.solver.knob == "h":
            assert specification.value * round(times[1] / specification.value) == times[1]


ON_PENDULUM = "work-precision planar_pendulum --case rotating --repeat 0 --workers 1"


def test_the_command_keeps_its_runs_and_names_a_winner(daebench, tmp_path, monkeypatch):
    words = f"{ON_PENDULUM} --methods scipy:DOP853,scipy:RK45 --tol 1e-4,1e-6,1e-8 --out {tmp_path}".split()
    assert "6 to make: about 2 s" in daebench(*words, "--dry-run")[1]
    status, out, err = daebench(*words, "--json")
    found = json.loads(out)
    assert (status, err, found["runs"]) == (0, "", 6)
    ((told, bound),) = found["references"].items()
    table = pd.read_csv(tmp_path / "work_precision.csv")
    assert {told} == set(table["reference"]) == {"certified planar_pendulum-rotating"}
    assert bound == pytest.approx(table["bound_q"].max(), rel=1e-9)
    assert 0 < bound < table["error_q"].min()
    for each in found["best"]:
        (own,) = table[(table["method"] == each["method"]) & (table["value"] == each["value"])].itertuples()
        assert own.error_q <= each["level"]
        assert own.evaluations >= each["evaluations"]
    assert {path.name for path in tmp_path.iterdir()} >= {"studies.db", "work_precision_error_q.svg"}
    assert "6 of them stored" in daebench(*words, "--dry-run")[1]
    monkeypatch.setattr("daebench.records.code.made_by", lambda: "another version")
    monkeypatch.setattr("daebench.studies.grid.specification.made_by", lambda: "another version")
    assert "6 stored runs are of another version" in daebench(*words, "--dry-run")[1]


def test_the_defect_is_measured_where_it_is_asked_for(daebench, tmp_path):
    words = f"{ON_PENDULUM} --methods rk4,scipy:RK45 --h 0.0625 --tol 1e-4 --error defect --out {tmp_path}".split()
    assert daebench(*words)[::2] == (0, "")
    table = pd.read_csv(tmp_path / "work_precision.csv").set_index("method")
    assert table["defect"]["rk4"] > 1e-12
    assert np.isnan(table["defect"]["scipy:RK45"])
    assert (tmp_path / "work_precision_defect.svg").exists()


@pytest.mark.parametrize(
    "words", ["lotka_volterra --case 4,2 --error integrals", "planar_pendulum --case rotating"], ids=["no-number", "all-fail"]
)
def test_where_there_is_nothing_to_draw_there_is_a_table_and_a_sentence(daebench, tmp_path, monkeypatch, words):
    def refuse(*_):
        raise BadInput("it will not.")

    if "integrals" not in words:
        monkeypatch.setattr(ScipyOde, "solve", refuse)
    more = f"{words} --methods scipy:RK45 --tol 1e-4 --repeat 0 --workers 1 --out {tmp_path}".split()
    status, out, err = daebench("work-precision", *more)
    assert (status, out, err.count("\n")) == (1, "", 1)
    assert daebench.error.code == "error-not-to-draw"
    assert len(pd.read_csv(tmp_path / "work_precision.csv")) == 1


def test_bad_input_is_one_sentence(daebench, tmp_path, monkeypatch):
    monkeypatch.setattr(own_run, "__defaults__", (2000,))
    require_refusals(
        daebench,
        ("work-precision", "--repeat", 0, "--out", tmp_path / "new"),
        ("unknown-name", "planar_pendulum --error energy_scale"),
        ("study-not-measurable", "torus --case inner --t-end 1e6"),
        ("values-unused-by-methods", "planar_pendulum --methods rattle --tol 1e-3"),
        ("workers-not-positive", "planar_pendulum --workers 0"),
        ("workers-beside-scheduler", "planar_pendulum --workers 2 --scheduler tcp://a:1"),
        ("timed-in-parallel", "planar_pendulum --workers 2 --repeat 1"),
    )

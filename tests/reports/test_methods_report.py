"""The report on methods: the catalogue is in it whole, its numbers are the diagnostics' own, and planted faults refute its sentences."""

import math
import re
from xml.etree import ElementTree

import numpy as np
import pandas as pd
import pytest
from pages import standalone
from tampered import changed

from daebench.methods.catalogue import schemes
from daebench.methods.fixed_step.compositions import COMPOSITIONS
from daebench.methods.fixed_step.forms import FORMS
from daebench.methods.fixed_step.parts import PROJECTIONS
from daebench.methods.formulations.table import FORMULATIONS
from daebench.methods.initial_value_problem import initial_value_problem
from daebench.pages.report import MINUS, build
from daebench.pages.report.claims import ClaimRefuted
from daebench.reports import methods
from daebench.reports.methods import check, families, long_runs, measured, sweep
from daebench.reports.methods import defects as defects_of_steps
from daebench.reports.methods.defects import check_defects
from daebench.reports.methods.long_runs import check_long
from daebench.reports.methods.matrix import check_claims, matrix, over_time, tally
from daebench.reports.methods.measured import jobs, measure
from daebench.reports.methods.signs import lines
from daebench.runs.request import Request
from daebench.studies.claims.bench import FALLS_SHORT, NOT_CLAIMED, OK, UNDETERMINED
from daebench.studies.claims.check import order_finding

FEW = ("rattle", "se", "energy_momentum", "strang")


def test_the_catalogue_is_in_the_report_whole():
    own = families.names()
    assert len(set(own)) == len(own)
    assert set(schemes()) == (set(own) & set(schemes())) | set(families.left_out())
    on_velocities = [name for name in families.left_out() if families.method(name).claims.nonholonomic]
    assert sorted({*families.left_out()} - {*on_velocities}) == ["boris", "rattle_conformal", "rattle_settle"]
    parts = [families.method(name) for name in own]
    assert {each.composition for each in parts} == {"", *COMPOSITIONS}
    assert {each.projection for each in parts} == {"", *PROJECTIONS}
    assert {each.form for each in parts} == {"", *FORMS}
    assert families.solvers() == [f"ida:{each}" for each in FORMULATIONS]
    rows = [name for kind, name in lines([*own, *families.solvers()]) if kind == "method"]
    assert sorted(rows) == sorted([*own, *families.solvers()])


def test_every_method_is_swept():
    assert {own[0] for work, own in jobs(families.names()) if work is sweep.sweep} == set(families.names())


@pytest.fixture(scope="module")
def swept():
    """Return what is measured of a few methods, without orders, for which kernels are compiled."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(sweep, "orders", lambda motion, name, found: found)
        patch.setattr(sweep, "STEPS", 50)
        patch.setattr(sweep, "timed", lambda ivp, name, h: sweep.monitored(ivp, families.method(name), h))
        return {name: sweep.sweep(name) for name in FEW}


def test_numbers_are_those_of_the_diagnostics(swept):
    found = pd.DataFrame(swept["rattle"].claims).set_index(["problem", "property"])
    ivp = initial_value_problem("torus", "through_hole")
    run = families.method("rattle").solve(ivp, Request(value=0.05, steps=50))
    assert 0 < found.loc[("torus", "keeps g"), "measured"] < 1e-14
    H = np.sum(run.p**2, axis=1) / 2 + run.q[:, 2]
    assert found.loc[("torus", "keeps H"), "measured"] == pytest.approx(np.max(np.abs(H - H[0])), rel=1e-12)
    assert swept["rattle"].work[0]["H_q"] == 2


def test_what_refuses_a_motion_has_a_row_that_says_why(swept):
    rows = [row for row in swept["strang"].claims if row["property"] == "refused"]
    assert [row["problem"] for row in rows] == ["torus"]
    assert "needs the flow of the kinetic energy" in rows[0]["note"]


def test_the_matrix_says_what_is_claimed_and_measured(swept):
    table = matrix(pd.DataFrame([row for found in swept.values() for row in found.claims])).set_index("method")
    keys = ["symmetric", "symplectic", "g", "Gv", "H"]
    assert list(table.loc["rattle", keys]) == ["kept"] * 4 + ["lost"]
    assert list(table.loc["energy_momentum", keys]) == ["kept", "lost", "kept", "lost", "kept"]
    assert list(table.loc["se", keys]) == ["lost"] * 5
    assert table.loc["strang", "refused"] == "torus"
    assert table.loc["se", "g_most"] > 0.01 > 1e-12 > table.loc["rattle", "g_most"]


def claim(method, property, claimed, measured, bound, verdict, problem="torus"):
    about = {"problem": problem, "method": method, "property": property, "h": 0.1}
    return about | {"claimed": claimed, "measured": measured, "bound": bound, "verdict": verdict, "standard_error": math.nan, "note": ""}


SHORT = {
    "rattle: symplectic on torus": claim("rattle", "symplectic", True, 1e-3, 1e-12, FALLS_SHORT),
    "rattle has order 2 on torus": claim("rattle", "order", 2, 1.2, 1.8, FALLS_SHORT),
    "a claim of rattle was measured": claim("rattle", "order", 2, math.nan, 1.8, UNDETERMINED),
}


@pytest.mark.parametrize(("said", "row"), SHORT.items())
def test_a_method_that_falls_short_stops_the_page(said, row):
    good = claim("rattle", "keeps g", True, 1e-16, 1e-12, OK)
    check_claims(pd.DataFrame([good, claim("se", "symplectic", False, 1.0, 1e-12, NOT_CLAIMED)]))
    with pytest.raises(ClaimRefuted, match=said):
        check_claims(pd.DataFrame([good, row]))


def test_what_is_not_kept_has_the_verdict_of_the_long_run():
    rows = [
        claim(name, "keeps H", name == "energy_momentum", 1e-16 if name == "energy_momentum" else 0.1, 1e-12, OK)
        for name in (*FEW, "midpoint", "stiff:midpoint")
    ]
    said = {"rattle": "bounded", "se": "failed", "midpoint": "drifts", "energy_momentum": "drifts", "strang": "undetermined"}
    runs = pd.DataFrame([{"method": name, "H_long": verdict, "g_long": "kept", "Gv_long": "kept"} for name, verdict in said.items()])
    table = matrix(pd.DataFrame(rows))
    seen = over_time(table, runs).set_index("method")["H"].to_dict()
    expected = {"rattle": "bounded", "se": "lost", "midpoint": "drifts", "energy_momentum": "kept", "strang": "undetermined"}
    assert seen == expected | {"stiff:midpoint": "lost"}
    assert set(table["H"]) == {"kept", "lost"}


def test_defects_of_a_method_fall_with_its_order_plus_one():
    found = defects_of_steps.powers(pd.concat([defects_of_steps.defects(name) for name in ("midpoint", "rattle")])).set_index(
        ["method", "property"]
    )
    assert abs(found.loc[("midpoint", "symplectic"), "power"] - 3) < 0.1
    assert math.isnan(found.loc[("rattle", "symplectic"), "power"])
    assert found.loc[("rattle", "symplectic"), "most"] < 1e-14


def test_equations_are_mathml_and_have_the_signs_of_the_book():
    from importlib import resources

    from jinja2 import Environment, FileSystemLoader

    environment = Environment(loader=FileSystemLoader(str(resources.files("daebench.reports"))), autoescape=True)
    module = environment.get_template("methods/equations.html").module
    text = {name: str(getattr(module, name)()) for name in ("system", "euler", "shake", "rattle", "lobatto")}
    plain = {name: re.sub(r"\s|<[^>]*>", "", each).replace(MINUS, "-") for name, each in text.items()}
    for each in text.values():
        ElementTree.fromstring(f"<div>{each}</div>")
    assert "p^=p0-h(Hq(p^,q0)+G(q0)Tλ),q1=q0+hHp(p^,q0),0=g(q1),(1.19)" in plain["euler"]
    assert "p1=p^-hG(q1)Tμ,0=G(q1)Hp(p1,q1).(1.20)" in plain["euler"]
    assert "qn+1-2qn+qn-1=-h2M-1(Uq(qn)+G(qn)Tλn),0=g(qn+1).(1.23)" in plain["shake"]
    assert "p1/2=p0-h2(Hq(p1/2,q0)+G(q0)Tλ),q1=q0+h2(Hp(p1/2,q0)+Hp(p1/2,q1)),0=g(q1),(1.26)" in plain["rattle"]
    assert "p1=p1/2-h2(Hq(p1/2,q1)+G(q1)Tμ),0=G(q1)Hp(p1,q1)." in plain["rattle"]
    assert "Pi=p0-h∑ja^ij(Hq(Pj,Qj)+G(Qj)TΛj)," in plain["lobatto"]
    assert "(1.27)" not in plain["lobatto"]  # that number is the collocation form's, whose equations are others


# ---- sentences on planted numbers


DRIFT = {"energy": 1e-3, "distance": 1e-15, "failure": "", "kind": "bounded", "slope": 0.0, "slope_error": 1e-9, "growth": math.nan}
DRIFT |= {"H_long": "bounded", "g_long": "kept", "Gv_long": "kept"}
LINEAR = {"kind": "linear", "H_long": "drifts"}


def drift(**more):
    """Return a table of long runs that bears the page out, with rows altered by method."""
    rows = {"rattle": {}, "energy_momentum": {"energy": 1e-13, "distance": 1e-3}, "rk4+proj": {**LINEAR, "slope": -1e-6}}
    rows["radau2_ggl"] = {**LINEAR, "slope": -1e-4}
    return pd.DataFrame([{"method": name} | DRIFT | row | more.get(name.replace("+", "_"), {}) for name, row in rows.items()])


@pytest.fixture
def table():
    """Return a matrix of the methods of the long runs, all claims kept."""
    names = {"symmetric": "symmetric", "symplectic": "symplectic", "keeps_g": "keeps g", "keeps_Gv": "keeps G H_p"}
    rows = []
    for name in drift()["method"]:
        said = families.method(name).claims
        rows += [claim(name, each, getattr(said, key), 1e-15 if getattr(said, key) else 1e-3, 1e-12, OK) for key, each in names.items()]
        rows.append(claim(name, "keeps H", said.conserves_energy, 1e-13 if said.conserves_energy else 1e-3, 1e-12, OK))
    return matrix(pd.DataFrame(rows))


LONG_FAULTS = {
    "the energy of a symplectic method drifts": drift(rattle=LINEAR),
    "its run ends early": drift(rattle={"failure": "stopped"}),
    "a method leaves the manifold": drift(rk4_proj={"distance": 1e-6}),
    "nothing on the manifold drifts": drift(rk4_proj={"H_long": "bounded"}, radau2_ggl={"H_long": "bounded"}),
    "nothing off the manifold keeps the energy": drift(energy_momentum={"energy": 1e-3}),
}


@pytest.mark.parametrize("tampered", LONG_FAULTS.values(), ids=list(LONG_FAULTS))
def test_a_tampered_long_run_stops_the_page(table, tampered):
    assert check_long(drift(), table).others == ["energy_momentum", "radau2_ggl", "rk4+proj"]
    with pytest.raises(ClaimRefuted):
        check_long(tampered, table)


def power(method, two_form, reversal):
    order = families.method(method).claims.order
    rows = [("symplectic", *two_form), ("symmetric", *reversal)]
    return [{"method": method, "property": x, "order": order, "most": most, "power": p, "power_error": 0.01} for x, most, p in rows]


FLAT, STEEP, SHALLOW = (1e-15, math.nan), (1e-4, 3.0), (1e-4, 1.5)


def test_tampered_defects_stop_the_page():
    good = [power("rattle", FLAT, FLAT), power("midpoint", STEEP, FLAT), power("shake", FLAT, STEEP)]
    found = check_defects(pd.DataFrame([row for each in good for row in each]))
    assert (found.kept, found.flat, found.uneven) == (["rattle", "shake"], ["rattle", "midpoint"], ["shake"])
    for fault in (
        power("rattle", STEEP, FLAT),
        power("midpoint", SHALLOW, FLAT),
        power("midpoint", STEEP, STEEP),
        power("shake", FLAT, FLAT),
    ):
        rows = [row for each in good if each[0]["method"] != fault[0]["method"] for row in each]
        with pytest.raises(ClaimRefuted):
            check_defects(pd.DataFrame(rows + fault))


def test_a_method_for_the_reduced_equation_that_keeps_the_two_form_stops_the_page():
    rows = [claim("rk4", each, False, 0.1, 1e-12, NOT_CLAIMED) for each in ("symplectic", "keeps g", "keeps G H_p", "keeps H")]
    assert tally(pd.DataFrame(rows), matrix(pd.DataFrame(rows))).methods == 1
    for k in range(len(rows)):
        tampered = pd.DataFrame([row | {"measured": 1e-16} if k == j else row for j, row in enumerate(rows)])
        with pytest.raises(ClaimRefuted):
            tally(tampered, matrix(tampered))


# ---- a whole small report


SMALL = ("rattle", "rattle/kahan_li8", "strang", "shake", "energy_momentum", "radau2_ggl", "rk4+proj", "stiff:midpoint")


@pytest.fixture
def numbers():
    """Return the numbers of a few methods, measured uncompiled and in this process, with short runs."""

    def plain(name, *, compiled=False):
        return families.method(name)

    def short(ivp, own):
        return order_finding(ivp, own, halvings={2: 5, 3: 5, 4: 10}.get(own.claims.order))

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("os.cpu_count", lambda: 1)
        patch.setattr(sweep, "order_finding", short)
        for module in (sweep, long_runs):
            patch.setattr(module, "method", plain)
        patch.setattr(measured, "names", lambda: [name for name in families.names() if name in SMALL])
        patch.setattr(measured, "REPEATS", 1)
        patch.setattr(sweep, "TIMED_STEPS", 100)
        patch.setattr(long_runs, "T_LONG", 50.0)
        yield measure(lambda fraction, doing: None)


TAMPERED = {
    "rattle: symplectic on": changed("claims", "verdict", FALLS_SHORT, "method == 'rattle' and property == 'symplectic'"),
    "strang needs no iteration": changed("work", "newton", 2.0, "method == 'strang'"),
    "the positions of rattle": changed("points", "error", 1e-3, "method == 'shake' and component == 'q'"),
    "proj drifts linearly": changed("drift", "kind", "bounded", "method == 'rk4+proj'"),
    "keep it": changed("drift", "energy", 1e-3, "method == 'energy_momentum'"),
    "drifts on the motion through": changed("reverse", "change", 1e-9, "case == 'through_hole'"),
    "to and fro": changed("reverse", "up", 3.0, "case == 'trough'"),
    "no constraint to round-off": changed("ida", "g", 1e-16, "method == 'ida:ggl'"),
}
"""Words of claims, and faults that refute them."""


@pytest.mark.slow
def test_the_report_on_a_few_methods_is_made_and_tampered_numbers_stop_it(numbers, tmp_path, looks_right, monkeypatch):
    found = check(numbers)
    assert found.tally.methods == len(SMALL)
    assert found.guide.everything == ["rattle", "rattle/kahan_li8"]
    assert found.orders.untold == ["stiff:midpoint"]
    for said, tamper in TAMPERED.items():
        with pytest.raises(ClaimRefuted, match=said):
            check(tamper(numbers))
    monkeypatch.setattr(methods, "measure", lambda tell: numbers)
    page = build("methods", tmp_path)
    standalone(page)
    looks_right(page)
    shown = pd.read_csv(page.parent / "tables" / "methods.csv").set_index("method")
    assert shown.loc["rattle", "symplectic"] == "kept"
    assert len(pd.read_csv(page.parent / "figures" / "matrix.csv")) == len(SMALL) + len(FORMULATIONS)

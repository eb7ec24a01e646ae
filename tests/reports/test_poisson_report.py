"""The report on Poisson systems: its numbers against closed forms, claims that faults refute, tables, and the page."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from reported import tables_of_page
from tampered import changed

from daebench.pages.report.claims import ClaimRefuted
from daebench.reports import poisson
from daebench.reports.poisson import Numbers, body, casimirs, check, lattice, methods
from daebench.reports.poisson import defects as _poisson_defects
from daebench.reports.poisson import orbits as _poisson_orbits
from daebench.reports.poisson.defects import check_defects, check_lemma
from daebench.reports.poisson.orbits import check_orbits, level_curve, orbits, printed_step
from daebench.reports.poisson.runs import ivp_of, solve

FIGURES = ("orbits", "energy", "defects", "casimirs", "lattice", "sphere")
TINY, SMALL = 1e-15, 1e-3


def H(u, v):
    return u - np.log(u) + v - 2 * np.log(v)


def test_the_exact_orbit_has_the_energy_of_its_start_and_goes_through_it():
    curve = level_curve(ivp_of("lotka_volterra", "6,2"))
    assert np.max(np.abs(H(curve["u"], curve["v"]) - H(6, 2))) < 1e-12
    assert np.hypot(curve["u"] - 6, curve["v"] - 2).min() < 1e-12
    assert curve["u"].min() < 0.02 < 1 < curve["u"].max()


def test_the_printed_step_solves_the_equations_of_example_4_7():
    u, v, h = 4.0, 2.3, 0.05
    u1, v1 = printed_step(np.array([u, v]), h, {"a": 1.0, "b": 2.0})
    assert abs(u1 - (u + h * u1 * v * (1 - 2 / v))) < 1e-14
    assert abs(v1 - (v - h * u1 * v * (1 - 1 / u1))) < 1e-14
    ivp = ivp_of("lotka_volterra", "4,2", y0=(u, v))
    assert np.allclose(solve(ivp, "symplectic_euler", h, 1).y[1], [u1, v1], rtol=1e-13, atol=0)
    assert printed_step(np.array([6.0, 2.0]), 0.25, {"a": 1.0, "b": 2.0}) == (6.0, -0.5)


@pytest.mark.parametrize("energy", [0.52, 0.6, 0.625, 0.7, 0.82], ids=str)
def test_polhodes_are_on_the_sphere_and_on_the_ellipsoid(energy):
    e = 1 / np.array([0.6, 0.8, 1.0])
    one, other = body.polhode(energy, tuple(e))
    for curve in (one, other):
        assert np.max(np.abs(np.sum(curve**2, axis=0) - 1)) < 1e-14
        assert np.max(np.abs(e @ curve**2 / 2 - energy)) < 1e-14
    assert np.max(np.abs(one - other)) > 0.1


def test_casimir_errors_are_those_of_the_run(monkeypatch):
    monkeypatch.setattr(casimirs, "SYSTEMS", {"lotka_volterra_3d": ("blow_up", 0.02, 40)})
    monkeypatch.setattr(casimirs, "DEFECT_STEPS", {"lotka_volterra_3d": 3})
    table, series = casimirs.casimirs("lotka_volterra_3d")
    found = table.set_index("method")
    y = solve(ivp_of("lotka_volterra_3d", "blow_up"), "midpoint", 0.02, 40).y
    C = np.log(y) @ [-1, -1, 1]
    assert found["casimir"]["midpoint"] == pytest.approx(np.max(np.abs(C - C[0])), rel=1e-9)
    assert found["casimir"]["strang"] < 1e-14
    assert np.all(series.groupby("method")["casimir"].apply(lambda x: np.all(np.diff(x) >= 0)))
    assert series.groupby("method")["casimir"].last()["midpoint"] == found["casimir"]["midpoint"]


def test_a_run_beyond_the_blow_up_breaks_off_there():
    found = casimirs.break_off("rk4")
    assert abs(found["t"] - casimirs.BLOW_UP) < 0.02
    assert "stopped at t = 1.7" in found["failure"]


@pytest.fixture(scope="module")
def fig41():
    return orbits()


@pytest.fixture(scope="module")
def measured_defects():
    return (
        pd.concat([_poisson_defects.defects(name) for name in _poisson_defects.METHODS], ignore_index=True),
        pd.concat([_poisson_defects.lemma(name) for name in _poisson_defects.CONSTRAINED], ignore_index=True),
    )


def test_figure_4_1_is_as_the_book_has_it(fig41):
    found = check_orbits(fig41)
    assert (found.outer["u_next"], found.outer["v_next"]) == (6.0, -0.5)
    assert found.inner["steps"] > 700
    assert found.row["midpoint"]["6"]["left"] < 0.8
    own = fig41.points[(fig41.points["method"] == "verlet") & (fig41.points["case"] == "4,2")]
    assert len(own) == _poisson_orbits.STEPS + 1
    assert np.allclose(own["energy"], H(own["u"], own["v"]) - H(4, 2), atol=1e-13)


@pytest.mark.sampled(left_out=("verlet-midpoint", "verlet-symplectic_euler"))
@pytest.mark.parametrize(
    ("wrong", "right"), [("midpoint", "verlet"), ("verlet", "midpoint"), ("verlet", "symplectic_euler")], ids=lambda name: name
)
def test_another_method_in_figure_4_1_is_found_out(monkeypatch, wrong, right):
    monkeypatch.setattr(_poisson_orbits, "solve", lambda ivp, name, h, n: solve(ivp, wrong if name == right else name, h, n))
    with pytest.raises(ClaimRefuted):
        check_orbits(orbits())


def test_defects_are_round_off_or_have_the_powers_of_the_text(measured_defects):
    found = check_defects(_poisson_defects.slopes(measured_defects[0]).set_index("method"))
    assert found.kept < 1e-14
    lemma = check_lemma(measured_defects[1])
    assert lemma.symplectic["local:rk4"] == pytest.approx(5, abs=0.05)
    assert lemma.kept < 1e-13


def test_a_wrong_structure_matrix_is_found_out(monkeypatch):
    from daebench.reports.poisson import runs

    true = runs.poisson_defect
    monkeypatch.setattr(runs, "poisson_defect", lambda flow, y, B: true(flow, y, lambda y: B(y) / y[0]))
    frame = pd.concat([_poisson_defects.defects(name) for name in _poisson_defects.METHODS], ignore_index=True)
    with pytest.raises(ClaimRefuted, match="strang is a Poisson map to round-off"):
        check_defects(_poisson_defects.slopes(frame).set_index("method"))


def casimir_rows():
    """Return rows of the methods on each system: good ones keep Casimir functions and energy, midpoint quadratic ones."""
    rows = [(problem, name) for problem in casimirs.SYSTEMS for name in casimirs.METHODS]
    table = pd.DataFrame(rows, columns=["problem", "method"]).assign(h=0.1, t_end=10.0, energy=SMALL)
    table = table[(table["method"] != "darboux:verlet") | (table["problem"] != "heavy_top_lie_poisson")]
    good = table["method"].isin(["strang", "strang/suzuki4", "darboux:verlet"])
    kept = good | ((table["method"] == "midpoint") & (table["problem"] != "lotka_volterra_3d"))
    return table.assign(
        defect=np.where(good, TINY / 4, SMALL),
        energy_kind=np.where(good, "bounded", "linear"),
        casimir=np.where(kept, TINY, SMALL),
        casimir_kind=np.where(kept, "kept", "linear"),
    )


def lattice_rows():
    size = {"strang": 5.0, "strang/suzuki4": 1e-6, "darboux:verlet": 1e-4, "midpoint": 1e-8, "rk4": 1e-7}
    rows = []
    for name, h in [*((name, lattice.H) for name in lattice.METHODS), ("strang", lattice.FINE)]:
        row = {"method": name, "h": h, "ns": 1e3}
        for quantity in lattice.QUANTITIES:
            value = size[name] if h == lattice.H else 0.1
            value = TINY if name == "midpoint" and quantity in ("coupling", "momentum") else value
            row |= {quantity: value, f"{quantity}_kind": "linear" if name == "rk4" else "bounded" if value > TINY else "kept"}
        rows.append(row)
    return pd.DataFrame(rows)


def body_rows():
    energies = dict(zip(body.ORDERS, (4e-3, 1e-3, 6e-3, 1e-3, 1e-2, 9e-3), strict=True))
    energies |= {"strang@top": 8e-4, "darboux:verlet": 6e-4, "midpoint": TINY, "rk4": 1e-5, "lifted:rattle": TINY}
    rows = []
    for name in body.METHODS:
        said, grows = name not in ("midpoint", "rk4"), "linear" if name == "rk4" else "kept"
        row = {"method": name, "claimed_poisson": said, "energy": energies[name], "C": SMALL if name == "rk4" else TINY, "C_kind": grows}
        row |= {"energy_kind": grows if energies[name] == TINY or name == "rk4" else "bounded", "defect": TINY if said else SMALL}
        rows.append(row)
    return pd.DataFrame(rows)


def method_rows():
    rows = []
    for k, name in enumerate(methods.METHODS):
        said = name not in ("midpoint", "rk4")
        row = {"method": name, "order": 2, "class": "split", "form": "darboux" if ":" in name else "", "claimed": said, "energy": SMALL}
        row |= {
            "defect": TINY if said else SMALL,
            "kind": "bounded" if said else "linear",
            "slope": 1e-5,
            "slope_error": 1e-7,
            "ns": 30.0 + k,
        }
        rows.append(row | {f"casimir_{problem}": TINY if said else SMALL for problem in methods.CASIMIR_SYSTEMS})
    return pd.DataFrame(rows)


@pytest.fixture(scope="module")
def numbers(fig41, measured_defects):
    """Return numbers of which all that the page says is true: some measured, those that need compiled kernels made up."""
    t = np.geomspace(0.01, 20, 120)
    table = casimir_rows()
    names = zip(table["problem"], table["method"], strict=True)
    over_time = [pd.DataFrame({"problem": problem, "method": name, "t": t, "casimir": 1e-9 * t}) for problem, name in names]
    waves = [
        pd.DataFrame({"method": name, "h": lattice.H, "t": t} | dict.fromkeys(lattice.QUANTITIES, 1e-9 * t)) for name in lattice.METHODS
    ]
    return Numbers(
        orbits=fig41,
        defects=measured_defects[0],
        lemma=measured_defects[1],
        casimirs=table,
        casimir_series=pd.concat(over_time, ignore_index=True),
        break_off=pd.DataFrame({"method": casimirs.METHODS, "t": 1.745, "failure": "stopped"}),
        lattice=lattice_rows(),
        lattice_series=pd.concat(waves, ignore_index=True),
        cost=pd.DataFrame({"sites": lattice.SIZES, "ns_per_site": 100.0}),
        sizes=dict.fromkeys(lattice.QUANTITIES, 7.0),
        speeds={"all": 100.0, "part": 1000.0, "rate": 512.0},
        body=body_rows(),
        trajectories=pd.concat([body.trajectories(name) for name in body.SHOWN], ignore_index=True),
        polhodes=body.polhodes(),
        methods=method_rows(),
    )


def orbit(column, value, rows):
    return lambda numbers: replace(numbers, orbits=changed("table", column, value, rows)(numbers.orbits))


TAMPERED = {
    "the printed form takes its first step": orbit("steps", 3, "method == 'symplectic_euler' and case == '6,2'"),
    "verlet does not close": orbit("orbit", "irregular", "method == 'verlet'"),
    "midpoint loses little": orbit("left", 0.99, "method == 'midpoint' and case == '4,2'"),
    "strang is not a Poisson map": changed("defects", "defect", 1e-9, "method == 'strang'"),
    "midpoint has defect O(h)": changed("defects", "defect", 1e-3, "method == 'midpoint'"),
    "RATTLE is symplectic alone": changed("lemma", "poisson", 1e-9, "method == 'rattle'"),
    "a splitting loses a Casimir": changed("casimirs", "casimir", 1e-9, "method == 'strang'"),
    "rk4 bounds Casimirs": changed("casimirs", "casimir_kind", "bounded", "method == 'rk4'"),
    "a run goes on beyond the blow-up": changed("break_off", "failure", "", "method == 'rk4'"),
    "rk4 bounds the norm": changed("lattice", "norm_kind", "bounded", "method == 'rk4'"),
    "strang is good on the lattice": changed("lattice", "norm", 1e-3, f"method == 'strang' and h == {lattice.H!r}"),
    "parts are slow": lambda numbers: replace(numbers, speeds={"all": 100.0, "part": 100.0}),
    "a splitting leaves the sphere": changed("body", "C", 1e-9, "method == 'strang@231'"),
    "lifted RATTLE is not a Poisson map": changed("body", "defect", 1e-6, "method == 'lifted:rattle'"),
    "midpoint leaves the energy curves": changed("trajectories", "energy", 1e-6, "method == 'midpoint'"),
    "a claim is wrong": changed("methods", "defect", 1e-6, "method == 'verlet'"),
    "a Poisson integrator drifts": changed("methods", "kind", "linear", "method == 'strang'"),
    "rk4 keeps a Casimir": changed("methods", "casimir_free_rigid_body", 1e-16, "method == 'rk4'"),
}


def test_the_page_is_made_of_numbers_of_which_its_story_is_true_and_none_is_made_of_tampered_ones(numbers, tmp_path, monkeypatch):
    found = check(numbers)
    assert found.closing.poisson == len(methods.METHODS) - 2
    assert (found.body.worst, found.body.factor) == ("strang@312", pytest.approx(10, rel=1e-12))
    assert found.lattice.ratio == pytest.approx(5e4, rel=1e-12)
    assert found.lattice.fast == 10
    assert 0.8 < found.body.shortest <= found.body.longest < 0.95
    for tamper in TAMPERED.values():
        with pytest.raises(ClaimRefuted):
            check(tamper(numbers))
    rows = tables_of_page(poisson, "poisson", numbers, FIGURES, tmp_path, monkeypatch)
    assert rows == {"orbits": 8, "slopes": 17, "casimirs": 14, "break_off": 5, "lattice": 6, "cost": 4, "body": 11, "methods": 8}

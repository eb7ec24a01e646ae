"""What precision buys: which ways a method has, what a table made by hand says, and numbers of single precision and of few sweeps."""

import json

import pandas as pd
import pytest
from refusals import refused

from daebench.studies.precision import says, smallest_steps, specifications_of
from daebench.studies.stability.extreme import Asked

ASKED = Asked(problem="planar_pendulum", case="rotating", methods=("rattle", "strang"), t_end=2.0, h=(0.125, 0.0625))


def test_ways_that_a_method_does_not_have_are_left_out_or_refused():
    poisson = Asked(problem="lotka_volterra", methods=("midpoint",), anyway=True)
    found, left_out = specifications_of(poisson, ("float64", "sweeps=1"))
    assert ({way for way, _ in found}, set(left_out)) == ({"float64"}, {"midpoint, sweeps=1"})
    for code, asked, *ways in (
        ("unknown-name", ASKED, ("float16",)),
        ("precision-ways-refused", poisson, ("sweeps=1",)),
        ("precision-uncertified", Asked(problem="planar_pendulum", case="rotating", t_end=1e4)),
        ("precision-without-method", Asked(problem="planar_pendulum", methods=("scipy:RK45",))),
    ):
        with refused(code):
            specifications_of(asked, *ways)


def table(**ways):
    """Return a table with two steps of one method, the numbers of the smaller given: time, error, energy error, |g|, |G H_p|, defect."""
    names = ("seconds", "error_q", "energy_error", "g", "Gv", "defect")
    every = {"method": "one", "failure": "", "energy_scale": 1.0, "energy_slope": 0.0, "energy_verdict": "bounded", "t_end": 1.0}
    rows = [every | {"way": way, "value": h} | dict(zip(names, numbers, strict=True)) for h in (0.1, 0.01) for way, numbers in ways.items()]
    return pd.DataFrame(rows)


def test_the_cheapest_way_that_is_as_good_is_named():
    early = {
        "sweeps=1": (0.5, 1e-8, 1e-9, 1e-16, 1e-16, 1e-6),
        "sweeps=2": (1.0, 1e-8, 1e-9, 1e-16, 1e-16, 3e-16),
        "sweeps=3": (1.5, 1e-8, 1e-9, 1e-16, 1e-16, 1e-16),
    }
    found = table(float64=(2.0, 1e-8, 1e-9, 1e-16, 1e-16, 1e-16), **early, float32=(1.6, 1e-4, 1e-5, 1e-7, 1e-7, float("nan")))
    assert list(smallest_steps(found)["time_ratio"]) == [1.0, 0.25, 0.5, 0.75, 0.8]
    (said,) = says(found)
    assert "sweeps=2 is as accurate in error, energy, constraints and two-form, in 0.50 times the time" in said
    assert said.endswith("single precision 1.0e-04, in 0.80 times the time.")
    (said,) = says(table(float64=(2.0, 1e-8, 1e-9, 1e-16, 1e-16, 1e-16), mixed=(1.5, 1e-7, 1e-8, 1e-16, 1e-16, float("nan"))))
    assert said.endswith("single precision of the forces alone 1.0e-07, in 0.75 times the time.")


@pytest.mark.parametrize("spoilt", range(1, 6))
def test_one_number_that_is_worse_is_enough(spoilt):
    good, bad = [2.0, 1e-8, 1e-9, 1e-16, 1e-16, 1e-16], [1.0, 1e-8, 1e-9, 1e-16, 1e-16, 1e-16]
    bad[spoilt] = 1e-7
    (said,) = says(table(float64=good, **{"sweeps=1": bad}))
    assert "never as accurate" in said


@pytest.mark.usefixtures("uncompiled_schemes")
def test_the_command_measures_each_way(daebench, tmp_path):
    words = f"--methods rattle --ways float64,mixed,float32,sweeps=1 --t-end 1 --repeat 0 --h 0.125,0.0625 --out {tmp_path} --json"
    status, out, err = daebench("precision", "planar_pendulum", "--case", "rotating", *words.split())
    assert (status, err) == (0, "")
    rows = {row["way"]: row for row in json.loads(out)["smallest_steps"]}
    assert 1e-9 < rows["float32"]["g"] < 1e-5
    assert max(rows["float64"]["g"], rows["mixed"]["g"]) < 1e-14
    assert rows["sweeps=1"]["defect"] > 1e-9 > 1e-13 > rows["float64"]["defect"]
    assert rows["float32"]["defect"] is rows["mixed"]["defect"] is None

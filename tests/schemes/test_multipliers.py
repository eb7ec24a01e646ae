"""Multipliers of schemes are the force in the rod of a pendulum, by Newton's law, at the times that they are said to belong to."""

import numpy as np
import pytest
from ivps import ivp
from measures import error_of
from oracles import solution
from runs import run

from daebench.diagnostics.order import fit_order


def tension(t):
    """Return lam of the planar pendulum, 2 lam q = -p' - (0, 1), along the rod: lam = (|p|^2 - q2) / 2."""
    q, p = solution("planar", t)
    return (p @ p - q[1]) / 2


@pytest.mark.parametrize(
    "scheme", ["rattle", "shake", "lobatto2", "lobatto3", "radau2_index2", "radau2_ggl", "energy_momentum", "generalized_alpha"]
)
def test_each_multiplier_is_the_force_in_the_rod(scheme):
    found = run(scheme, ivp("planar"), 0.002, 10, raw=True)
    vanishing = ("mu_1", "mu_2") if scheme == "radau2_ggl" else ()
    named = {name: parts for name, parts in found.raw.items() if name not in vanishing}
    assert named
    for t, values in named.values():
        assert np.allclose(values[1:, 0], [tension(time) for time in t[1:]], rtol=0.01)


def test_the_mean_of_two_steps_multipliers_is_of_second_order_and_each_of_them_of_first():
    counts, errors = (64, 128, 256, 512), {"lam_n": [], "mu_n": [], "mean": []}
    for n in counts:
        for name, (t, values) in run("rattle", "planar", 1 / n, n, raw=True).raw.items():
            errors[name].append(error_of(values[1:, 0], [tension(time) for time in t[1:]]))
    slopes = {name: fit_order([1 / n for n in counts], each).slope for name, each in errors.items()}
    assert slopes == pytest.approx({"lam_n": 1, "mu_n": 1, "mean": 2}, abs=0.1)

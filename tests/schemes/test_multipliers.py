"""Multipliers of schemes are the force in the rod of a pendulum, by Newton's law, at the times that they are said to belong to."""

import numpy as np
import pytest
from ivps import ivp
from oracles import solution
from runs import run


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

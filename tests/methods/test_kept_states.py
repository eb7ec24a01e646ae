"""States of some 300 pairs of problem and method are to the bit those that were kept, on a platform like the one where they were made."""

import json

import kept_states
import numpy as np
import planting
import pytest
from measures import error_of

KEPT = json.loads(kept_states.FILE.read_text())
PAIRS = {kept_states.name_of(pair): pair for pair in kept_states.pairs()}
LONG = ("andrews_squeezer", "bricard", "butane", "cyclohexane_ring", "double_wishbone", "fekete", "pendulum_chain", "watt_six_bar")
"""Problems whose kernels take ten seconds to make: they are for the day of a release."""

DRAWN = planting.drawn([name for name in KEPT["states"] if not name.startswith(LONG)], planting.digest(), 5)
"""Pairs that the gate runs: other ones for each tree."""

ROUNDINGS = 1e-13
"""Part of a state by which it may differ elsewhere after ten steps, and after a thousand times what a perturbation grows by."""


def test_each_pair_is_kept_or_refused():
    assert {*KEPT["states"], *KEPT["refused"]} == set(PAIRS)
    assert len(KEPT["states"]) > 300


@pytest.mark.filterwarnings("ignore:.*the motion is lost", "ignore:.*is broken from")
@pytest.mark.sampled(by=lambda case: case in DRAWN)
@pytest.mark.parametrize("name", KEPT["states"])
def test_a_state_after_a_thousand_steps_is_that_which_was_kept(name):
    kept = KEPT["states"][name]
    row, work, failure = kept_states.final(*PAIRS[name], kept_states.STEPS)
    assert (list(work.values()), bool(failure)) == (kept["work"], kept["stopped"])
    if KEPT["made on"] == kept_states.made_on():
        assert kept_states.hashed(row) == kept["hash"]
        return
    some = kept_states.some_of(row)
    early = kept_states.final(*PAIRS[name], kept_states.FEW)[0][some]
    scale = np.max(np.abs(row))
    assert error_of(early, kept["early"]) <= ROUNDINGS * scale
    assert error_of(row[some], kept["late"]) <= ROUNDINGS * (scale + kept["growth"])

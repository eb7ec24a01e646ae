"""About how long: kept runs are a measure for those like them, and compilation is counted apart from work."""

import hashlib
from dataclasses import replace

import pytest

from daebench.records.code import code_version
from daebench.records.rows import StoredRow
from daebench.records.store import opened
from daebench.studies.grid.estimate import LEAST_COMPILE, LEAST_SECONDS, MOST_COMPILE, STEP_SECONDS, TOLERANCE_SECONDS, estimate
from daebench.studies.grid.run_specification import GridRun

FIXED = GridRun(problem="planar_pendulum", case="rotating", method="rattle", value=0.01, t_end=100.0, metrics=("energy",))
CHOSEN = replace(FIXED, method="scipy:DOP853", value=1e-6)


@pytest.fixture
def store(tmp_path):
    with opened(tmp_path / "rows.db") as found:
        yield found


def keep(store, specification, took, failure="", maker=""):
    store.put(
        [StoredRow(hashlib.sha256(f"{specification}".encode()).hexdigest(), specification.plain(), {"failure": failure}, maker, took)]
    )


def test_without_kept_runs_it_is_what_is_usual(store):
    found = estimate([FIXED, replace(FIXED, t_end=0.1), CHOSEN], store)
    assert found.seconds == pytest.approx(1e4 * STEP_SECONDS + LEAST_SECONDS + 100 * TOLERANCE_SECONDS)


def test_time_is_in_proportion_to_steps_and_repetitions_and_not_to_what_the_first_run_compiled(store):
    keep(store, replace(FIXED, value=0.1), 5.0)
    keep(store, FIXED, 0.5)
    keep(store, replace(FIXED, value=0.02), 0.0, failure="stopped at once")
    found = estimate([replace(FIXED, value=0.001, repeat=3)], store)
    assert found.seconds == pytest.approx(0.5 * 10 * 4)
    assert found.sentence(2, "on 2 processes").startswith("about 11 s on 2 processes (an estimate from stored runs of the same methods")


STIFF = replace(FIXED, method="lobatto4")
KERNELS = {
    "one": ([FIXED], 1),
    "numbers compile nothing": ([FIXED, replace(FIXED, value=0.1, t_end=3.0, case="near_top", parameters=(("gravity", 2.0),))], 1),
    "what is timed": ([replace(FIXED, repeat=3)], 2),
    "by tolerance": ([replace(CHOSEN, repeat=3)], 1),
    "two methods": ([FIXED, STIFF, CHOSEN], 3),
    "two precisions": ([FIXED, replace(FIXED, precision="float32"), replace(FIXED, compensated=True)], 3),
}


@pytest.mark.parametrize(("specifications", "count"), KERNELS.values(), ids=KERNELS)
def test_kernels_that_nothing_kept_has_compiled_are_counted_with_their_time(store, specifications, count):
    found = estimate(specifications, store)
    assert found.kernels == count
    assert found.compiling >= count * LEAST_COMPILE
    for maker, kernels in (("another version", count), (code_version(), 0)):
        for specification in specifications:
            keep(store, replace(specification, value=specification.value / (2 + len(maker))), 1.0, maker=maker)
        found = estimate(specifications, store)
        assert (found.kernels, found.compiling > 0) == (kernels, kernels > 0)


def test_more_stages_and_larger_problems_take_longer_to_compile_up_to_a_limit(store):
    large = replace(FIXED, problem="andrews_squeezer", case="bari")
    small, one_stage, stages = (estimate([each], store).compiling for each in (FIXED, large, replace(large, method="lobatto4")))
    assert small < one_stage <= stages <= MOST_COMPILE


def test_where_steps_are_chosen_the_nearest_tolerance_tells(store):
    keep(store, replace(CHOSEN, value=1e-4), 1.0)
    keep(store, replace(CHOSEN, value=1e-8), 3.0)
    assert estimate([replace(CHOSEN, value=1e-9, t_end=200.0)], store).seconds == pytest.approx(6.0)
    mixed = estimate([CHOSEN, FIXED], store)
    assert (mixed.like, mixed.runs) == (1, 2)

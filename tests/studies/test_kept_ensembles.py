"""Ensembles in a store: the bits of those that are not kept, whoever makes the pieces and however they were interrupted."""

import json
from dataclasses import replace

import numpy as np
import pytest
from refusals import refused, require_refusals

import daebench
from daebench.errors import Interrupted
from daebench.records.comparison import EQUAL
from daebench.records.store import Store, StoreWarning, opened
from daebench.studies.ensemble import run as ensembles
from daebench.studies.grid import schedulers
from daebench.studies.grid.estimate import estimate
from daebench.studies.grid.export import table_of
from daebench.studies.grid.measure import row_of
from daebench.studies.grid.member_runs import MemberRuns, members_of
from daebench.studies.grid.reproduce import compared
from daebench.studies.grid.schedulers import local_processes
from daebench.studies.grid.specification import key_of, specification_of

SWINGS = {"case": "horizontal", "method": "rattle", "h": 0.1, "t_end": 5, "members": 12, "points": 6}
ARRAYS = ("states", "index", "ends", "steps", "status", "pivots")


@pytest.fixture
def small_pieces(monkeypatch):
    monkeypatch.setattr(ensembles, "PIECE", 5)


def made(**more):
    return daebench.ensemble("planar_pendulum", **SWINGS | more)


def assert_same(one, other):
    for name in ARRAYS:
        np.testing.assert_array_equal(getattr(one.run, name), getattr(other.run, name), name)
    for name in ("maxima", "work"):
        np.testing.assert_equal(getattr(one.run, name), getattr(other.run, name), name)
    assert (one.starts, one.seed) == (other.starts, other.seed)
    assert [one.run.failure(int(i)) for i in one.run.failed] == [other.run.failure(int(i)) for i in other.run.failed]


def interrupted_after(store, pieces):
    """Have Ctrl-C come once so many pieces are kept."""
    put = store.put

    def stopped(rows):
        put(rows)
        if len(store) == pieces:
            raise KeyboardInterrupt

    store.put = stopped


OTHERS = {"count": True, "watch": ("energy", "manifold", "integrals"), "vary": {"gravity": (0.5, 2.0)}}


@pytest.mark.parametrize("more", [{}, pytest.param(OTHERS, marks=pytest.mark.slow)], ids=["plain", "varied and counted"])
def test_what_is_kept_has_the_bits_of_what_is_not_and_is_not_made_again(more, small_pieces, tmp_path, monkeypatch):
    whole = made(**more)
    with opened(tmp_path / "kept.db") as store:
        assert_same(whole, made(store=store, **more))
        assert (len(store), store.runs) == (3, 12)
        monkeypatch.setattr(ensembles, "computed", lambda pieces, store, **_: {key_of(piece): store.get(key_of(piece)) for piece in pieces})
        assert_same(whole, made(store=store, **more))


def test_an_ensemble_that_is_interrupted_goes_on_to_the_same_bits(small_pieces, tmp_path):
    told = []
    with refused("interrupted", Interrupted, says=("5",)), opened(tmp_path / "kept.db") as store:
        interrupted_after(store, 1)
        made(store=store)
    with opened(tmp_path / "kept.db") as store:
        again = made(store=store, progress=told.append)
    assert len(told) == 2
    assert_same(made(), again)


def test_members_that_fail_and_have_steps_of_their_own_are_kept_with_their_reasons(small_pieces, tmp_path):
    grid = {"starts": "grid", "drawn": {"values": {"h": [0.1, 3.0, 0.2, 4.0, 5.0, 0.3, 0.4]}}, "steps": 20}
    asked = {name: value for name, value in SWINGS.items() if name not in ("h", "t_end", "members")} | grid
    whole = daebench.ensemble("planar_pendulum", **asked)
    with opened(tmp_path / "kept.db") as store:
        assert_same(whole, daebench.ensemble("planar_pendulum", **asked, store=store))
        table = table_of(store)
    assert whole.run.failed.tolist() == [1, 3, 4]
    assert table.sort_values("member")["failure"].tolist() == [whole.run.failure(i) or "" for i in range(7)]
    assert {"max_energy", "max_g", "steps", "key", "maker"} <= set(table)
    assert not {"arrays", "numbers", "differing"} & set(table)


def test_another_seed_step_or_parameter_is_another_piece(small_pieces, tmp_path):
    with opened(tmp_path / "kept.db") as store:
        counts = []
        for more in ({}, {"seed": 1}, {"h": 0.05}, {"points": 3}, {"parameters": {"mass": 2.0}}, {"compensated": True}, {"members": 17}):
            made(store=store, **more)
            counts.append(len(store))
    assert counts == [3, 6, 9, 12, 15, 18, 20]


def test_a_piece_is_what_its_plain_fields_say_and_is_made_again_to_the_bit(small_pieces, tmp_path):
    with opened(tmp_path / "kept.db") as store:
        made(store=store)
        for stored in store.all():
            piece = specification_of(json.loads(json.dumps(stored.specification)))
            assert isinstance(piece, MemberRuns)
            assert key_of(piece) == stored.key
            assert compared(stored.row, row_of(piece), rtol=0, atol=0).verdict == EQUAL
        assert estimate([piece], store).runs == piece.members
        with refused("stored-members-incomplete"):
            members_of(replace(piece, numbers=piece.numbers[:-8]))


def test_a_damaged_row_is_made_again_and_that_is_said(small_pieces, tmp_path):
    path = tmp_path / "kept.db"
    with opened(path) as store:
        whole = made(store=store)
        store._base.execute("UPDATE rows SET row = replace(row, 'arrays', 'errays')")
    with pytest.warns(StoreWarning, match="3 rows are not what was written"):
        store = Store(path)
    assert len(store) == 0
    assert_same(whole, made(store=store))
    store.close()


def test_two_processes_make_the_bits_of_one(small_pieces, tmp_path):
    with opened(tmp_path / "kept.db") as store, local_processes(2) as executor:
        assert_same(made(), made(store=store, executor=executor))


def test_what_cannot_be_kept_is_refused_in_a_sentence(tmp_path, monkeypatch):
    with opened(tmp_path / "kept.db") as store:
        with refused("executor-without-store"):
            made(executor=object())
        with refused("stored-ensemble-unnamed"):
            daebench.ensemble(daebench.initial_value_problem("planar_pendulum", "horizontal"), method="rattle", h=0.1, steps=5, store=store)
        monkeypatch.setattr(ensembles, "MOST_NUMBERS", 20)
        with refused("member-points-too-many", says=("24",)):
            made(store=store)


RUN = ("ensemble", "planar_pendulum", "--case", "horizontal", "--method", "rattle", "--h", 0.1, "--t-end", 5, "--members", 12)


def test_the_command_keeps_members_in_a_file_or_folder(daebench, tmp_path, small_pieces):
    told = [daebench(*RUN, "--store", tmp_path / "own.db", "--json") for _ in range(2)]
    assert [status for status, _, _ in told] == [0, 0]
    assert json.loads(told[0][1]) == json.loads(told[1][1])  # times too: nothing was run
    assert daebench(*RUN, "--out", tmp_path)[0] == 0
    for name in ("own.db", "studies.db"):
        with opened(tmp_path / name) as store:
            assert store.runs == 12


def test_bad_words_are_one_sentence(daebench, tmp_path, monkeypatch):
    pytest.importorskip("distributed", reason="the extra scale is not installed")
    monkeypatch.setattr(schedulers, "REACHED_SECONDS", 0.5)
    require_refusals(daebench, RUN, ("executor-needs-store", "--workers 2"))
    require_refusals(
        daebench,
        (*RUN, "--store", tmp_path / "own.db"),
        ("workers-not-positive", "--workers 0"),
        ("no-dask-scheduler", "--scheduler tcp://127.0.0.1:9"),
        ("no-dask-scheduler", "--scheduler nowhere"),
        ("workers-beside-scheduler", "--workers 2 --scheduler tcp://127.0.0.1:9"),
    )

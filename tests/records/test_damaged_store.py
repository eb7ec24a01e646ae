"""A damaged store: what is lost is named, the rest is kept and is what was written, and the store can be used again."""

import hashlib
import random
import sqlite3
import warnings
from contextlib import closing

import pytest
from cache_damage import FAMILY, flipped, zeroed

from daebench.errors import BadInput
from daebench.records.rows import StoredRow
from daebench.records.store import Store, StoreWarning
from daebench.studies.grid.run_specification import GridRun

CELL = GridRun(problem="planar_pendulum", case="rotating", method="rattle", value=0.1, t_end=4.0, metrics=("energy",))
COUNT = 120
ABOUT = {"problem": "planar_pendulum", "case": "rotating", "method": "rattle", "knob": "h", "t_end": 4.0, "t_reached": 4.0, "failure": ""}
RIGHT = {
    hashlib.sha256(str(k).encode()).hexdigest(): {
        **ABOUT,
        "value": 0.1 + k,
        "steps": 40,
        "energy_error": k / 7,
        **{f"column{j}": k + j / 7 for j in range(20)},
    }
    for k in range(COUNT)
}


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """Return the bytes of a store of many rows."""
    path = tmp_path_factory.mktemp("whole") / "rows.db"
    with closing(Store(path)) as store:
        store.put([StoredRow(key, CELL.at(0.1 + k).plain(), row, "m" * 64, 0.5) for k, (key, row) in enumerate(RIGHT.items())])
    return path.read_bytes()


def many():
    """Return damages of every place of a file: the head, single bits anywhere, and stretches that are zero."""
    chance = random.Random(20240607)
    found = dict(FAMILY)
    for k in range(16):
        anywhere, head, start = chance.random(), chance.randrange(200), chance.uniform(0, 0.95)
        found[f"bit {k}"] = lambda content, x=anywhere: flipped(content, x)
        found[f"bit {k} of the head"] = lambda content, x=head: flipped(content, x / len(content))
        found[f"zeros {k}"] = lambda content, x=start: zeroed(content, x, x + 0.03)
    return found


def opened(path):
    """Return the rows of a store, and what is said when it is opened."""
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        with closing(Store(path)) as store:
            return {each.key: each.row for each in store.all()}, [str(each.message) for each in said if each.category is StoreWarning]


def test_no_damage_changes_a_number_and_what_is_lost_is_said(whole, tmp_path):
    path, refused, kept = tmp_path / "rows.db", [], []
    for what, damage in many().items():
        for each in tmp_path.iterdir():
            each.unlink()
        path.write_bytes(damage(whole))
        try:
            rows, said = opened(path)
        except BadInput as error:
            refused.append(str(error))
            continue
        assert all(RIGHT[key] == row for key, row in rows.items()), what
        assert len(said) == 1 or len(rows) == COUNT or what == "cut at 0", what  # an empty file is a new store
        kept.append(len(rows))
        if len(kept) % 4:
            continue
        with closing(Store(path)) as store:
            store.put([StoredRow("0" * 64, CELL.plain(), {"a": 1}, "m", 0.5)])
        again, nothing = opened(path)
        assert (again, nothing) == ({**rows, "0" * 64: {"a": 1}}, []), what
    assert all(sentence.endswith("name another file.") for sentence in refused)
    assert len(refused) < len(kept) / 10
    assert sorted(kept)[len(kept) // 2] >= 0.9 * COUNT


def altered(path, command, *values):
    with closing(sqlite3.connect(path)) as base:
        base.execute(command, values)
        base.commit()


def test_a_row_that_says_something_else_is_named_and_the_others_stay(whole, tmp_path, daebench):
    path = tmp_path / "rows.db"
    path.write_bytes(whole)
    lost = sorted(RIGHT)[:3]
    for key, change in zip(lost, ("row = replace(row, '7', '8')", "took = 1e-3", "cell = 'nothing'"), strict=True):
        altered(path, f"UPDATE rows SET {change} WHERE key = ?", key)
    with warnings.catch_warnings():
        warnings.simplefilter("default", StoreWarning)
        status, out, err = daebench("export", path, tmp_path / "rows.csv")
    assert status == 0
    assert f"{COUNT - 3} rows" in out
    assert err.count("\n") == 1
    for words in ("3 rows", "rattle on planar_pendulum, case rotating", "rows.damaged-1.db"):
        assert words in err
    assert opened(path) == ({key: row for key, row in RIGHT.items() if key not in lost}, [])
    assert (tmp_path / "rows.damaged-1.db").is_file()


def test_a_row_under_the_key_of_another_is_lost(whole, tmp_path):
    path = tmp_path / "rows.db"
    path.write_bytes(whole)
    first, second = sorted(RIGHT)[:2]
    altered(path, "DELETE FROM rows WHERE key = ?", first)
    altered(path, "UPDATE rows SET key = ? WHERE key = ?", first, second)
    rows, said = opened(path)
    assert (len(said), set(RIGHT) - set(rows)) == (1, {first, second})


def test_damaged_files_that_are_put_aside_do_not_overwrite_each_other(whole, tmp_path):
    path = tmp_path / "rows.db"
    for number in (1, 2):
        path.write_bytes(whole[: len(whole) // 2])
        assert f"the damaged file is rows.damaged-{number}.db." in opened(path)[1][0]

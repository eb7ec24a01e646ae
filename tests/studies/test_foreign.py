"""What others' files name is not run without trust, and whatever their fields say is one sentence: archives, stores and checkpoints."""

import copy
import hashlib
import io
import json
import random
import shutil
import sqlite3
import subprocess
import sys
from contextlib import closing

import contestants
import forged
import numpy as np
import pytest
from forged import require_sentence
from own_files import RING
from refusals import refused, require_refusals
from uncompiled import Uncompiled

import daebench as package
from daebench.methods.foreign import ForeignName, Trust, admit, is_own_method
from daebench.methods.names import CONSTRAINED, POISSON
from daebench.methods.outside.read import content_of, method_from
from daebench.records import rows as stored_rows
from daebench.records.code import code_of, put
from daebench.records.seals import digests
from daebench.records.store import opened
from daebench.studies.certificate.make import make
from daebench.studies.certificate.record import write
from daebench.studies.grid.archive import write_archive
from daebench.studies.grid.run_specification import ivp_of
from daebench.studies.grid.specification import specification_of
from daebench.studies.grid.study import Study
from daebench.studies.long.checkpoint import LAYOUT

SEED = 45
SHORT, WHOLE = 60, 2500
"""Forged files of a quick test, and of a slow one."""


@pytest.fixture(scope="module")
def study(tmp_path_factory):
    """Make a folder with a store of two runs of a problem of daebench, and its archive."""
    folder = tmp_path_factory.mktemp("study")
    with pytest.MonkeyPatch.context() as patch, opened(folder / "s.db") as store:
        patch.chdir(folder)
        patch.setattr("daebench.methods.names.FixedStep", Uncompiled)
        pendulum = {"problem": "planar_pendulum", "cases": ["rotating"], "metrics": ("q", "energy")}
        Study(**pendulum, methods=["rattle"], values={"h": [1 / 8, 1 / 16]}, t_end=2.0).table(store)
        write_archive(store, folder / "s.zip")
    return folder


@pytest.fixture
def here(study, tmp_path, monkeypatch, uncompiled_schemes):
    """Return a folder to work in, with copies of the store and of the archive."""
    for name in ("s.db", "s.zip"):
        shutil.copy(study / name, tmp_path)
    monkeypatch.chdir(tmp_path)
    ivp_of.cache_clear()
    return tmp_path


# ---- whatever a field says ------------------------------------------------------------------------------------------------------


def forgeries(files, count):
    """Give pairs of a place in one of some nested values and a name of what is put there, drawn from all of them; None is nothing."""
    everything = [(k, place, name) for k, value in enumerate(files) for place in forged.places_of(value) for name in [*forged.ABSURD, None]]
    yield from random.Random(SEED).sample(everything, min(count, len(everything)))


@pytest.mark.parametrize("count", [SHORT, pytest.param(WHOLE, marks=pytest.mark.exhaustive)], ids=["some", "many"])
def test_whatever_a_field_of_an_archive_says_is_a_sentence(here, daebench, count):
    manifest, files = forged.unpack(here / "s.zip")
    first, *others = files["rows.jsonl"].decode().splitlines()
    refused = 0
    for which, place, name in forgeries([json.loads(first), manifest], count):
        text = forged.ABSURD.get(name)
        line = forged.altered(json.loads(first), place, text) if which == 0 else first
        changed = forged.altered(manifest, place, text) if which == 1 else json.dumps(manifest)
        forged.pack(here / "f.zip", files | {"rows.jsonl": "\n".join([line, *others]).encode()}, changed)
        status, out, err = daebench("reproduce", "f.zip")
        require_sentence(status, out, err, (place, name))
        refused += status == 2
        assert status != 0 or says_the_same(manifest, changed) or holds(json.loads(first), json.loads(line), place, out), (place, name)
    assert refused > count / 2


EXTRAS = ("heyoka", "solve_dae")
"""Packages that need not be installed."""


def says_the_same(manifest, changed):
    """Return whether an altered manifest says the same, or less of packages that need not be installed; an unaltered one does not."""
    one, other = manifest, json.loads(changed)
    versions = {name: value for name, value in one["versions"].items() if name in other["versions"] or name not in EXTRAS}
    return changed != json.dumps(manifest) and {**one, "versions": versions} == other


def holds(one, other, place, out):
    """Return whether an altered line is of the same run and row, but for how long it took, or its difference is small and said."""
    same_run = specification_of(one["cell"]) == specification_of(other["cell"])
    row, other_row = (json.dumps(json.loads(json.dumps(line["row"]), parse_int=float)) for line in (one, other))  # true is not 1
    said = (
        "within tolerances: 1 runs" in out and f": {place[-1]} = " in out and abs(one["row"][place[-1]] - other["row"][place[-1]]) <= 1e-12
    )
    return same_run and one["key"] == other["key"] and one["maker"] == other["maker"] and (row == other_row or said)


def first_row(path):
    """Return key, cell, row, maker and time of the first row of a store."""
    with closing(sqlite3.connect(path)) as base:
        return base.execute("SELECT * FROM rows ORDER BY key").fetchone()[:5]


def forge_store(path, cell=None, row=None):
    """Rewrite the first row of a store, with a digest that fits."""
    key, *texts, maker, took = first_row(path)
    new = (key, cell or texts[0], row or texts[1], maker, took)
    with closing(sqlite3.connect(path)) as base, base:
        base.execute("UPDATE rows SET cell = ?, row = ?, digest = ? WHERE key = ?", (*new[1:3], stored_rows.digest_of(*new), key))


@pytest.mark.parametrize("count", [SHORT // 2, pytest.param(WHOLE // 2, marks=pytest.mark.exhaustive)], ids=["some", "many"])
def test_whatever_a_field_of_a_store_says_is_a_sentence(here, study, daebench, count):
    _, *texts, _, _ = first_row(here / "s.db")
    for k, (which, place, name) in enumerate(forgeries([*map(json.loads, texts)], count)):
        shutil.copy(study / "s.db", here / "f.db")
        text = forged.altered(json.loads(texts[which]), place, forged.ABSURD.get(name))
        forge_store(here / "f.db", **{["cell", "row"][which]: text})
        words = ("export", "f.db", "f.csv") if k % 4 else ("archive", "f.db", "--out", "f.zip")
        require_sentence(*daebench(*words), (words, place, name))
        for path in here.glob("f.*"):
            path.unlink()


def test_an_archive_is_made_of_errors_that_no_scale_of_powers_has(here, daebench):
    forge_store(here / "s.db", row=forged.altered(json.loads(first_row(here / "s.db")[2]), ("error_q",), "5e-324"))
    status, out, err = daebench("archive", "s.db", "--out", "f.zip")
    require_sentence(status, out, err, "")
    assert out.startswith("written: f.zip, 2 runs")


@pytest.fixture(scope="module")
def long_run(tmp_path_factory):
    """Make a folder with the checkpoint of a long run, and return the words that make it."""
    folder = tmp_path_factory.mktemp("long")
    return folder, ("long", "planar_pendulum", "--case", "rotating", "--methods", "rattle", "--h", "0.01", "--out", str(folder))


def forge_checkpoint(path, about=None, **arrays):
    """Rewrite a checkpoint, with a seal that fits."""
    with np.load(path) as old:
        content = dict(old) | arrays
    content["about"] = content["about"] if about is None else np.array(about)
    written = io.BytesIO()
    np.savez(written, **content)
    path.write_bytes(written.getvalue() + hashlib.sha256(written.getvalue()).digest())


def test_whatever_a_field_of_a_checkpoint_says_is_a_sentence(long_run, daebench):
    folder, words = long_run
    status, _, err = daebench(*words, "--steps", "200")
    assert (status, err) == (0, "")
    (path,) = folder.rglob("*.npz")
    whole = path.read_bytes()
    with np.load(path) as old:
        about, arrays = json.loads(str(old["about"])), {name: old[name] for name in old if name != "about"}
    again = (*words, "--steps", "400")
    for _, place, name in forgeries([about], 4):
        path.write_bytes(whole)
        forge_checkpoint(path, forged.altered(about, place, forged.ABSURD.get(name)))
        require_sentence(*daebench(*again), (place, name))
    for k, (name, array) in enumerate(arrays.items()):
        change = (array[..., None], np.full(array.shape, np.nan), array.astype("U8"))[k % 3]
        path.write_bytes(whole)
        forge_checkpoint(path, **{name: change})
        require_sentence(*daebench(*again), (name, change.shape, change.dtype))
    assert about["layout"] == LAYOUT


# ---- what a file names is not run -----------------------------------------------------------------------------------------------

EVIL_PY = """
from pathlib import Path
Path({marker!r}).touch()
def step(p, q, h):
    return p, q
def problem(*, mass: float = 1.0) -> "ConstrainedHamiltonian":
    return None
"""
EVIL_C = """
#include <stdio.h>
__attribute__((constructor)) static void begin(void) {{ FILE *f = fopen("{marker}", "w"); if (f) fclose(f); }}
int step(double *p, double *q, double h) {{ return 0; }}
"""


@pytest.fixture
def planted(here):
    """Plant code of each kind that writes a marker when it is run; return the marker, and names that lead to the code."""
    marker = here / "pwned"
    (here / "evil.py").write_text(EVIL_PY.format(marker=str(marker)))
    (here / "lifted:.").mkdir()
    shutil.copy(here / "evil.py", here / "lifted:." / "evil.py")
    (here / "evil.sh").write_text(f"#!/bin/sh\ntouch {marker}\n")
    (here / "evil.sh").chmod(0o755)
    names = ["./evil.py:step", f"{here}/evil.py:step", "evil.py:step", "./evil.py", f"{here}/evil.py", "lifted:./evil.py:step"]
    names += [f"exec:{here}/evil.sh", "exec:./evil.sh", f"exec:touch {marker}", f"exec:/bin/sh -c 'touch {marker}'", "exec:sh ./evil.sh"]
    names += ["lifted:exec:./evil.sh", f"lifted:exec:touch {marker}", "rattle+exec:./evil.sh", "code/1/evil.py:step"]
    names += ["./code/1/../../evil.py:step"]
    if compiler := shutil.which("cc"):
        (here / "evil.c").write_text(EVIL_C.format(marker=marker))
        subprocess.run([compiler, "-shared", "-fPIC", "-o", "evil.so", "evil.c"], cwd=here, check=True)
        names += ["./evil.so:step", f"{here}/evil.so:step"]
    return marker, names


def test_the_planted_code_writes_its_marker_when_it_is_run(planted, daebench):
    marker, names = planted
    for name in ("./evil.py:step", f"exec:touch {marker}", *[name for name in names if name.startswith("./evil.so")]):
        daebench("run", "planar_pendulum", "--method", name, "--h", "0.1", "--steps", "1")
        assert marker.exists(), name
        marker.unlink()


@pytest.fixture
def require_nothing_run(planted, daebench):
    """Run a command, require that it ends as it may and that no planted code was run, and return its status."""
    marker, _ = planted

    def require(*words):
        answer = daebench(*words)
        require_sentence(*answer, words)
        assert not marker.exists(), words
        return answer[0]

    return require


def some_of(names, field, k, whole):
    """Return half of the names where code is named, a sixth in the other fields, or all."""
    step = 1 if whole else 2 if field in ("problem", "method") else 6
    return names[k % step :: step]


some_or_all = pytest.mark.parametrize("whole", [False, pytest.param(True, marks=pytest.mark.exhaustive)], ids=["some", "all"])


@some_or_all
def test_nothing_that_an_archive_names_is_run(here, planted, require_nothing_run, whole):
    manifest, files = forged.unpack(here / "s.zip")
    first, *others = map(json.loads, files["rows.jsonl"].decode().splitlines())
    fields = [("cell", name) for name, value in first["cell"].items() if isinstance(value, str | list)]
    for k, (group, field) in enumerate([*fields, ("row", "problem"), ("row", "method")]):
        for n, name in enumerate(some_of(planted[1], field, k, whole)):
            value = [[name, 1.0]] if field in ("parameters", "options") else [name] if field == "metrics" else name
            row = copy.deepcopy(first)
            for part in {group, "row"} if field in ("problem", "method") else {group}:
                row[part][field] = value
            lines = "\n".join(map(json.dumps, [row, *others])).encode()
            for own in ([], [name]) if whole else ([name] if n % 2 else [],):
                forged.pack(here / "f.zip", files | {"rows.jsonl": lines}, json.dumps(manifest | {"own": own, "executable": [name]}))
                status = require_nothing_run("reproduce", "f.zip")
                assert status == 2 or field in ("case", "options", "parameters"), (field, name)


@some_or_all
def test_nothing_that_a_store_names_is_run(here, planted, study, require_nothing_run, whole):
    cell = json.loads(first_row(here / "s.db")[1])
    for k, field in enumerate(("problem", "method", "case", "precision", "on_singular")):
        for name in some_of(planted[1], field, k, whole):
            shutil.copy(study / "s.db", here / "f.db")
            forge_store(here / "f.db", cell=json.dumps(cell | {field: name}))
            require_nothing_run("export", "f.db", "g.csv")
            require_nothing_run("archive", "f.db", "--out", "g.zip")


def test_code_beside_a_certificate_is_run_if_it_is_trusted_or_named(here, planted, daebench, monkeypatch):
    marker, _ = planted
    contestants.measure_briefly(monkeypatch)
    code = code_of("./evil.py:step")
    put(code.files, here / "code")
    made = make("rattle", problems=["planar_pendulum:rotating"])
    whole = {"hash": code.digest, "files": digests(code.files), "executable": []}
    write(here, made.content | {"method": code.method, "code": whole})
    (here / "other.py").write_text("other")
    for words in ((), ("--code", "other.py")):
        daebench("certificate", "verify", str(here), *words)
        assert (daebench.error.code, marker.exists()) == ("code-not-trusted", False)
    for words in (("--trust",), ("--code", "evil.py")):
        status, _, err = daebench("certificate", "verify", str(here), *words)
        assert (status, marker.exists()) == (1, True), err
        marker.unlink()
        for name in [name for name in sys.modules if name.startswith("daebench_method_evil")]:
            del sys.modules[name]  # or else it is not executed again


def test_a_trajectory_file_runs_no_problem_that_it_names(here, planted):
    marker, _ = planted
    run = package.run("planar_pendulum", case="rotating", method="rattle", h=0.1, steps=3)
    run.save(here / "run.npz")
    with np.load(here / "run.npz") as old:
        arrays = dict(old)
    about = json.loads(str(arrays["about"])) | {"problem": "./evil.py"}
    np.savez(here / "run.npz", **arrays | {"about": np.array(json.dumps(about))})
    assert package.load(here / "run.npz").ivp is None
    assert not marker.exists()


# ---- the gate -------------------------------------------------------------------------------------------------------------------


def test_every_method_of_daebench_passes_and_nothing_else(planted):
    _, names = planted
    listed = {method.name for kind in (CONSTRAINED, POISSON) for method in kind.listed()}
    more = ["rattle/kahan_li8+proj", "cvode:bdf:projected", "ida:index1:suppress", "strang@12/suzuki4", "lifted:rattle", "local:rk4"]
    assert all(is_own_method(name) for name in [*listed, *more])
    assert not any(is_own_method(name) for name in names)
    for name in [*names, "", " rattle", "rattle\n", "exec", "a/exec:b", "exec:rattle"]:
        with refused("code-lacks-runs"):
            admit("FILE", [ForeignName(name, is_method=True)], Trust(everything=True))


def test_files_with_a_name_of_daebench_or_with_one_of_several_entries_are_not_trusted_by_another():
    trusted, other = "a" * 64, "b" * 64
    trust = Trust(digests=frozenset({trusted}))
    mine = ForeignName("./mine.py:step", True, {"mine.py": trusted})
    admit("here", [mine, ForeignName("planar_pendulum", False)], trust)
    with refused("code-not-trusted", says=("planar_pendulum",)):
        admit("here", [mine, ForeignName("planar_pendulum", False, {"helper.py": other})], trust)
    twice = [ForeignName("./x.py", False, {"x.py": trusted, "helper.py": other}), ForeignName("./x.py", False, {"x.py": trusted})]
    with refused("code-not-trusted"):
        admit("here", twice, trust)


def test_a_program_is_not_trusted_by_a_file_that_it_is_given(here):
    files = {"code/1/x": "0" * 64}
    trust = Trust(digests=frozenset(files.values()))
    admit("FILE", [ForeignName("exec:./code/1/x", True, files)], trust)
    with refused("code-not-trusted"):
        admit("FILE", [ForeignName("exec:sh -c 'rm -rf /' ./code/1/x", True, files, whole=False)], trust)


def test_the_digest_of_code_is_that_of_its_method_and_executes_nothing(planted):
    marker, names = planted
    for name in ("./evil.py:step", "exec:./evil.sh", *[name for name in names if name.startswith("./evil.so")]):
        digest = content_of(name)
        assert not marker.exists()
        assert digest == method_from(name).content
        marker.unlink(missing_ok=True)


# ---- an archive of a study with code of one's own ---------------------------------------------------------------------------------

SAME = "from beside import scale\ndef same(p, q, h):\n    return scale * p, scale * q\n"
PROGRAM = f"""#!{sys.executable}
import json, sys
asked = json.loads(sys.stdin.readline())
for _ in range(asked["steps"] // (asked["every"] or asked["steps"])):
    print(*asked["p"], *asked["q"])
print(json.dumps({{"seconds": 0.0}}))
"""


def test_an_archive_has_the_code_of_its_methods_and_is_reproduced_elsewhere(here, daebench, monkeypatch):
    for name, text in {"m.py": SAME, "beside.py": "scale = 1.0\n", "program": PROGRAM, "ring.py": RING}.items():
        (here / name).write_text(text)
        (here / name).chmod(0o755)
    with opened(here / "o.db") as store:
        for problem in ("planar_pendulum", "./ring.py"):
            codes = ["./m.py:same", "exec:./program"]
            Study(problem=problem, methods=codes, values={"h": [0.1]}, metrics=("energy",), t_end=1.0).table(store)
    assert daebench("archive", "o.db", "--out", "o.zip")[::2] == (0, "")
    manifest, files = forged.unpack(here / "o.zip")
    assert {"code/1/m.py", "code/1/beside.py", "code/2/program"} <= set(files)
    assert manifest["without"] == {}
    (here / "elsewhere").mkdir()
    monkeypatch.chdir(here / "elsewhere")
    ivp_of.cache_clear()
    require_refusals(daebench, ["reproduce", "../o.zip"], ("code-not-trusted", ""))
    named = [word for file in ("m.py", "beside.py", "program", "ring.py") for word in ("--code", f"../{file}")]
    status, out, err = daebench("reproduce", "../o.zip", *named)
    assert (status, err) == (0, "")
    assert "equal to the bit: 4 of 4 runs.\n" in out
    (here / "m.py").write_text(SAME + "# read by nobody\n")
    require_refusals(daebench, ["reproduce", "../o.zip", *named], ("code-not-trusted", ""))


def test_an_archive_without_the_code_of_a_method_says_so(here, daebench):
    (here / "line.py").write_text(PROGRAM.partition("\n")[2])
    method = f"exec:{sys.executable} -c \"exec(open('line.py').read())\""
    with opened(here / "o.db") as store:
        Study(problem="planar_pendulum", methods=[method, "rattle"], values={"h": [0.1]}, metrics=("energy",), t_end=1.0).table(store)
    status, out, err = daebench("archive", "o.db", "--out", "o.zip")
    assert (status, err) == (0, "")
    assert "2 runs, without the code of exec:" in out
    assert b"Not in it: the code of exec:" in forged.unpack(here / "o.zip")[1]["README.txt"]
    require_refusals(daebench, ["reproduce", "o.zip"], ("code-lacks-runs", "--trust"))


WITHOUT = {
    "no runs": ("archive-without-runs", lambda rows: []),
    "no numbers": ("archive-row-faulty", lambda rows: [row | {"row": {"problem": row["row"]["problem"]}} for row in rows]),
    "no end": (
        "archive-too-many-steps",
        lambda rows: [row | {part: row[part] | {"value": 1e-12} for part in ("cell", "row")} for row in rows],
    ),
}


@pytest.mark.parametrize(("code", "change"), WITHOUT.values(), ids=WITHOUT)
def test_a_forged_archive_is_no_success_and_keeps_no_machine_busy(here, daebench, code, change):
    manifest, files = forged.unpack(here / "s.zip")
    rows = change([json.loads(line) for line in files["rows.jsonl"].decode().splitlines()])
    forged.pack(here / "f.zip", files | {"rows.jsonl": "\n".join(map(json.dumps, rows)).encode()}, json.dumps(manifest))
    require_refusals(daebench, ["reproduce"], (code, "f.zip"))

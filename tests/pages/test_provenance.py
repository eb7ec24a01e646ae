"""Files say how they were made: in words, in a text beside them, so that every reader of the file itself reads numbers alone."""

import hashlib
import json
import re

import numpy as np
import pandas as pd
from own_files import RING

from daebench.runs.provenance import versions

RUN = "run planar_pendulum --case rotating --method rattle --h 0.1 --t-end 1 --param mass=2"
OWN = "run ring.py --case turning --method rattle --h 0.1 --t-end 1"
EXPORT = "reference export planar_pendulum-rotating"
COMMANDS = {
    "run.csv": f"{RUN} --raw",
    "run.npz": RUN,
    "own.csv": OWN,
    "poisson.csv": "run lotka_volterra --case 6,2 --method strang --h 0.1 --t-end 1",
    "digits.csv": f"{EXPORT} --times 0,0.5",
    "digits.json": f"{EXPORT} --format json",
}
"""Commands that export files, by the files that they write; the first writes run.raw.csv too."""


def beside(path):
    return path.with_name(f"{path.name}.txt").read_text(encoding="utf-8")


def require_words(made):
    """Require that beside every file there is how it was made."""
    for name in (*COMMANDS, "run.raw.csv"):
        text = beside(made / name)
        assert re.match(rf"{re.escape(name)} was made by daebench {re.escape(versions()['daebench'])} on 20\d\d-", text)
        assert [package for package in ("Python", "numpy", "llvmlite") if f"{package} {versions()[package]}" not in text] == []
        assert f"SHA-256 of the file: {hashlib.sha256((made / name).read_bytes()).hexdigest()}\n" in text
        assert f"Command: daebench {COMMANDS.get(name, RUN)[:20]}" in text
    text = beside(made / "run.csv")
    for line in (
        "Problem: planar_pendulum, case rotating",
        "mass = 2.0, length = 1.0",
        "Start: p0 = (",
        "Method: rattle",
        "t_end = 1.0",
        "Machine: ",
    ):
        assert line in text
    assert "Start: y0 = (" in beside(made / "poisson.csv")


def require_numbers(made):
    """Require that readers of the files read numbers alone."""
    for name in ("run.csv", "own.csv", "poisson.csv", "digits.csv"):
        rows = (made / name).read_text().splitlines()
        assert rows[0].startswith("t,")
        assert pd.read_csv(made / name).map(np.isreal).all(axis=None)
        assert np.isfinite(np.genfromtxt(made / name, delimiter=",", skip_header=1)).all()
    with np.load(made / "run.npz") as stored:
        assert {"t", "q", "p", "about"} == set(stored)
    assert "columns" in json.loads((made / "digits.json").read_text())


def test_every_exported_file_is_numbers_alone_and_a_text_beside_it_says_how_it_was_made(folder, daebench, uncompiled_schemes):
    for name, words in COMMANDS.items():
        assert daebench(*words.split(), "--out", name)[0] == 0, words
    require_words(folder)
    require_numbers(folder)
    (folder / "ring.py").write_text(RING.replace("(3 * m, 0)", "(4 * m, 0)"))
    assert daebench(*OWN.split(), "--out", "other.csv")[0] == 0
    one, other = (re.search(r"Definition: SHA-256 ([0-9a-f]{64}) ", beside(folder / name))[1] for name in ("own.csv", "other.csv"))
    assert one != other

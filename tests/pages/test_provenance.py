"""Files say how they were made: in words, in a text beside them, so that every reader of the file itself reads numbers alone."""

import hashlib
import json
import re

import numpy as np
import pandas as pd
from own_files import RING

from daebench.runs.provenance import versions

RUN = ("run", "planar_pendulum", "--case", "rotating", "--method", "rattle", "--h", "0.1", "--t-end", "1", "--param", "mass=2")


def commands(tmp_path):
    """Return commands that export files, by the files that they write."""
    (tmp_path / "ring.py").write_text(RING)
    own = ("run", str(tmp_path / "ring.py"), "--case", "turning", "--method", "rattle", "--h", "0.1", "--t-end", "1")
    poisson = ("run", "lotka_volterra", "--case", "6,2", "--method", "strang", "--h", "0.1", "--t-end", "1")
    return {
        "run.csv": (*RUN, "--raw", "--out", tmp_path / "run.csv"),
        "run.raw.csv": (),
        "run.npz": (*RUN, "--out", tmp_path / "run.npz"),
        "own.csv": (*own, "--out", tmp_path / "own.csv"),
        "poisson.csv": (*poisson, "--out", tmp_path / "poisson.csv"),
        "digits.csv": ("reference", "export", "planar_pendulum-rotating", "--times", "0,0.5", "--out", tmp_path / "digits.csv"),
        "digits.json": ("reference", "export", "planar_pendulum-rotating", "--format", "json", "--out", tmp_path / "digits.json"),
    }


def beside(path):
    return path.with_name(f"{path.name}.txt").read_text(encoding="utf-8")


def require_words(made):
    """Require that beside every file there is how it was made."""
    for name, words in commands(made).items():
        text = beside(made / name)
        assert re.match(
            rf"{re.escape(name)} was made by daebench {re.escape(versions()['daebench'])} on 20\d\d-\d\d-\d\d \d\d:\d\d UTC\.\n", text
        )
        for package in ("Python", "numpy", "llvmlite"):
            assert f"{package} {versions()[package]}" in text
        assert "Machine: " in text
        assert f"SHA-256 of the file: {hashlib.sha256((made / name).read_bytes()).hexdigest()}\n" in text
        assert "Command: daebench " in text
        assert all(str(word) in text for word in words[:4]), name
    text = beside(made / "run.csv")
    assert "Problem: planar_pendulum, case rotating\n" in text
    assert "mass = 2.0, length = 1.0, gravity = 1.0\n" in text
    assert "Start: p0 = (" in text
    assert re.search(r"Definition: SHA-256 [0-9a-f]{64} of its equations and cases\n", text)
    assert "Method: rattle\n" in text
    assert "value of h or tol 0.1, t_end = 1.0, float64; 10 steps; to the end\n" in text
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


def test_every_exported_file_is_numbers_alone_and_a_text_beside_it_says_how_it_was_made(tmp_path, daebench, uncompiled_schemes):
    for words in commands(tmp_path).values():
        if words:
            assert daebench(*words)[0] == 0, words
    require_words(tmp_path)
    require_numbers(tmp_path)
    (tmp_path / "other").mkdir()
    (tmp_path / "other" / "ring.py").write_text(RING.replace("(3 * m, 0)", "(4 * m, 0)"))
    words = ("run", tmp_path / "other" / "ring.py", "--case", "turning", "--method", "rattle", "--h", "0.1", "--t-end", "1")
    assert daebench(*words, "--out", tmp_path / "other.csv")[0] == 0
    digests = [re.search("Definition: (.*)", beside(tmp_path / name))[1] for name in ("own.csv", "other.csv")]
    assert digests[0] != digests[1]

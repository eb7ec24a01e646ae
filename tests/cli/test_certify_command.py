"""``daebench certify``, ``certificate verify`` and ``report court`` as their users call them."""

import json
import os
import platform
import re
import shutil
import subprocess
import sys

import contestants
import pytest

CASE = ("--problem", contestants.PROBLEM, "--param", "mass=2", "--param", "gravity=3")


@pytest.fixture
def codes(tmp_path, monkeypatch):
    """A folder of codes to work in."""
    contestants.write_codes(tmp_path)
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.fixture
def brief(codes, monkeypatch):
    """Have codes be measured in this process, briefly."""
    contestants.measure_briefly(monkeypatch)
    return codes


def verified(folder, **environment):
    """Verify a certificate in a process of its own; return exit status, standard output and standard error.

    Lines of progress, which a slow machine prints and a fast one does not, are left out.
    """
    command = [sys.executable, "-m", "daebench.cli", "certificate", "verify", str(folder), "--trust"]
    ended = subprocess.run(command, capture_output=True, text=True, check=False, env=os.environ | environment)
    return ended.returncode, ended.stdout, re.sub(r"(?m)^daebench: .*: \d+ % after \d+ s\n", "", ended.stderr)


@pytest.mark.slow
def test_a_python_code_is_certified_and_verified_elsewhere(codes, daebench):
    status, out, err = daebench("certify", "./ball.py:step", *CASE, "--out", "made")
    assert (status, err) == (0, "")
    assert "./ball.py:step: 5 of 5 claims hold.\n" in out
    elsewhere = codes / "elsewhere"
    elsewhere.mkdir()
    shutil.move(codes / "made", elsewhere / "taken")
    for name in ("ball.py", "forces.py"):
        (codes / name).unlink()
    os.chdir(elsewhere)
    status, out, err = verified("taken")
    assert (status, err) == (0, "")
    assert "are equal to the bit, and 0 within rounding" in out
    text = (elsewhere / "taken" / "certificate.json").read_text()
    assert str(codes) not in text
    (elsewhere / "taken" / "code" / "forces.py").write_text(contestants.FORCES.replace("3.0", "3.0000001"))
    status, out, err = verified("taken/certificate.json")
    assert (status, out) == (1, "")
    assert err.count("\n") == 1
    assert "the SHA-256 of forces.py is" in err


@pytest.mark.slow
@pytest.mark.exhaustive
def test_a_method_of_daebench_is_certified_by_the_hash_of_the_package(codes, daebench):
    status, out, err = daebench("certify", "rattle", "--problem", "planar_pendulum:rotating", "--out", "made", "--json")
    assert (status, err) == (0, "")
    certificate = json.loads(out)
    assert certificate["code"]["files"] == {}
    assert certificate["holds"] == ["order", "symmetric", "symplectic", "keeps g", "keeps G H_p"]
    assert verified("made")[0] == 0
    processor = {"OPENBLAS_CORETYPE": "Prescott"}  # rounds elsewhere: it has no FMA
    status, out, _ = verified("made", DAEBENCH_CACHE=str(codes / "cache"), **processor)
    assert status == 0
    assert "and 0 within rounding" not in out or platform.machine() not in ("x86_64", "AMD64")


@pytest.mark.slow
@pytest.mark.exhaustive
def test_a_problem_file_goes_with_the_certificate(folder, daebench):
    status, _, err = daebench("certify", "rattle", "--problem", "./ring.py:turning", "--out", "made")
    assert (status, err) == (0, "")
    (folder / "ring.py").unlink()
    assert verified("made")[0] == 0
    problem = next((folder / "made" / "definitions").rglob("ring.py"))
    problem.write_text(problem.read_text() + "\n")
    assert "ring.py is" in verified("made")[2]


@pytest.mark.slow
def test_a_certificate_replaces_another_one_and_nothing_else(brief, daebench):
    (brief / "full").mkdir()
    (brief / "full" / "letter.txt").write_text("")
    status, out, err = daebench("certify", "./ball.py:step", *CASE, "--out", "full")
    assert (status, out) == (2, "")
    assert "the folder is not empty and has no certificate to replace" in err
    assert [path.name for path in (brief / "full").iterdir()] == ["letter.txt"]
    for name in ("step", "shake"):
        status, out, err = daebench("certify", f"./ball.py:{name}", *CASE, "--out", "made")
        assert (status, err) == (0, "")
    assert json.loads((brief / "made" / "certificate.json").read_text())["method"] == "./ball.py:shake"
    page = (brief / "made" / "index.html").read_text()
    assert "false:" in page
    assert "<code>symmetric</code>" in page
    assert "daebench certificate verify certificate.json" in page
    assert json.loads((brief / "made" / "certificate.json").read_text())["code"]["hash"] in page


def test_what_is_no_certificate_ends_with_1_in_words_and_as_json(codes, daebench):
    (codes / "certificate.json").write_text("{}")
    status, out, err = daebench("certificate", "verify", "certificate.json")
    assert (status, out) == (1, "")
    assert err == "daebench: certificate.json is not a certificate of daebench.\n"
    status, out, err = daebench("certificate", "verify", ".", "--json")
    assert (status, err) == (1, "")
    answer = json.loads(out)
    assert (answer["agrees"], answer["sentence"]) == (False, "certificate.json is not a certificate of daebench.")


def test_help_says_that_code_is_executed(daebench):
    for words in (("certify", "--help"), ("certificate", "verify", "--help"), ("report", "--help")):
        assert "execute" in daebench(*words)[1].lower()

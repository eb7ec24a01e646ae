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
    assert daebench("certify", "./ball.py:step", *CASE, "--out", "made")[::2] == (0, "")
    elsewhere = codes / "elsewhere"
    elsewhere.mkdir()
    shutil.move(codes / "made", elsewhere / "taken")
    for name in ("ball.py", "forces.py"):
        (codes / name).unlink()
    os.chdir(elsewhere)
    status, out, err = verified("taken")
    assert (status, err, "equal to the bit, and 0 within rounding" in out) == (0, "", True)
    assert str(codes) not in (elsewhere / "taken" / "certificate.json").read_text()
    (elsewhere / "taken" / "code" / "forces.py").write_text(contestants.FORCES.replace("3.0", "3.0000001"))
    status, out, err = verified("taken/certificate.json")
    assert (status, out, err.count("\n"), "SHA-256 of forces.py" in err) == (1, "", 1, True)


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
def test_a_certificate_replaces_another_one(brief, daebench):
    for name in ("step", "shake"):
        assert daebench("certify", f"./ball.py:{name}", *CASE, "--out", "made")[::2] == (0, "")
    certificate, page = json.loads((brief / "made" / "certificate.json").read_text()), (brief / "made" / "index.html").read_text()
    assert certificate["method"] == "./ball.py:shake"
    assert [words for words in ("false:", "<code>symmetric</code>", certificate["code"]["hash"]) if words not in page] == []


def test_what_is_no_certificate_ends_with_1_in_words_and_as_json(codes, daebench):
    (codes / "certificate.json").write_text("{}")
    status, out, err = daebench("certificate", "verify", "certificate.json")
    assert (status, out, err.count("\n")) == (1, "", 1)
    status, out, _ = daebench("certificate", "verify", ".", "--json")
    answer = json.loads(out)
    assert (status, answer["agrees"], f"daebench: {answer['sentence']}\n") == (1, False, err)

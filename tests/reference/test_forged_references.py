"""References with a field altered absurdly and checksums made anew: each command on them ends in a sentence, and runs nothing."""

import json
import random

import forged
import pytest
from refusals import refused

from daebench.reference.check import verify as verification
from daebench.reference.check.verify import verify
from daebench.reference.keep import form, store

SEED = 45
FEW, MANY = 40, 1500
NAME, POISSON = "planar_pendulum-rotating", "lotka_volterra_3d-blow_up"
METHODS = {NAME: "rattle", POISSON: "midpoint"}


@pytest.fixture(params=[NAME, POISSON], ids=["constrained", "poisson"])
def forge(request, tmp_path, monkeypatch, uncompiled_schemes):
    """Give a reference in the place of those of daebench: its folder, certificate and digits; it is not recomputed."""
    place = forged.cut_reference(request.param, tmp_path / "references")
    certificate, digits = json.loads((place / "certificate.json").read_text()), (place / f"{place.name}.csv").read_bytes()
    monkeypatch.setattr(form, "DATA", place.parent)
    monkeypatch.chdir(tmp_path)
    for name in ("throughout", "row_by_row", "by_ida"):
        monkeypatch.setattr(verification, name, lambda reference: (None, []))
    (tmp_path / "mine.csv").write_bytes(digits)
    return place, certificate, digits


def commands(name):
    """Return the commands that read a reference."""
    problem, case = name.split("-", 1)
    where, run = (problem, "--case", case), ("--h", "0.125", "--t-end", "1")
    return [
        ("reference", "show", name),
        ("reference", "list"),
        ("reference", "at", *where, "--t", "0.5"),
        ("reference", "at", *where, "--t", "0.53"),
        ("reference", "verify", name),
        ("reference", "verify"),
        ("reference", "export", name, "--out", "out.csv", "--overwrite"),
        ("reference", "compare", "mine.csv", "--with", name),
        ("compare", *where, "--methods", METHODS[name], *run),
    ]


@pytest.mark.parametrize("count", [FEW, pytest.param(MANY, marks=pytest.mark.exhaustive)], ids=["some", "many"])
def test_whatever_a_field_of_a_certificate_says_is_a_sentence(forge, daebench, count):
    place, certificate, digits = forge
    everything = [(where, name) for where in forged.places_of(certificate) for name in [*forged.ABSURD, None]]
    drawn = random.Random(SEED)
    for where, name in drawn.sample(everything, min(count, len(everything))):
        forged.forge_reference(place, forged.altered(certificate, where, forged.ABSURD.get(name)), digits)
        words = drawn.choice(commands(place.name))
        forged.require_sentence(*daebench(*words), (words, where, name))


CELLS = ["", "nan", "inf", "-1e300", "1e400", "x", "9" * 400, "1_0", "0x10", "\u0661", "-5", '"', "1,2"]


def test_whatever_a_digit_or_a_column_is_is_a_sentence(forge, daebench):
    place, certificate, digits = forge
    header, *rows = digits.decode().splitlines()
    drawn = random.Random(SEED)
    heads = ["", "t", "t,t", f"{header},q9", header.replace("1", "0"), header.replace("t,", ""), ",".join(reversed(header.split(",")))]
    texts = ["\n".join([head, *rows]) for head in heads] + ["", header, "\n".join([header, *rows[::-1]])]
    for cell in CELLS:
        k = drawn.randrange(len(rows))
        cells = rows[k].split(",")
        cells[drawn.randrange(len(cells))] = cell
        texts.append("\n".join([header, *rows[:k], ",".join(cells), *rows[k + 1 :]]))
    for text in texts:
        forged.forge_reference(place, json.dumps(certificate), text.encode())
        for words in drawn.sample(commands(place.name), 3):
            forged.require_sentence(*daebench(*words), (words, text[:80]))


def test_a_problem_that_a_certificate_names_is_not_run(forge, daebench, tmp_path):
    place, certificate, digits = forge
    marker = tmp_path / "pwned"
    problem = 'def problem(*, mass: float = 1.0) -> "ConstrainedHamiltonian":\n    return None\n'
    (tmp_path / "evil.py").write_text(f"from pathlib import Path\nPath({str(marker)!r}).touch()\n{problem}")
    for name in ("./evil.py", "evil", "exec:./evil.py"):
        for changes in ({"problem": name}, {"case": name}):
            forged.forge_reference(place, json.dumps(certificate | changes), digits)
            for words in commands(place.name):
                forged.require_sentence(*daebench(*words), (words, changes))
                assert not marker.exists(), (words, changes)


def test_a_problem_of_another_package_is_verified_if_it_is_asked_for(forge, monkeypatch):
    place, certificate, digits = forge
    monkeypatch.setattr("daebench.methods.foreign.own_problems", frozenset)
    unasked, asked = ([check.what for check in verify(place.name, **how).checks if not check.ok] for how in ({"asked": False}, {}))
    assert "certificate" in {*unasked} - {*asked}
    with refused("reference-name-malformed"):
        verify("./evil")
    forged.forge_reference(place, forged.altered(certificate, ("bound", "rule"), "3"), digits)
    with refused("not-a-reference", store.Misshapen, says=("bound.rule",)):
        store.load(place.name)

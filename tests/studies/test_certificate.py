"""Certificates: what they say of right codes and wrong ones, and that nobody who changes one is believed."""

import copy
import json
import math
import random
import shutil

import contestants
import forged
import numpy as np
import pytest
from refusals import refused

import daebench as package
from daebench.errors import BadInput, DaebenchError, RunFailed
from daebench.records.code import Code, code_of, put
from daebench.records.comparison import DIFFERS, EQUAL, WITHIN, compare
from daebench.records.seals import checksum
from daebench.studies.certificate import process
from daebench.studies.certificate.make import make
from daebench.studies.certificate.record import FORMAT, NAME, write
from daebench.studies.certificate.rounding import RELATIVE, allowance
from daebench.studies.certificate.verify import Unverified, verify_certificate
from daebench.studies.orders import bench as runs


def certified(folder, method, **settings):
    """Write a certificate of a code in a folder, without its page; return where it is."""
    made = make(method, **settings)
    out = folder / "certificate"
    (out / "code").mkdir(parents=True)
    made.code.put(out / "code")
    put(made.files, out)
    write(out, made.content)
    return out


@pytest.fixture
def codes(tmp_path, monkeypatch):
    """A folder of codes to work in, measured in this process."""
    contestants.write_codes(tmp_path)
    contestants.measure_briefly(monkeypatch)
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """Make a certificate once, and return its folder with the answers that a process gave."""
    folder = tmp_path_factory.mktemp("codes")
    contestants.write_codes(folder)
    answers = []
    with pytest.MonkeyPatch.context() as patch:
        contestants.measure_briefly(patch)
        patch.chdir(folder)
        patch.setattr(process, "measured", lambda *given: answers.append(contestants.in_this_process(*given)) or answers[-1])
        made = certified(
            folder, "./ball.py:step", problems=[contestants.PROBLEM, "planar_pendulum:rotating"], parameters=contestants.PARAMETERS
        )
    return made, answers[0]


@pytest.fixture
def certificate(whole, tmp_path, monkeypatch):
    """Return a copy of that certificate, to be altered; what is measured again is what was measured."""
    monkeypatch.setattr(process, "measured", lambda tasks, *_: copy.deepcopy(whole[1][: len(tasks)]))
    return shutil.copytree(whole[0], tmp_path / "certificate")


@pytest.fixture
def patient(codes, monkeypatch):
    """Have orders be measured as long as they are."""
    monkeypatch.setattr(runs, "SLOW", 1.0)


def rewritten(folder, change):
    """Change the content of a certificate, and have its checksum fit."""
    content = json.loads((folder / NAME).read_text())
    change(content)
    content["checksum"] = checksum(content)
    (folder / NAME).write_text(json.dumps(content))


# ---- right codes and wrong ones ------------------------------------------------------------------------------------------------

WRONG = {
    "step": set(),
    "shake": {"order", "symmetric", "keeps G H_p"},
    "projected": {"order", "symmetric", "symplectic"},
}


@pytest.mark.slow
@pytest.mark.sampled(by=lambda case: case == "projected")
@pytest.mark.parametrize("mistake", WRONG)
def test_the_claims_that_a_mistake_breaks_are_the_ones_that_do_not_hold(codes, patient, mistake):
    made = make(f"./ball.py:{mistake}", problems=[contestants.PROBLEM], parameters=contestants.PARAMETERS)
    assert set(made.content["falls_short"]) == WRONG[mistake]
    assert set(made.content["holds"]) == {"order", "symmetric", "symplectic", "keeps g", "keeps G H_p"} - WRONG[mistake]
    assert made.content["undetermined"] == []


@pytest.mark.exhaustive
def test_a_poisson_step_is_certified_on_poisson_problems(codes, patient):
    made = make("./rigid.py:step")
    assert [problem["problem"] for problem in made.content["problems"]] == ["free_rigid_body", "lotka_volterra", "heavy_top_lie_poisson"]
    assert [problem["problem"] for problem in made.content["problems"] if "refused" in problem] == [
        "lotka_volterra",
        "heavy_top_lie_poisson",
    ]
    assert (made.content["holds"], made.content["falls_short"]) == (["order", "symmetric", "Poisson map"], [])
    wrong = make("./rigid.py:euler", problems=["free_rigid_body:hlw"])
    assert set(wrong.content["falls_short"]) == {"order", "symmetric", "Poisson map"}


@pytest.mark.exhaustive
def test_a_code_for_another_problem_is_refused_where_it_was_guessed_and_of_none_that_claims_nothing_is_anything_told(codes):
    with pytest.raises(
        DaebenchError, match=r"does not converge to the motion of spherical_pendulum.*Name the problem that the code is for"
    ):
        make("./ball.py:step")
    silent = make("./ball.py:rattle", problems=["spherical_pendulum:fig1.2"])
    assert [silent.content[name] for name in ("holds", "falls_short", "undetermined")] == [[], [], []]
    assert "the errors do not fall" in silent.content["problems"][0]["numbers"]["claims"]["order"]["note"]


@pytest.mark.slow
def test_a_code_for_another_problem_falls_short_where_that_was_named(codes):
    named = make("./ball.py:step", problems=["spherical_pendulum:fig1.2"])
    assert "order" in named.content["falls_short"]
    assert "the errors do not fall" in named.content["problems"][0]["numbers"]["claims"]["order"]["note"]


@pytest.mark.slow
def test_the_numbers_are_those_of_a_run(codes):
    made = make("./ball.py:step", problems=[contestants.PROBLEM], parameters=contestants.PARAMETERS, h=0.01)
    (problem,) = made.content["problems"]
    setting, numbers = problem["setting"], problem["numbers"]
    given = {"case": "fig1.1", "method": "./ball.py:step", "h": 0.01, "parameters": contestants.PARAMETERS}
    run = package.run("spherical_pendulum", steps=setting["steps"], every=1, **given)
    mass, gravity = 2.0, 3.0
    energy = np.sum(run.p**2, axis=1) / (2 * mass) + mass * gravity * run.q[:, 2]
    assert numbers["energy"]["largest"] == pytest.approx(np.abs(energy - energy[0]).max(), rel=1e-9)
    assert numbers["conserved"]["g"] == pytest.approx(np.abs(np.sum(run.q**2, axis=1) - 1.0).max(), abs=1e-15)
    assert max(numbers["curve"]["largest"]) == pytest.approx((energy - energy[0]).max(), abs=1e-12)
    exact = package.run(
        "spherical_pendulum", steps=100 * setting["error_steps"], every=100, **given | {"h": 1e-4, "method": "rattle/kahan_li8"}
    )
    off = np.abs(run.q[: setting["error_steps"] + 1] - exact.q).max(axis=1)
    assert numbers["error"]["value"] <= off.max() * (1 + 1e-9)
    assert numbers["error"]["value"] >= off[-1] * (1 - 1e-6)


# ---- verified again -----------------------------------------------------------------------------------------------------------


def test_a_certificate_is_verified_by_what_it_was_made_of(certificate):
    verification = verify_certificate(certificate, trust=True)
    assert verification.agrees
    assert verification.within == 0
    assert verification.equal > 100
    assert f"{verification.equal} are equal to the bit, and 0 within rounding." in verification.sentence


def numbers_of(tree, place=()):
    """Give the places of all numbers in a tree."""
    if isinstance(tree, dict):
        for key, value in tree.items():
            yield from numbers_of(value, (*place, key))
    elif isinstance(tree, list):
        for k, value in enumerate(tree):
            yield from numbers_of(value, (*place, k))
    elif isinstance(tree, int | float) and not isinstance(tree, bool):
        yield place


def test_no_number_can_be_changed_by_a_tenth_without_being_seen_but_what_rounding_decides(whole):
    answer = whole[1][0]
    numbers, within = answer["numbers"], answer["within"]
    places = [place for place in numbers_of(numbers) if at(numbers, place)]
    assert len(places) > 200
    loose = [place for place in places if 0.1 * abs(at(numbers, place)) < (at(within, place) or 0.0)]
    for place in places:
        tampered = copy.deepcopy(numbers)
        put_at(tampered, place, 1.1 * at(numbers, place))
        seen = any(pair.verdict == DIFFERS for pair in compare(tampered, numbers, allowance(within, answer["elsewhere"])))
        assert seen == (place not in loose), place
    of_rounding = {
        ("claims", name, "measured") for name in ("symmetric", "symplectic", "Poisson in the chart", "keeps g", "keeps G H_p", "keeps L3")
    }
    of_rounding |= {("conserved", name) for name in ("g", "Gv", "L3")} | {("error", "bound"), ("orders", "contraction")}
    deviations = {("claims", "order", "standard_error")} | {("orders", "components", name, "standard_error") for name in ("q", "p")}
    assert {place for place in loose if place[0] not in ("orders", "curve")} <= of_rounding | deviations
    assert len(loose) < len(places) / 4


def at(tree, place):
    """Return what is at a place of a tree, None where there is nothing."""
    for key in place:
        tree = tree.get(key) if isinstance(tree, dict) else tree[key] if tree is not None else None
    return tree


def put_at(tree, place, value):
    at(tree, place[:-1])[place[-1]] = value


def refuse(content):
    """Have the first problem of a certificate be refused."""
    del content["problems"][0]["numbers"]
    content["problems"][0]["refused"] = "it is too easy"
    content["holds"] = []


CHANGES = {
    "an error": (lambda c: c["problems"][0]["numbers"]["error"].update(value=1e-9), "value of error of spherical_pendulum"),
    "an order": (lambda c: c["problems"][0]["numbers"]["claims"]["order"].update(measured=4.0), "measured of order of claims"),
    "a verdict": (lambda c: c["problems"][0]["numbers"]["energy"].update(verdict="kept"), "verdict of energy"),
    "a claim that is not stated": (lambda c: c["problems"][0]["numbers"]["claims"]["keeps H"].update(claimed=True), "claimed of keeps H"),
    "a finding less": (lambda c: c["problems"][0]["numbers"]["claims"].pop("keeps L3"), "keeps L3 of claims"),
    "a number that is not there": (lambda c: c["problems"][0]["numbers"]["error"].update(value=None), "value of error"),
    "another reference": (lambda c: c["problems"][0]["numbers"]["error"].update(reference="my own"), "reference of error"),
    "other parameters": (lambda c: c["problems"][0]["parameters"].update(mass=7.0), "mass of parameters"),
    "another definition": (lambda c: c["problems"][0].update(definition="0" * 64), "definition of spherical_pendulum"),
    "a problem that is said to be refused": (lambda c: refuse(c), "in the certificate, and 'measured' when measured again"),
}


@pytest.mark.parametrize(("change", "said"), CHANGES.values(), ids=CHANGES)
def test_what_is_changed_with_a_checksum_that_fits_does_not_agree(certificate, change, said):
    rewritten(certificate, change)
    verification = verify_certificate(certificate, trust=True)
    assert not verification.agrees
    assert any(said in fault for fault in verification.faults), verification.faults
    assert "is not verified" in verification.sentence


def edited(text, old, new):
    assert old in text
    return text.replace(old, new, 1)


FORMS = {
    "not JSON": (lambda text: text[:-20], "is not a certificate, or is damaged"),
    "empty": (lambda text: "", "is not a certificate, or is damaged"),
    "deep": (lambda text: "[" * 200_000, "is not a certificate, or is damaged"),
    "nested": (lambda text: edited(text, '"format": 1', '"format": 1, "x": ' + "[" * 900 + "]" * 900), "certificate"),
    "no number": (lambda text: edited(text, '"format": 1', '"format": NaN'), "NaN in place of a number"),
    "another schema": (lambda text: edited(text, "daebench certificate", "other certificate"), "it says it is 'other certificate'"),
    "a newer format": (lambda text: edited(text, '"format": 1', f'"format": {FORMAT + 1}'), "was written by a newer daebench"),
    "a number without its checksum": (lambda text: edited(text, '"every": 1', '"every": 2'), "its checksum does not fit"),
}


@pytest.mark.parametrize(("change", "said"), FORMS.values(), ids=FORMS)
def test_what_is_no_certificate_is_refused_before_anything_is_run(certificate, monkeypatch, change, said):
    monkeypatch.setattr(process, "measured", lambda *_: pytest.fail("run"))
    (certificate / NAME).write_text(change((certificate / NAME).read_text()))
    with pytest.raises(Unverified, match="certificate") as error:
        verify_certificate(certificate, trust=True)
    assert said in str(error.value)
    assert len(str(error.value)) < 600


SMUGGLED = {
    "a file that leads out": (
        lambda c: c["code"]["files"].update({"../evil.py": "0" * 64}),
        "a path that does not lead out of its folder",
    ),
    "a file that is not there": (lambda c: c["code"]["files"].update({"evil.py": "0" * 64}), "is missing, or is not a file"),
    "another method": (
        lambda c: c.update(method="/elsewhere/evil.py:step"),
        "is not among the files beside the certificate; nothing is run",
    ),
    "a method of daebench with files": (
        lambda c: c.update(method="rattle"),
        "is not among the files beside the certificate; nothing is run",
    ),
    "a problem file of this machine": (
        lambda c: c["problems"][0].update(problem="/elsewhere/evil.py"),
        "is not among the files beside the certificate; nothing is run",
    ),
    "another hash": (lambda c: c["code"].update(hash="0" * 64), "it is other code"),
    "steps without end": (
        lambda c: c["problems"][0]["setting"].update(steps=10**12),
        "steps is 1000000000000, and must be",
    ),
    "runs without end": (
        lambda c: c["problems"][0]["setting"].update(counts=[1] * 1000),
        "counts is a list of 1000 entries",
    ),
    "claims that do not hold": (lambda c: c["holds"].append("elegant"), "holds are not the claims that have this verdict on the problems"),
    "no code": (lambda c: c.pop("code"), "is not what daebench certify writes: it has no code; make it again."),
    "a setting with more": (
        lambda c: c["problems"][0]["setting"].update(more=1),
        "setting has 'more', which is no field of it",
    ),
}


@pytest.mark.parametrize(("change", "said"), SMUGGLED.values(), ids=SMUGGLED)
def test_what_is_put_into_a_certificate_is_refused_before_anything_is_run(certificate, monkeypatch, change, said):
    monkeypatch.setattr(process, "measured", lambda *_: pytest.fail("run"))
    rewritten(certificate, change)
    with pytest.raises(Unverified) as error:
        verify_certificate(certificate, trust=True)
    assert said in str(error.value)
    assert len(str(error.value)) < 600


UNSEEN = ("about", "options", "claims", "anyway"), ("changed", "guessed", "h", "note", "checksum")
"""Fields of a certificate and of its parts that another value of the same kind does not belie: nothing is measured anew here."""


@pytest.mark.parametrize("count", [80, pytest.param(4000, marks=pytest.mark.exhaustive)], ids=["some", "many"])
def test_whatever_a_field_of_a_certificate_says_is_a_sentence(certificate, daebench, count):
    """Every field, its checksum made anew: it is refused before anything is run, or does not agree with what is measured again."""
    whole = json.loads((certificate / NAME).read_text())
    everything = [(place, name) for place in forged.places_of(whole) for name in [*forged.ABSURD, None]]
    refused, sealed = 0, {"checksum": ""}
    for place, name in random.Random(count).sample(everything, min(count, len(everything))):
        text = forged.with_checksum(forged.altered(whole, place, forged.ABSURD.get(name)))
        (certificate / NAME).write_text(text)
        status, out, err = daebench("certificate", "verify", certificate, "--trust")
        forged.require_sentence(status, out, err, (place, name))
        assert "\x1b" not in out + err
        refused += err != ""
        unseen = place[0] in UNSEEN[0] or place[-1] in UNSEEN[1] or {"setting", "changed", "problem", "case"} & set(place)
        unseen = unseen or (place[:-1] == ("problems",) and name is None)  # a certificate of fewer problems is one
        rounding = isinstance(at(whole, place), float) and "and 0 within rounding" not in out  # zero for 1e-16, which is said
        assert status != 0 or unseen or rounding or json.loads(text) | sealed == whole | sealed, (place, name)
    assert refused > count / 2


def test_other_code_beside_a_certificate_is_refused_before_anything_is_run(certificate, monkeypatch):
    monkeypatch.setattr(process, "measured", lambda *_: pytest.fail("run"))
    file = certificate / "code" / "forces.py"
    file.write_text(contestants.FORCES.replace("3.0", "3.1"))
    with refused("certificate-file-hash", Unverified, says=("SHA-256",)):
        verify_certificate(certificate, trust=True)
    file.unlink()
    with refused("certificate-file-missing", Unverified):
        verify_certificate(certificate, trust=True)
    file.mkdir()
    with refused("certificate-file-missing", Unverified):
        verify_certificate(certificate, trust=True)


def test_a_file_that_nobody_certified_is_not_there_when_the_code_is_run(whole, certificate, monkeypatch):
    (certificate / "code" / "numpy.py").write_text("raise SystemExit('evil')")
    seen = []
    monkeypatch.setattr(
        process, "measured", lambda tasks, folder, *_: seen.extend(file.name for file in folder.iterdir()) or copy.deepcopy(whole[1])
    )
    assert verify_certificate(certificate, trust=True).agrees
    assert sorted(seen) == ["ball.py", "forces.py"]


def test_a_certificate_that_is_not_there_is_bad_input(tmp_path):
    with refused("no-such-certificate"):
        verify_certificate(tmp_path, trust=True)


# ---- numbers agree ------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("old", "new", "within", "counts"),
    [
        (1.0, 1.0 + 0.9 * RELATIVE, 0.0, (0, 1, 0)),
        (1.0, 1.0 + 2 * RELATIVE, 0.0, (0, 0, 1)),
        (1e-16, 3e-16, 1e-15, (0, 1, 0)),
        (1e-16, 3e-14, 1e-15, (0, 0, 1)),
        ("bounded", "drifts", 0.0, (0, 0, 1)),
        ("stopped at t = 0.94", "stopped at t = 0.95", 0.0, (0, 0, 0)),
        ("stopped at t = 0.94", "went on to t = 0.94", 0.0, (0, 0, 1)),
    ],
)
def test_values_are_equal_within_rounding_or_different(old, new, within, counts):
    pairs = [*compare({"x": old}, {"x": new}, allowance({"x": within}, {"x": new}))]
    numbers = [pair.verdict for pair in pairs if pair.is_number]
    assert (numbers.count(EQUAL), numbers.count(WITHIN), differing(pairs)) == counts


def differing(pairs):
    """Return how many pairs of values differ."""
    return [pair.verdict for pair in pairs].count(DIFFERS)


@pytest.mark.parametrize("elsewhere", [{}, {"x": 1.0}, None])
@pytest.mark.parametrize(("old", "new"), [({}, {"x": 1.0}), ({}, {"x": "a"}), ({"x": "a"}, {}), ({"x": {}}, {"x": {"y": None}})])
def test_what_one_side_has_not_agrees_with_nothing(old, new, elsewhere):
    assert differing(compare(old, new, allowance({}, elsewhere))) == 1


def test_a_word_may_be_that_of_a_start_that_is_rounded_elsewhere():
    rounding = allowance({}, {"x": "bounded"})
    assert differing(compare({"x": "bounded"}, {"x": "drifts"}, rounding)) == 0
    assert differing(compare({"x": "kept"}, {"x": "drifts"}, rounding)) == 1


# ---- the code -----------------------------------------------------------------------------------------------------------------


def test_the_code_is_the_file_and_what_it_imports_beside_it(codes):
    code = code_of("./ball.py:step")
    assert (code.method, sorted(code.files)) == ("./ball.py:step", ["ball.py", "forces.py"])
    assert code.digest == Code("", {name: (codes / name).read_bytes() for name in ("forces.py", "ball.py")}).digest
    (codes / "table.txt").write_text("1")
    assert "table.txt" in code_of("ball.py:step", files=["table.txt"]).files
    (codes / "forces.py").write_text(contestants.FORCES + "# more\n")
    assert code_of("./ball.py:step").digest != code.digest


def test_the_hash_is_of_names_and_contents():
    files = {"a": b"1", "b": b"2"}
    others = [{"a": b"1", "b": b"3"}, {"a": b"1", "c": b"2"}, {"a": b"12", "b": b""}, {"a": b"1"}, {"a": b"2", "b": b"1"}]
    assert len({Code("", contents).digest for contents in [files, *others]}) == 6
    assert Code("", dict(reversed(files.items()))).digest == Code("", files).digest


def test_a_program_is_its_file_and_an_interpreter_is_named(codes):
    script = codes / "sub" / "solve.py"
    script.parent.mkdir()
    script.write_text("import near\n")
    (codes / "sub" / "near.py").write_text("")
    program = codes / "program"
    program.write_text("#!/bin/sh\n")
    program.chmod(0o755)
    code = code_of("exec:./program --fast")
    assert (code.method, list(code.files), code.executable) == ("exec:./program --fast", ["program"], {"program"})
    code = code_of("exec:sh sub/solve.py 3")
    assert (code.method, sorted(code.files), code.executable) == ("exec:sh ./solve.py 3", ["near.py", "solve.py"], set())


def test_a_function_of_a_file_is_its_address(codes, monkeypatch):
    monkeypatch.syspath_prepend(str(codes))
    import rigid

    assert code_of(rigid.step).method == "./rigid.py:step"
    with refused("method-not-top-level"):
        code_of(lambda p, q, h: (p, q))


def test_what_cannot_be_certified_is_refused_in_a_sentence(codes):
    for method, settings, sentence in (
        ("./nothing.py:step", {}, "there is no such file"),
        ("exec:./nothing", {}, "there is no such executable program"),
        ("exec:sh", {}, "is on the PATH, and a certificate needs a separate file"),
        ("./ball.py", {}, "give FILE.py:NAME"),
        ("rattle", {"files": ["ball.py"]}, "leave the file out"),
        ("./ball.py:step", {"problems": ["planar_pendulum:fast"]}, "unknown case"),
        ("./ball.py:step", {"parameters": {"mass": 1.0}}, "name it, for example --problem double_pendulum"),
        ("./ball.py:step", {"h": math.nan}, "must be a finite number"),
        ("./ball.py:step", {"claims": {"elegant": True}}, "unknown claim 'elegant'"),
    ):
        with pytest.raises(BadInput) as error:
            make(method, **settings)
        assert sentence in str(error.value)


# ---- a process of its own -----------------------------------------------------------------------------------------------------

ENDS = """
import os, signal, sys, time
print("hello")
def crashes(p, q, h): os.kill(os.getpid(), signal.SIGSEGV)
def leaves(p, q, h): os._exit(3)
def hangs(p, q, h):
    while True:
        try: time.sleep(60)
        except BaseException: pass
def one(p, q, h): return p
def spoils(p, q, h): return p, q / 0.0
"""

TASK = {"problem": "planar_pendulum", "case": "rotating", "parameters": {}, "options": {}, "anyway": False, "claims": {}}
TASK |= {"setting": None, "h": 0.1, "guessed": False}


@pytest.mark.slow
@pytest.mark.sampled(by=lambda case: case == "crashes")
@pytest.mark.parametrize(
    ("name", "sentence"),
    [
        ("crashes", "was ended by signal SIGSEGV (segmentation fault)"),
        ("leaves", "the process of the code exited with status 3"),
        ("spoils", "no longer finite"),
    ],
    ids=["crashes", "leaves", "spoils"],
)
def test_code_that_ends_its_process_takes_nothing_with_it(tmp_path, name, sentence):
    (tmp_path / "ends.py").write_text(ENDS)
    (answer,) = process.measured([TASK | {"method": f"./ends.py:{name}"}], tmp_path)
    assert sentence in answer["refused"]


@pytest.mark.exhaustive
def test_code_that_hangs_is_left(tmp_path, monkeypatch):
    (tmp_path / "ends.py").write_text(ENDS)
    monkeypatch.setattr(process, "ENDING_SECONDS", 0.2)
    (answer,) = process.measured([TASK | {"method": "./ends.py:hangs"}], tmp_path, seconds=20.0)
    assert "took over 20 s" in answer["refused"]


@pytest.mark.slow
def test_a_file_of_the_code_does_not_stand_in_for_a_module_of_python(tmp_path):
    (tmp_path / "random.py").write_text("raise SystemExit('evil')")
    (tmp_path / "json.py").write_text("raise SystemExit('evil')")
    (tmp_path / "ends.py").write_text(ENDS)
    (answer,) = process.measured([TASK | {"method": "./ends.py:one"}], tmp_path)
    assert "must return p and q" in answer["refused"]


def test_a_run_that_fails_everywhere_is_a_failure_and_no_bad_input(codes):
    (codes / "fails.py").write_text("def step(p, q, h):\n    return p, q / 0.0\n")
    with refused("run-stopped-early", RunFailed), np.errstate(all="ignore"):
        make("./fails.py:step", problems=["planar_pendulum:rotating"])

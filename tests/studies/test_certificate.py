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
from daebench.errors import DaebenchError, RunFailed
from daebench.records.code import Code, code_of, put
from daebench.records.comparison import DIFFERS, WITHIN, compare
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


def rewritten(folder, changes):
    """Put values at places of a certificate, such as ``problems/0/case``, or leave out what is there, and have its checksum fit."""
    content = json.loads((folder / NAME).read_text())
    for path, value in changes.items():
        *place, name = path.split("/")
        inner = at(content, place)
        if value is LEFT_OUT:
            del inner[name]
        else:
            inner[name] = value
    content["checksum"] = checksum(content)
    (folder / NAME).write_text(json.dumps(content))


LEFT_OUT = object()


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
    with refused("no-problem-solved", DaebenchError, says=("spherical_pendulum",)):
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
    given = {"h": 0.01, "parameters": contestants.PARAMETERS}
    (problem,) = make("./ball.py:step", problems=[contestants.PROBLEM], **given).content["problems"]
    setting, numbers = problem["setting"], problem["numbers"]
    run = package.run("spherical_pendulum", case="fig1.1", method="./ball.py:step", steps=setting["steps"], every=1, **given)
    energy = np.sum(run.p**2, axis=1) / (2 * 2.0) + 2.0 * 3.0 * run.q[:, 2]
    assert numbers["energy"]["largest"] == pytest.approx(np.abs(energy - energy[0]).max(), rel=1e-9)
    assert numbers["conserved"]["g"] == pytest.approx(np.abs(np.sum(run.q**2, axis=1) - 1.0).max(), abs=1e-15)
    assert max(numbers["curve"]["largest"]) == pytest.approx((energy - energy[0]).max(), abs=1e-12)
    count = setting["error_steps"]
    fine = {"method": "rattle/kahan_li8", "steps": 100 * count, "every": 100}
    exact = package.run("spherical_pendulum", case="fig1.1", **fine, **given | {"h": 1e-4})
    off = np.abs(run.q[: count + 1] - exact.q).max(axis=1)
    assert off[-1] * (1 - 1e-6) <= numbers["error"]["value"] <= off.max() * (1 + 1e-9)


# ---- verified again -----------------------------------------------------------------------------------------------------------


def test_a_certificate_is_verified_by_what_it_was_made_of(certificate):
    verification = verify_certificate(certificate, trust=True)
    assert (verification.agrees, verification.within) == (True, 0)
    assert verification.equal > 100


def numbers_of(tree):
    """Return the places of all numbers in a tree that are not zero."""
    pairs = compare(tree, tree)
    return [pair.place for pair in pairs if pair.is_number and not isinstance(pair.old, bool) and pair.old]


def test_no_number_can_be_changed_by_a_tenth_without_being_seen_but_what_rounding_decides(whole):
    answer = whole[1][0]
    numbers, within = answer["numbers"], answer["within"]
    places, written = numbers_of(numbers), []
    json.loads(json.dumps(numbers), parse_float=lambda x: written.append(float(x)), parse_int=lambda x: written.append(int(x)))
    assert len(places) == np.count_nonzero(written) > 200
    loose = [place for place in places if 0.1 * abs(at(numbers, place)) < (at(within, place) or 0.0)]
    for place in places:
        tampered = copy.deepcopy(numbers)
        at(tampered, place[:-1])[place[-1]] *= 1.1
        seen = any(pair.verdict == DIFFERS for pair in compare(tampered, numbers, allowance(within, answer["elsewhere"])))
        assert seen == (place not in loose), place
    kept = ("symmetric", "symplectic", "Poisson in the chart", "keeps g", "keeps G H_p", "keeps L3")
    of_rounding = {("claims", name, "measured") for name in kept} | {("error", "bound")}
    of_rounding |= {("conserved", name) for name in ("g", "Gv", "L3")}
    assert {place for place in loose if place[0] not in ("orders", "curve")} <= of_rounding | {("claims", "order", "standard_error")}
    assert len(loose) < len(places) / 4


def at(tree, place):
    """Return what is at a place of a tree, None where there is nothing."""
    for key in place:
        tree = tree.get(key) if isinstance(tree, dict) else tree[int(key)] if tree is not None else None
    return tree


CHANGES = {
    "value of error of spherical_pendulum": {"numbers/error/value": 1e-9},
    "measured of order of claims": {"numbers/claims/order/measured": 4.0},
    "verdict of energy": {"numbers/energy/verdict": "kept"},
    "claimed of keeps H": {"numbers/claims/keeps H/claimed": True},
    "keeps L3 of claims": {"numbers/claims/keeps L3": LEFT_OUT},
    "value of error": {"numbers/error/value": None},
    "reference of error": {"numbers/error/reference": "my own"},
    "mass of parameters": {"parameters/mass": 7.0},
    "definition of spherical_pendulum": {"definition": "0" * 64},
    "and 'measured' when measured again": {"numbers": LEFT_OUT, "refused": "it is too easy"},
}
"""What is found to differ, and what was changed in the first problem."""


@pytest.mark.parametrize("found", CHANGES)
def test_what_is_changed_with_a_checksum_that_fits_does_not_agree(certificate, found):
    changes = {f"problems/0/{path}": value for path, value in CHANGES[found].items()}
    rewritten(certificate, changes | ({"holds": []} if "problems/0/refused" in changes else {}))
    verification = verify_certificate(certificate, trust=True)
    assert not verification.agrees
    assert any(found in fault for fault in verification.faults), verification.faults


def edited(text, old, new):
    assert old in text
    return text.replace(old, new, 1)


FORMS = {
    "not JSON": ("certificate-damaged", lambda text: text[:-20]),
    "empty": ("certificate-damaged", lambda text: ""),
    "deep": ("certificate-damaged", lambda text: "[" * 200_000),
    "nested": ("certificate-checksum", lambda text: edited(text, '"format": 1', '"format": 1, "x": ' + "[" * 900 + "]" * 900)),
    "no number": ("certificate-damaged", lambda text: edited(text, '"format": 1', '"format": NaN')),
    "another schema": ("not-a-certificate", lambda text: edited(text, "daebench certificate", "other certificate")),
    "a newer format": ("certificate-of-other-version", lambda text: edited(text, '"format": 1', f'"format": {FORMAT + 1}')),
    "a number without its checksum": ("certificate-checksum", lambda text: edited(text, '"every": 1', '"every": 2')),
}


@pytest.fixture
def require_unverified(certificate, monkeypatch):
    """Require that the certificate is refused with a code, in a sentence of limited length, before anything is run."""
    monkeypatch.setattr(process, "measured", lambda *_: pytest.fail("run"))

    def require(code):
        with refused(code, Unverified) as error:
            verify_certificate(certificate, trust=True)
        assert len(str(error.value)) < 600

    return require


@pytest.mark.parametrize(("code", "change"), FORMS.values(), ids=FORMS)
def test_what_is_no_certificate_is_refused_before_anything_is_run(certificate, require_unverified, code, change):
    (certificate / NAME).write_text(change((certificate / NAME).read_text()))
    require_unverified(code)


SMUGGLED = {
    "a file that leads out": ("certificate-malformed", "code/files", {"../evil.py": "0" * 64}),
    "a file that is not there": ("certificate-file-missing", "code/files/evil.py", "0" * 64),
    "another method": ("certificate-code-missing", "method", "/elsewhere/evil.py:step"),
    "a method of daebench with files": ("certificate-code-missing", "method", "rattle"),
    "a problem file of this machine": ("certificate-problem-missing", "problems/0/problem", "/elsewhere/evil.py"),
    "another hash": ("certificate-code-hash", "code/hash", "0" * 64),
    "steps without end": ("certificate-malformed", "problems/0/setting/steps", 10**12),
    "runs without end": ("certificate-malformed", "problems/0/setting/counts", [1] * 1000),
    "claims that do not hold": ("certificate-malformed", "holds", ["elegant"]),
    "no code": ("certificate-malformed", "code", LEFT_OUT),
    "a setting with more": ("certificate-malformed", "problems/0/setting/more", 1),
}


@pytest.mark.parametrize(("code", "path", "value"), SMUGGLED.values(), ids=SMUGGLED)
def test_what_is_put_into_a_certificate_is_refused_before_anything_is_run(certificate, require_unverified, code, path, value):
    rewritten(certificate, {path: value})
    require_unverified(code)


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


def test_other_code_beside_a_certificate_is_refused_before_anything_is_run(certificate, require_unverified):
    file = certificate / "code" / "forces.py"
    file.write_text(contestants.FORCES.replace("3.0", "3.1"))
    require_unverified("certificate-file-hash")
    file.unlink()
    require_unverified("certificate-file-missing")
    file.mkdir()
    require_unverified("certificate-file-missing")


def test_a_file_that_nobody_certified_is_not_there_when_the_code_is_run(whole, certificate, monkeypatch):
    (certificate / "code" / "numpy.py").write_text("raise SystemExit('evil')")
    seen = []
    monkeypatch.setattr(
        process, "measured", lambda tasks, folder, *_: seen.extend(file.name for file in folder.iterdir()) or copy.deepcopy(whole[1])
    )
    assert verify_certificate(certificate, trust=True).agrees
    assert sorted(seen) == ["ball.py", "forces.py"]


# ---- numbers agree ------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("old", "new", "within", "elsewhere", "verdict"),
    [
        (1.0, 1.0 + 0.9 * RELATIVE, 0.0, 0.0, WITHIN),
        (1.0, 1.0 + 2 * RELATIVE, 0.0, 0.0, DIFFERS),
        (1e-16, 3e-16, 1e-15, 0.0, WITHIN),
        (1e-16, 3e-14, 1e-15, 0.0, DIFFERS),
        ("bounded", "drifts", 0.0, "", DIFFERS),
        ("kept", "drifts", 0.0, "bounded", DIFFERS),
        ("bounded", "drifts", 0.0, "bounded", WITHIN),
        ("stopped at t = 0.94", "stopped at t = 0.95", 0.0, "", WITHIN),
        ("stopped at t = 0.94", "went on to t = 0.94", 0.0, "", DIFFERS),
    ],
)
def test_values_are_equal_within_rounding_or_different(old, new, within, elsewhere, verdict):
    (pair,) = compare({"x": old}, {"x": new}, allowance({"x": within}, {"x": elsewhere}))
    assert pair.verdict == verdict


@pytest.mark.parametrize("elsewhere", [{}, {"x": 1.0}, None])
@pytest.mark.parametrize(("old", "new"), [({}, {"x": 1.0}), ({}, {"x": "a"}), ({"x": "a"}, {}), ({"x": {}}, {"x": {"y": None}})])
def test_what_one_side_has_not_agrees_with_nothing(old, new, elsewhere):
    assert [pair.verdict for pair in compare(old, new, allowance({}, elsewhere))] == [DIFFERS]


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


def test_what_cannot_be_certified_is_refused(codes):
    for code, method, settings in (
        ("no-such-file-or-name", "./nothing.py:step", {}),
        ("exec-no-such-program", "exec:./nothing", {}),
        ("program-on-path", "exec:sh", {}),
        ("not-callable-code", "./ball.py", {}),
        ("files-beside-own-method", "rattle", {"files": ["ball.py"]}),
        ("unknown-name", "./ball.py:step", {"problems": ["planar_pendulum:fast"]}),
        ("parameter-of-no-problem", "./ball.py:step", {"parameters": {"mass": 1.0}}),
        ("not-finite", "./ball.py:step", {"h": math.nan}),
        ("unknown-name", "./ball.py:step", {"claims": {"elegant": True}}),
    ):
        with refused(code):
            make(method, **settings)


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
    ("name", "why"), [("crashes", "SIGSEGV"), ("leaves", "status 3"), ("spoils", "no longer finite")], ids=["crashes", "leaves", "spoils"]
)
def test_code_that_ends_its_process_takes_nothing_with_it(tmp_path, name, why):
    (tmp_path / "ends.py").write_text(ENDS)
    (answer,) = process.measured([TASK | {"method": f"./ends.py:{name}"}], tmp_path)
    assert why in answer["refused"]


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

"""Certificates read with care, for they may come from anybody: form, version, checksum, and the files of the code by their hashes."""

import hashlib
from collections.abc import Mapping
from dataclasses import fields
from pathlib import Path
from typing import Any

from daebench.errors import BadInput, DaebenchError
from daebench.reference.keep.store import checksum
from daebench.runs.json_values import strict
from daebench.runs.request import ON_SINGULAR
from daebench.studies.certificate.code import LARGEST, Code, is_inside
from daebench.studies.certificate.record import FORMAT, NAME, SCHEMA, Certificate, verdicts
from daebench.studies.certificate.setting import Setting
from daebench.systems.files.execute import is_path

LONGEST = 2**24
"""Most bytes of a certificate."""

MOST_PROBLEMS, MOST_STEPS, MOST_RUNS = 32, 10**8, 64
"""Problems of a certificate, steps of a run, and runs of an order study, at most: a certificate of others is not to keep a machine busy."""


class Unverified(DaebenchError):
    """A certificate that is not to be trusted; the text says why."""


def read(path: Path) -> Certificate:
    """Return a certificate, its form checked and its numbers not; its code is not looked at.

    Parameters
    ----------
    path : Path
        The file, or the folder that it is in.

    Raises
    ------
    BadInput
        If there is none.
    Unverified
        If it is damaged, changed, of another version, or something else.
    """
    path = path / NAME if path.is_dir() else path
    if not path.is_file():
        raise BadInput(f"there is no certificate {path}; daebench certify makes one.")
    try:
        if path.stat().st_size > LONGEST:
            raise Unverified(f"{path} is larger than {LONGEST >> 20} MB, which no certificate is.")
        content = strict(path.read_bytes().decode("utf-8"))
    except (OSError, ValueError) as error:
        raise Unverified(f"{path} is not a certificate, or is damaged: {_words(error)}; get it again from where it came.") from error
    try:
        _require_ours(path, content)
        _require_form(content)
    except (ValueError, KeyError, TypeError, AttributeError, RecursionError) as error:
        raise Unverified(f"{path} is not what daebench certify writes: {_words(error)}; make it again.") from error
    return Certificate(path.parent, content)


def _words(error: Exception) -> str:
    return f"{type(error).__name__} {' '.join(str(error).split())[:100]}".strip().rstrip(".")


def _require_ours(path: Path, content: Any) -> None:
    """Refuse what is something else, of another version, or not what was written."""
    if not isinstance(content, dict) or content.get("schema") != SCHEMA:
        said = content.get("schema") if isinstance(content, dict) else None
        raise Unverified(f"{path} is not a certificate of daebench{f': it says it is {str(said)[:80]!r}' if said else ''}.")
    layout = content.get("format")
    if layout != FORMAT or isinstance(layout, bool):
        age = "a newer" if isinstance(layout, int) and layout > FORMAT else "another"
        raise Unverified(f"{path} was written by {age} daebench (format {str(layout)[:20]}, here {FORMAT}); take that version.")
    if content.get("checksum") != checksum(content):
        raise Unverified(f"{path} is not what was written: its checksum does not fit; get it again from where it came.")


def _require(holds: bool, what: str) -> None:
    if not holds:
        raise ValueError(what)


def _require_form(content: Mapping[str, Any]) -> None:
    """Refuse what has not the fields of a certificate, or would have more executed than stands beside it."""
    code = content["code"]
    _require(isinstance(content["method"], str), "the method is not text")
    _require(isinstance(content["anyway"], bool), "anyway is not true or false")
    _require(content.get("on_singular") in (None, *ON_SINGULAR), f"on_singular is none of {', '.join(ON_SINGULAR)}")
    for name in ("options", "claims"):
        _require(isinstance(content[name], dict), f"{name} is not a mapping")
    _require_files(code["files"])
    _require(isinstance(code["executable"], list), "what is executable is no list")
    _require(isinstance(code["hash"], str) and set(code["executable"]) <= set(code["files"]), "the files of the code do not fit")
    _require(
        isinstance(content["problems"], list) and 0 < len(content["problems"]) <= MOST_PROBLEMS, "there are too many problems, or none"
    )
    for problem in content["problems"]:
        _require_problem(problem)
    stated = verdicts(content["problems"])
    _require(all(content[name] == stated[name] for name in stated), "claims that are said to hold are not those that do")


def _require_files(files: Any) -> None:
    _require(isinstance(files, dict) and len(files) <= 1000, "the files are not a mapping, or too many")
    for name, digest in files.items():
        _require(is_inside(name), f"the name {name[:80]!r} leads out of its folder")
        _require(isinstance(digest, str), f"{name[:80]!r} has no digest")


def _require_problem(problem: Mapping[str, Any]) -> None:
    _require_files(problem["files"])
    _require(isinstance(problem["problem"], str) and isinstance(problem["case"], str | None), "a problem or case is not text")
    _require(all(isinstance(value, int | float) for value in problem["changed"].values()), "a parameter is not a number")
    _require(isinstance(problem["guessed"], bool), "guessed is not true or false")
    if "refused" in problem:
        _require(isinstance(problem["refused"], str), "a refusal is not a sentence")
        return
    setting = problem["setting"]
    _require(set(setting) == {entry.name for entry in fields(Setting)}, "a setting has other names")
    _require(problem["h"] is None or problem["h"] == setting["h"], "a step size is not the one that was asked for")
    counts = setting["counts"]
    numbers = [setting[name] for name in ("steps", "every", "error_steps", "checked_steps")]
    _require(isinstance(setting["h"], float | int) and setting["h"] > 0, "a step size is not positive")
    _require(all(type(n) is int and 0 < n <= MOST_STEPS for n in [*numbers, *counts]), "a number of steps is none, or too large")
    _require(0 < len(counts) <= MOST_RUNS, "an order study has too many runs, or none")
    _require(isinstance(problem["numbers"], dict), "the numbers are not a mapping")


def code_in(certificate: Certificate) -> Code:
    """Return the code that stands beside a certificate, whole and as it was certified.

    Raises
    ------
    Unverified
        If a file is missing or is not what was certified, or the method is not among the files.
    """
    content = certificate.content["code"]
    files = files_in(certificate.folder / "code", content["files"])
    code = Code(certificate.method, files, frozenset(content["executable"]))
    _require_beside(certificate, code)
    if code.digest != certificate.hash:
        whose = "daebench here is" if code.of_daebench else "that of its files is"
        raise Unverified(
            f"the hash of the code is {certificate.hash[:64]} in the certificate, and {whose} {code.digest}; it is other code."
        )
    return code


def _require_beside(certificate: Certificate, code: Code) -> None:
    """Refuse addresses of files that do not stand beside the certificate."""
    for problem in certificate.content["problems"]:
        name = problem["problem"]
        if is_path(name) and name.removeprefix("./") not in problem["files"]:
            raise Unverified(f"the problem {name[:80]} is not among the files beside the certificate; nothing is run.")
    if not _is_beside(code):
        raise Unverified(f"the code {code.method[:80]} is not among the files beside the certificate; nothing is run.")


def _is_beside(code: Code) -> bool:
    try:
        return code.is_beside
    except ValueError:  # a program and arguments that no shell would take
        return False


def files_in(folder: Path, files: Mapping[str, str]) -> dict[str, bytes]:
    """Return the contents of files, each of which has its digest.

    Raises
    ------
    Unverified
        If one has not, or is missing.
    """
    contents = {}
    for name, digest in files.items():
        path = folder / name
        try:
            if not path.is_file() or path.stat().st_size > LARGEST:
                raise Unverified(f"the file {name} of {folder} is missing, or is not a file; get it from where the certificate came.")
            contents[name] = path.read_bytes()
        except OSError as error:
            raise Unverified(f"the file {name} of {folder} cannot be read ({error.strerror}); get it again.") from error
        actual = hashlib.sha256(contents[name]).hexdigest()
        if actual != digest:
            raise Unverified(f"the SHA-256 of {name} is {digest[:64]} in the certificate, and {actual} of the file; it is other code.")
    return contents

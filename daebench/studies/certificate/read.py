"""Certificates read with care, for they may come from anybody: form, version, checksum, and the files of the code by their hashes."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from daebench.errors import BadInput, DaebenchError
from daebench.records.code import LARGEST, Code
from daebench.records.seals import checksum, of_another_version, sha256, words
from daebench.runs.json_values import strict
from daebench.runs.schema import WrongField, shown
from daebench.studies.certificate.record import FORMAT, NAME, SCHEMA, Certificate, require_form
from daebench.systems.files.execute import is_path

LONGEST = 2**24
"""Most bytes of a certificate."""


class Unverified(DaebenchError):
    """A certificate that is not to be trusted; the text says why."""


def read(path: Path) -> Certificate:
    """Return a certificate, its form checked and its numbers not; its code is not looked at."""
    path = path / NAME if path.is_dir() else path
    if not path.is_file():
        raise BadInput(f"there is no certificate {path}; daebench certify makes one.")
    try:
        if path.stat().st_size > LONGEST:
            raise Unverified(f"{path} is larger than {LONGEST >> 20} MB, which no certificate is.")
        content = strict(path.read_bytes().decode("utf-8"))
    except (OSError, ValueError) as error:
        raise Unverified(f"{path} is not a certificate, or is damaged: {words(error)}; get it again from where it came.") from error
    try:
        _require_ours(path, content)
        require_form(content)
    except (WrongField, RecursionError) as error:
        raise Unverified(f"{path} is not what daebench certify writes: {words(error)}; make it again.") from error
    return Certificate(path.parent, content)


def _require_ours(path: Path, content: Any) -> None:
    """Refuse a file that is no certificate, is of another version, or is not as it was written."""
    if not isinstance(content, dict) or content.get("schema") != SCHEMA:
        said = content.get("schema") if isinstance(content, dict) else None
        raise Unverified(f"{path} is not a certificate of daebench{f': it says it is {shown(said)}' if said else ''}.")
    if sentence := of_another_version(path, content.get("format"), FORMAT):
        raise Unverified(sentence)
    if content.get("checksum") != checksum(content):
        raise Unverified(f"{path} is not what was written: its checksum does not fit; get it again from where it came.")


def code_in(certificate: Certificate) -> Code:
    """Return the code that stands beside a certificate, whole and as it was certified."""
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
    if not code.is_beside:
        raise Unverified(f"the code {code.method[:80]} is not among the files beside the certificate; nothing is run.")


def files_in(folder: Path, files: Mapping[str, str]) -> dict[str, bytes]:
    """Return the contents of files, each of which has its digest."""
    contents = {}
    for name, digest in files.items():
        path = folder / name
        try:
            if not path.is_file() or path.stat().st_size > LARGEST:
                raise Unverified(f"the file {name} of {folder} is missing, or is not a file; get it from where the certificate came.")
            contents[name] = path.read_bytes()
        except OSError as error:
            raise Unverified(f"the file {name} of {folder} cannot be read ({error.strerror}); get it again.") from error
        actual = sha256(contents[name])
        if actual != digest:
            raise Unverified(f"the SHA-256 of {name} is {digest[:64]} in the certificate, and {actual} of the file; it is other code.")
    return contents

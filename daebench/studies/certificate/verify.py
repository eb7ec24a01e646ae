"""Verification of a certificate: it is read with care, the same code is run on the same problems, and its numbers are compared.

A certificate may come from anybody: its form, version and checksum are checked, and the files of the code by their hashes.
"""

import tempfile
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from daebench.errors import BadInput, DaebenchError, bounded
from daebench.methods.foreign import ForeignName, Trust, admit
from daebench.records.code import LARGEST, Code, code_digest, put
from daebench.records.comparison import DIFFERS, EQUAL, WITHIN, Compared, compare
from daebench.records.seals import checksum, digests, of_another_version, sha256, words
from daebench.runs.json_values import strict
from daebench.runs.request import Told, silent
from daebench.runs.schema import WrongField, shown
from daebench.studies.certificate import process
from daebench.studies.certificate.record import FORMAT, NAME, SCHEMA, Certificate, require_form, title
from daebench.studies.certificate.rounding import allowance
from daebench.systems.files.execute import is_path

ONCE = ("case", "parameters", "definition")
"""Parts of an answer in a certificate for each problem that are compared besides the numbers."""

LONGEST = 2**24
"""Most bytes of a certificate."""


class Unverified(DaebenchError):
    """A certificate that is not to be trusted; the text says why."""


def read(path: Path) -> Certificate:
    """Return a certificate, its form checked and its numbers not; its code is not looked at."""
    path = path / NAME if path.is_dir() else path
    if not path.is_file():
        raise BadInput(f"there is no certificate {path}; daebench certify makes one.", "no-such-certificate")
    try:
        if path.stat().st_size > LONGEST:
            raise Unverified(f"{path} is larger than {LONGEST >> 20} MB, which no certificate is.", "certificate-too-large")
        content = strict(path.read_bytes().decode("utf-8"))
    except (OSError, ValueError) as error:
        raise Unverified(
            f"{path} is not a certificate, or is damaged: {words(error)}; get it again from where it came.", "certificate-damaged"
        ) from error
    try:
        _require_ours(path, content)
        require_form(content)
    except (WrongField, RecursionError) as error:
        raise Unverified(f"{path} is not what daebench certify writes: {words(error)}; make it again.", "certificate-malformed") from error
    return Certificate(path.parent, content)


def _require_ours(path: Path, content: Any) -> None:
    """Refuse a file that is no certificate, is of another version, or is not as it was written."""
    if not isinstance(content, dict) or content.get("schema") != SCHEMA:
        said = content.get("schema") if isinstance(content, dict) else None
        raise Unverified(f"{path} is not a certificate of daebench{f': it says it is {shown(said)}' if said else ''}.", "not-a-certificate")
    if sentence := of_another_version(path, content.get("format"), FORMAT):
        raise Unverified(sentence, "certificate-of-other-version")
    if content.get("checksum") != checksum(content):
        raise Unverified(
            f"{path} is not what was written: its checksum does not fit; get it again from where it came.", "certificate-checksum"
        )


def code_in(certificate: Certificate) -> Code:
    """Return the code that stands beside a certificate, whole and as it was certified."""
    content = certificate.content["code"]
    files = files_in(certificate.folder / "code", content["files"])
    code = Code(certificate.method, files, frozenset(content["executable"]))
    _require_beside(certificate, code)
    if code.digest != certificate.hash:
        whose = "daebench here is" if code.of_daebench else "that of its files is"
        raise Unverified(
            f"the hash of the code is {certificate.hash[:64]} in the certificate, and {whose} {code.digest}; it is other code.",
            "certificate-code-hash",
        )
    return code


def _require_beside(certificate: Certificate, code: Code) -> None:
    """Refuse addresses of files that do not stand beside the certificate."""
    for problem in certificate.content["problems"]:
        name = problem["problem"]
        if is_path(name) and name.removeprefix("./") not in problem["files"]:
            raise Unverified(
                f"the problem {name[:80]} is not among the files beside the certificate; nothing is run.", "certificate-problem-missing"
            )
    if not code.is_beside:
        raise Unverified(
            f"the code {code.method[:80]} is not among the files beside the certificate; nothing is run.", "certificate-code-missing"
        )


def files_in(folder: Path, files: Mapping[str, str]) -> dict[str, bytes]:
    """Return the contents of files, each of which has its digest."""
    contents = {}
    for name, digest in files.items():
        path = folder / name
        try:
            if not path.is_file() or path.stat().st_size > LARGEST:
                raise Unverified(
                    f"the file {name} of {folder} is missing, or is not a file; get it from where the certificate came.",
                    "certificate-file-missing",
                )
            contents[name] = path.read_bytes()
        except OSError as error:
            raise Unverified(
                f"the file {name} of {folder} cannot be read ({error.strerror}); get it again.", "certificate-file-unreadable"
            ) from error
        actual = sha256(contents[name])
        if actual != digest:
            raise Unverified(
                f"the SHA-256 of {name} is {digest[:64]} in the certificate, and {actual} of the file; it is other code.",
                "certificate-file-hash",
            )
    return contents


def measured(
    code: Code, tasks: Sequence[Mapping[str, Any]], files: Mapping[str, bytes], seconds: float, progress: Told
) -> list[dict[str, Any]]:
    """Return the answers to some tasks of one code, whose files are put into a folder of their own for the time being."""
    with tempfile.TemporaryDirectory(prefix="daebench-", ignore_cleanup_errors=True) as scratch:
        code.put(Path(scratch))
        put(files, Path(scratch))
        return process.measured([{**task, "method": code.method} for task in tasks], Path(scratch), seconds, progress)


@dataclass(frozen=True)
class Verification:
    """A certificate beside a new measurement.

    Parameters
    ----------
    certificate : Certificate
        The certificate.
    problems : tuple of dict
        Each of its problems as it is now: with numbers, or refused.
    equal, within : int
        Numbers that are equal to the bit, and others that agree within what rounding allows.
    faults : tuple of str
        What does not agree, a sentence each.
    """

    certificate: Certificate
    problems: tuple[Mapping[str, Any], ...] = field(repr=False)
    equal: int
    within: int
    faults: tuple[str, ...]

    @property
    def agrees(self) -> bool:
        """Whether everything that can be repeated agrees."""
        return not self.faults

    @property
    def sentence(self) -> str:
        """The result in one sentence."""
        where = str(self.certificate.folder / NAME)
        numbers = self.equal + self.within
        if self.agrees:
            return f"{where} is verified: of its {numbers} numbers {self.equal} are equal to the bit, and {self.within} within rounding."
        more = f", and {len(self.faults) - 1} more do not agree" if len(self.faults) > 1 else ""
        other = " (it was made by another daebench)" if self.certificate.content["about"].get("daebench") != code_digest() else ""
        return bounded(f"{where} is not verified{other}: {self.faults[0]}{more}.")


def verify_certificate(
    path: str | Path,
    *,
    trust: bool = False,
    code: Iterable[str | Path] = (),
    seconds_limit: float = process.SECONDS,
    progress: Told = silent,
) -> Verification:
    """Verify a certificate: repeat its measurements, and compare the numbers.

    **With** ``trust`` **this executes the code that is stored beside it**; without it that of ``code`` alone, and the methods and problems
    of daebench. The hashes of the code's files are checked first, and the files are copied into a
    separate empty folder. Numbers agree as :func:`daebench.studies.certificate.rounding.allowance` says. Not verified are date, machine,
    versions and times. The code is run in the same process as what measures it, unless it is a program: a certificate guards against
    mistakes and altered numbers, and not against code that is written to deceive.

    Parameters
    ----------
    path : str or Path
        The certificate, or the folder that it is in.
    trust : bool
        Whether code that is stored beside it may be executed; read it first.
    code : iterable of path
        Files of one's own that may be executed if those beside the certificate have the same contents.
    seconds_limit : float
        Wall-clock limit on each problem, s.
    progress : callable
        Called with the fraction done and a label of the current task.

    Returns
    -------
    Verification

    Raises
    ------
    BadInput
        If there is no certificate, or it names code that is not trusted; nothing is run then.
    daebench.studies.certificate.verify.Unverified
        If it is damaged or of another version, or if its code or a problem file is missing or differs; nothing is run then.

    Examples
    --------
    >>> import tempfile
    >>> import daebench
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     certificate = daebench.certify("rattle", problems=["planar_pendulum:horizontal"], out=folder)
    ...     verification = daebench.verify_certificate(folder)
    >>> verification.agrees
    True
    """
    certificate = read(Path(path))
    measured_code = code_in(certificate)
    admit(certificate.folder / NAME, foreign_names(certificate, measured_code), Trust.of(trust, code))
    listed = certificate.content["problems"]
    files = {name: content for problem in listed for name, content in files_in(certificate.folder, problem["files"]).items()}
    answers = measured(measured_code, [_task(certificate, problem) for problem in listed], files, seconds_limit, progress)
    pairs = [(problem, pair) for problem, answer in zip(listed, answers, strict=True) for pair in _compared(problem, answer)]
    faults = tuple(_sentence(problem, pair) for problem, pair in pairs if pair.verdict == DIFFERS)
    problems = tuple({**problem, **answer} for problem, answer in zip(listed, answers, strict=True))
    numbers = [pair.verdict for _, pair in pairs if pair.is_number]
    return Verification(certificate, problems, numbers.count(EQUAL), numbers.count(WITHIN), faults)


def foreign_names(certificate: Certificate, code: Code) -> list[ForeignName]:
    """Return the names of the method and of the problems of a certificate, with the files beside it that they lead to."""
    problems = [ForeignName(problem["problem"], False, problem["files"]) for problem in certificate.content["problems"]]
    return [ForeignName(certificate.method, True, digests(code.files), code.is_alone), *problems]


def _task(certificate: Certificate, problem: Mapping[str, Any]) -> dict[str, Any]:
    """Return the task of measuring again."""
    content = certificate.content
    return {
        **{name: content[name] for name in ("options", "anyway", "claims")},
        "on_singular": content.get("on_singular"),  # certificates of earlier versions have none
        **{name: problem[name] for name in ("problem", "case", "guessed")},
        "parameters": problem["changed"],
        "setting": problem.get("setting"),
        "h": problem["h"],
    }


def _compared(problem: Mapping[str, Any], answer: Mapping[str, Any]) -> Iterator[Compared]:
    """Compare the numbers of a problem with those of an answer; whether there are any is the first question."""
    if "refused" in answer or "refused" in problem:
        return compare(problem.get("refused", "measured"), answer.get("refused", "measured"), allowance({}, {}))
    certified, new = ({name: part[name] for name in ONCE} | part["numbers"] for part in (problem, answer))
    return compare(certified, new, allowance(answer["within"], answer["elsewhere"]))


def _sentence(problem: Mapping[str, Any], pair: Compared) -> str:
    """Return a disagreement in words."""
    place = (title(problem), *(f"number {key + 1}" if isinstance(key, int) else key[:80] for key in pair.place))
    old, new = ("nothing" if value is None else repr(value)[:120] for value in (pair.old, pair.new))
    return f"{' of '.join(reversed(place))} is {old} in the certificate, and {new} when measured again"

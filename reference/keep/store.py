"""Store of references: one folder each, with a CSV of digits and a JSON certificate, which are checked whenever they are read."""

import csv
import json
import os
import re
import shutil
import textwrap
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from daebench.errors import BadInput, DaebenchError, unknown
from daebench.methods.initial_value_problem import initial_value_problem
from daebench.records.seals import checksum, sealed, sha256, words
from daebench.reference.keep.form import NAME, folders, require_form, require_name
from daebench.reference.keep.record import Reference
from daebench.runs.files import named
from daebench.runs.json_values import strict
from daebench.runs.schema import WrongField, shown

CERTIFICATE = "certificate.json"
LONGEST = 160
"""Most characters of a value in a message."""

LARGEST = 2**27
"""Most bytes of a file of a reference."""

FORMAT = 1
"""Version of the layout of both files."""

UNPRINTABLE = re.compile(rb"[^\t\n\r -~]|\\u00[01789]|\\u20|\\[bf]")
"""Characters, and their escapes in JSON, that would overwrite or reverse the text of a terminal; a reference contains none of them."""

RESTORE = "restore it from where it came, or build the reference again"


class Damaged(DaebenchError):
    """A stored reference that is not as it was written; the message names the file and the expected content."""


class Misshapen(Damaged):
    """A stored reference with checksums that fit, in which a field is not what daebench writes; the message names it."""


def names(folder: Path | None = None) -> tuple[str, ...]:
    """Return the names of all references, PROBLEM-CASE, in alphabetical order.

    Parameters
    ----------
    folder : Path, optional
        Folder of references; by default those of daebench, and the user's own.

    Raises
    ------
    BadInput
        If the folder does not exist.

    Examples
    --------
    >>> len(names()) > 40, "spherical_pendulum-fig1.2" in names()
    (True, True)
    """
    return tuple(sorted({name for place in folders(folder) for name in _names(place)}))


def _names(folder: Path) -> set[str]:
    return {_plain(path.parent.name) for path in folder.glob(f"*/{CERTIFICATE}") if _is_reference(path.parent.name)}


def kept_in(name: str, folder: Path | None = None) -> Path:
    """Return the folder of the reference of this name; a reference of daebench takes precedence over the user's own."""
    require_name(name)
    for place in folders(folder):
        if name in _names(place):
            return place
    raise unknown("reference", name, names(folder))


def load(name: str, folder: Path | None = None) -> Reference:
    """Return the reference of this name.

    Parameters
    ----------
    name : str
        PROBLEM-CASE, for example "spherical_pendulum-fig1.2".
    folder : Path, optional
        Folder of references; by default those of daebench, and the user's own.

    Raises
    ------
    BadInput
        If there is no such reference; the message gives the nearest names.
    Damaged
        If a file is missing, truncated or altered.

    Examples
    --------
    >>> reference = load("spherical_pendulum-fig1.2")
    >>> reference.t[:3].tolist(), reference.q.shape[1]
    ([0.0, 0.125, 0.25], 3)
    """
    place = kept_in(name, folder)
    try:
        return _loaded(name, place)
    except Damaged:  # or replaced by a new one between its two files
        return _loaded(name, place)


def _loaded(name: str, folder: Path) -> Reference:
    place = _place(name, folder)
    certificate = _certificate(place / CERTIFICATE)
    _require(place / CERTIFICATE, "name", name, certificate["name"])
    _require(place / CERTIFICATE, "data file", f"{name}.csv", certificate["data"]["file"])
    data = place / f"{name}.csv"
    content = _read(data)
    _require(data, "SHA-256", certificate["data"]["sha256"], sha256(content))
    try:
        header, *rows = csv.reader(content.decode("ascii").splitlines())
        text = dict(zip(header, (list(column) for column in zip(*rows, strict=True)), strict=True))
    except ValueError as error:
        raise Damaged(f"{data} is truncated or altered: {error}; {RESTORE}.", "reference-data-damaged") from error
    try:
        require_form(certificate, text)
    except WrongField as error:
        raise Misshapen(f"{place} is not a reference that daebench wrote: {error}; {RESTORE}.", "not-a-reference") from error
    return Reference(name, certificate, text)


def find(problem: str, case: str | None = None, folder: Path | None = None) -> Reference:
    """Return the reference of a problem's case, by default of its first case.

    Parameters
    ----------
    problem : str
        Name in the catalogue.
    case : str, optional
        Named initial values.
    folder : Path, optional
        Folder of references; by default those of daebench, and the user's own.

    Raises
    ------
    BadInput
        If the problem or case is unknown, or has no reference; the message says how to build one.
    Damaged
        As in :func:`load`.

    Examples
    --------
    >>> find("double_pendulum").name
    'double_pendulum-horizontal'
    """
    ivp = initial_value_problem(problem, case)
    name = f"{ivp.problem}-{ivp.case}"
    if name not in names(folder):
        references = [reference for reference in names(folder) if reference.startswith(f"{ivp.problem}-")]
        known = f"its references are {', '.join(references)}" if references else f"{ivp.problem} has none yet"
        advice = f"make it with: daebench reference build {name}" if NAME.fullmatch(name) else "only problems with a name have references"
        raise BadInput(f"there is no reference {name}; {known}; {advice}.", "no-reference")
    reference = load(name, folder)
    reference.require_sizes(ivp)
    return reference


def save(name: str, certificate: Mapping[str, Any], text: Mapping[str, Sequence[str]], folder: Path) -> Path:
    """Write a reference, replacing one of this name if there is one, and return its folder.

    Both files are written beside the old ones, and replace them at the end: a crash leaves the old reference.
    """
    require_name(name)
    new, old = folder / f".{name}.new-{os.getpid()}", _old(name, folder)
    shutil.rmtree(new, ignore_errors=True)
    place = folder / name
    try:
        with named(place, new):
            new.mkdir(parents=True)
            content = digits(text)
            (new / f"{name}.csv").write_bytes(content)
            data = {"file": f"{name}.csv", "sha256": sha256(content), "columns": list(text), "rows": len(text["t"])}
            whole = {"format": FORMAT, "name": name, **certificate, "data": data}
            (new / CERTIFICATE).write_text(written(sealed(whole)), encoding="ascii")
            if place.exists():
                shutil.rmtree(old, ignore_errors=True)
                place.rename(old)
            new.rename(place)
    finally:
        shutil.rmtree(new, ignore_errors=True)
    shutil.rmtree(old, ignore_errors=True)
    return place


def digits(text: Mapping[str, Sequence[str]]) -> bytes:
    """Return columns of decimal strings as the content of a CSV file."""
    return "".join(",".join(row) + "\n" for row in [list(text), *zip(*text.values(), strict=True)]).encode("ascii")


def written(certificate: Mapping[str, Any]) -> str:
    """Return a certificate as text: one line for each entry, and one for each row of numbers."""
    return f"{_lines(certificate, _entry)}\n"


def _lines(entries: Mapping[str, Any], value: Callable[[Any], str]) -> str:
    inner = ",\n".join(f"{json.dumps(key)}: {value(entry)}" for key, entry in entries.items())
    return "{\n" + textwrap.indent(inner, "  ") + "\n}"


def _entry(value: Any) -> str:
    return _lines(value, _rows) if isinstance(value, Mapping) else _rows(value)


def _rows(value: Any) -> str:
    if isinstance(value, list) and value and isinstance(value[0], list | dict):
        return "[\n" + textwrap.indent(",\n".join(json.dumps(row) for row in value), "  ") + "\n]"
    return json.dumps(value)


def _certificate(path: Path) -> dict[str, Any]:
    try:
        certificate = strict(_read(path))
        expected, layout = certificate["checksum"], certificate["format"]
        _ = certificate["data"]["file"], certificate["data"]["sha256"], certificate["name"]
    except (ValueError, KeyError, TypeError) as error:
        raise Damaged(f"{path} is truncated or altered: {words(error)}; {RESTORE}.", "reference-certificate-damaged") from error
    _require(path, "checksum", expected, checksum(certificate))
    if layout != FORMAT:
        raise Damaged(
            f"{path} has layout {shown(layout)}, but this version of daebench reads layout {FORMAT}; build the reference again.",
            "reference-of-other-layout",
        )
    return dict(certificate)


def _require(path: Path, what: str, expected: Any, actual: Any) -> None:
    if expected != actual:
        words = [value if isinstance(value, str) and len(value) <= LONGEST else shown(value) for value in (expected, actual)]
        raise Damaged(
            f"{path} is truncated or altered: its {what} should be {words[0]} and is {words[1]}; {RESTORE}.", "reference-digest-wrong"
        )


def _read(path: Path) -> bytes:
    try:
        if path.stat().st_size > LARGEST:
            raise Damaged(f"{path} is larger than {LARGEST >> 20} MB, which no reference is; {RESTORE}.", "reference-too-large")
        content = path.read_bytes()
    except OSError as error:
        raise Damaged(f"{path} cannot be read ({error.strerror}); {RESTORE}.", "reference-unreadable") from error
    if unprintable := UNPRINTABLE.search(content):
        raise Damaged(
            f"{path} is truncated or altered: it has {unprintable[0]!r}, which is unsafe for a terminal; {RESTORE}.",
            "reference-unprintable",
        )
    return content


def _old(name: str, folder: Path) -> Path:
    """Return the place of the old reference while the new one replaces it."""
    return folder / f".{name}.old"


def _is_reference(entry: str) -> bool:
    return not entry.startswith(".") or entry.endswith(".old")


def _plain(entry: str) -> str:
    return entry.removeprefix(".").removesuffix(".old") if entry.startswith(".") else entry


def _place(name: str, folder: Path) -> Path:
    """Return the folder of a reference, or the place of its old version if the replacement was interrupted."""
    place = folder / name
    return place if (place / CERTIFICATE).exists() else _old(name, folder)

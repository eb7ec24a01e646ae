"""The code of methods from outside in an archive: its files below ``code/``, and the names that lead to them there."""

import shlex
from collections.abc import Collection, Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path

from daebench.errors import BadInput
from daebench.methods.foreign import ForeignName
from daebench.methods.outside.read import FILE, PROGRAM, is_outside
from daebench.records.code import code_of

FOLDER = "code"
"""Folder of an archive with the files of methods from outside, a folder for each of them."""


@dataclass(frozen=True)
class Gathered:
    """The code of methods from outside.

    Parameters
    ----------
    names : mapping of str to str
        Names in the archive, by those in the study.
    files : mapping of str to bytes
        Files by their paths in the archive.
    executable : tuple of str
        Those that are started as programs.
    without : mapping of str to str
        Methods whose code is not in the archive, and why.
    """

    names: Mapping[str, str]
    files: Mapping[str, bytes] = field(repr=False)
    executable: tuple[str, ...]
    without: Mapping[str, str]


def gathered(methods: Iterable[str]) -> Gathered:
    """Return the code of the methods from outside among some; its files are read, and nothing is executed."""
    names: dict[str, str] = {}
    files: dict[str, bytes] = {}
    executable: list[str] = []
    without: dict[str, str] = {}
    for k, method in enumerate(filter(is_outside, methods), 1):
        try:
            code = code_of(method)
        except BadInput as error:
            without[method] = str(error)
            continue
        place = f"{FOLDER}/{k}"
        names[method] = _moved(code.method, place, code.files)
        files |= {f"{place}/{name}": content for name, content in code.files.items()}
        executable += [f"{place}/{name}" for name in sorted(code.executable)]
    return Gathered(names, files, tuple(executable), without)


def _moved(method: str, place: str, files: Collection[str]) -> str:
    """Return the name of a method whose files are in another place."""
    if not method.startswith(PROGRAM):
        return f"./{place}/{method.removeprefix('./')}"
    words = shlex.split(method.removeprefix(PROGRAM))
    return PROGRAM + shlex.join([f"./{place}/{word.removeprefix('./')}" if word.removeprefix("./") in files else word for word in words])


def placed(method: str, folder: Path) -> str:
    """Return the name of a method of an archive that is unpacked into a folder."""
    if not is_outside(method):
        return method
    if not method.startswith(PROGRAM):
        return str(folder / method)
    words = shlex.split(method.removeprefix(PROGRAM))
    return PROGRAM + shlex.join([str(folder / word) if word.startswith(f"./{FOLDER}/") else word for word in words])


def foreign_method(method: str, digests: Mapping[str, str], executable: Collection[str]) -> ForeignName:
    """Return the name of a method in an archive, with the files in the archive that it leads to; there are none if it leads elsewhere.

    Parameters
    ----------
    method : str
        The name.
    digests : mapping of str to str
        SHA-256 of all files of the archive.
    executable : collection of str
        Those of them that are started as programs.
    """
    words = list(_words(method))
    inside = [word.removeprefix("./") for word in words if word.removeprefix("./") in digests and word.startswith(f"./{FOLDER}/")]
    starts = not method.startswith(PROGRAM) or words[:1] == [word for word in words[:1] if word.removeprefix("./") in executable]
    by_name = bool(words) and not set(words[0]) & {"/", "\\"}
    folders = {tuple(name.split("/")[:2]) for name in inside}
    files = {name: digest for name, digest in digests.items() if tuple(name.split("/")[:2]) in folders}
    return ForeignName(method, True, files if inside and (starts or by_name) else {}, whole=starts and len(inside) == len(words))


def _words(method: str) -> Iterator[str]:
    """Give the file of a function, or the words of a program with its arguments."""
    if method.startswith(PROGRAM):
        try:
            yield from shlex.split(method.removeprefix(PROGRAM))
        except ValueError:  # nothing that a shell would take
            return
    elif match := FILE.fullmatch(method):
        yield match["path"]

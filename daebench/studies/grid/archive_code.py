"""The code of methods from outside in an archive: its files below ``code/``, and the names that lead to them there."""

from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path

from daebench.errors import BadInput
from daebench.methods.foreign import ForeignName
from daebench.methods.outside.read import is_outside
from daebench.records.code import Code, code_of, renamed, words_of

FOLDER = "code"
"""Folder of an archive with the files of methods from outside, a folder for each of them."""


@dataclass(frozen=True)
class Gathered:
    """The code of methods from outside."""

    names: Mapping[str, str]
    """Names in the archive, by those in the study."""
    files: Mapping[str, bytes] = field(repr=False)
    """Files by their paths in the archive."""
    executable: tuple[str, ...]
    """Those that are started as programs."""
    without: Mapping[str, str]
    """Methods whose code is not in the archive, and why."""


def gathered(methods: Iterable[str]) -> Gathered:
    """Return the code of the methods from outside among some; its files are read, and nothing is executed."""
    codes: dict[str, Code] = {}
    without: dict[str, str] = {}
    for k, method in enumerate(filter(is_outside, methods), 1):
        try:
            codes[method] = code_of(method).below(f"{FOLDER}/{k}")
        except BadInput as error:
            without[method] = str(error)
    files = {name: content for code in codes.values() for name, content in code.files.items()}
    executable = tuple(name for code in codes.values() for name in sorted(code.executable))
    return Gathered({method: code.method for method, code in codes.items()}, files, executable, without)


def placed(method: str, folder: Path) -> str:
    """Return the name of a method of an archive that is unpacked into a folder."""
    return renamed(method, lambda word: str(folder / word) if word.startswith(f"./{FOLDER}/") else word)


def foreign_method(method: str, files: Mapping[str, bytes], digests: Mapping[str, str], executable: Collection[str]) -> ForeignName:
    """Return the name of a method in an archive, with the digests of the files in it that it leads to; none if it leads elsewhere.

    ``executable`` are the names of files in the archive that are started as programs.
    """
    inside = {name: content for name, content in files.items() if name.startswith(f"{FOLDER}/")}
    code = Code(method, inside, frozenset(executable))
    folders = {tuple(word.split("/")[1:3]) for word in words_of(method) if word.removeprefix("./") in inside}
    beside = {name: digest for name, digest in digests.items() if tuple(name.split("/")[:2]) in folders}
    return ForeignName(method, True, beside if code.is_beside else {}, code.is_alone)

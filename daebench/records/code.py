"""The code that numbers were made by: that of daebench and the libraries, and files from outside, gathered into a folder of their own."""

import inspect
import os
import platform
import shlex
import shutil
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import Any

from daebench.compiler.cache import toolchain
from daebench.errors import BadInput
from daebench.methods.outside.read import FILE, PROGRAM, command, is_outside
from daebench.records.seals import digest
from daebench.runs.provenance import versions
from daebench.systems.files import package
from daebench.systems.files.execute import existing, is_path
from daebench.systems.files.imports import imported

LARGEST = 2**28
"""Most bytes of the files of a code."""

DECIDING = ("numpy", "scipy", "llvmlite", "scikit-sundae", "mpmath", "heyoka", "solve_dae")
"""Packages whose versions may change a number."""

SHOWING = ("cli", "draw", "pages", "reports")
"""Folders of this package that only choose runs and show what they gave; so do files of figures."""


@cache
def made_by() -> str:
    """Return the makers of the numbers of a run besides its definition: this package's code, the libraries and the machine's kind."""
    libraries = (f"{name} {versions().get(name, 'none')}" for name in DECIDING)
    return "\n".join((toolchain(), code_digest(), platform.machine(), *libraries))


@cache
def code_digest() -> str:
    """Return the hash of the files of this package that decide numbers."""
    return package.digest_of_files((name, file.read_bytes()) for name, file in sorted(deciding_files().items()))


def deciding_files() -> dict[str, Path]:
    """Return the files that decide numbers, by their paths in the package, which are the same in a checkout and where it is installed."""
    return {name: file for name, file in package.files(".py").items() if not _shows(Path(name))}


def _shows(file: Path) -> bool:
    return not {*SHOWING}.isdisjoint(file.parts) or file.stem.endswith(("figure", "figures"))


@cache
def code_version() -> str:
    """Return the hash of :func:`made_by`."""
    return digest(made_by())


@dataclass(frozen=True)
class Code:
    """A code that is run, by an address that is valid in the folder of its files."""

    method: str
    """``./mine.py:step``, ``./libmine.so:step``, ``exec:./program``, or the name of a method of daebench."""
    files: Mapping[str, bytes] = field(default_factory=dict, repr=False)
    """Its files by their paths in the folder; none of a method of daebench."""
    executable: frozenset[str] = frozenset()
    """Those that are started as programs."""

    @property
    def digest(self) -> str:
        """SHA-256 of the names and contents of the files; of a method of daebench that of the package."""
        return package.digest_of_files(sorted(self.files.items())) if self.files else code_digest()

    @property
    def of_daebench(self) -> bool:
        """Whether it is a method of daebench."""
        return not self.files

    @property
    def is_beside(self) -> bool:
        """Whether the address leads to one of the files, or is a method of daebench."""
        first, *rest = words_of(self.method) or [""]
        if not is_outside(self.method):
            return self.of_daebench
        if not self.method.startswith(PROGRAM):
            return self._has(first)
        return self._starts(first) if set(first) & {"/", "\\"} else any(map(self._has, rest))

    @property
    def is_alone(self) -> bool:
        """Whether nothing but the files is executed: no program that is found by its name, and no other words given to one."""
        first, *rest = words_of(self.method) or [""]
        return not self.method.startswith(PROGRAM) or (self._starts(first) and all(map(self._has, rest)))

    def _has(self, word: str) -> bool:
        """Return whether a word is the path of one of the files."""
        return word.startswith("./") and word[2:] in self.files

    def _starts(self, word: str) -> bool:
        return self._has(word) and word[2:] in self.executable

    def below(self, folder: str) -> "Code":
        """Return the same code in a folder of another."""
        files = {f"{folder}/{name}": content for name, content in self.files.items()}
        method = renamed(self.method, lambda word: f"./{folder}/{word[2:]}" if self._has(word) else word)
        return Code(method, files, frozenset(f"{folder}/{name}" for name in self.executable))

    def put(self, folder: Path) -> None:
        """Write the files into a folder."""
        put(self.files, folder, self.executable)


def words_of(method: str) -> list[str]:
    """Return the file of a function, or a program and its arguments; nothing for what no shell would take, and for other names."""
    if method.startswith(PROGRAM):
        try:
            return shlex.split(method.removeprefix(PROGRAM))
        except ValueError:
            return []
    match = FILE.fullmatch(method)
    return [match["path"]] if match else []


def renamed(method: str, change: Callable[[str], str]) -> str:
    """Return the name of a method with its file, or the words of its program, changed."""
    words = list(map(change, words_of(method)))
    if method.startswith(PROGRAM):
        return PROGRAM + shlex.join(words)
    return f"{words[0]}:{method.rpartition(':')[2]}" if words else method


def put(files: Mapping[str, bytes], folder: Path, executable: Collection[str] = ()) -> None:
    """Write files into a folder, by their paths there, some of which can be started as programs."""
    for name, content in files.items():
        place = folder / name
        place.parent.mkdir(parents=True, exist_ok=True)
        place.write_bytes(content)
        if name in executable:
            place.chmod(0o755)


def code_of(method: str | Callable[..., Any], files: Iterable[str | Path] = ()) -> Code:
    """Return the code at an address with its files, which are read and not executed."""
    address = method if isinstance(method, str) else _address(method)
    others = [existing(str(file), "data", "ls") for file in files]
    if not is_outside(address):
        if is_path(address):
            raise BadInput(
                f"{address} is not code that can be called; give FILE.py:NAME or LIBRARY.so:NAME, or exec:PROGRAM.", "not-callable-code"
            )
        if others:
            raise BadInput(
                f"{address} is a method of daebench, and {others[0]} is not part of it; leave the file out.", "files-beside-own-method"
            )
        return Code(address)
    return _program(address, others) if address.startswith(PROGRAM) else _file(address, others)


def _address(code: Callable[..., Any]) -> str:
    """Return the address of a function of a file."""
    name = getattr(code, "__qualname__", type(code).__qualname__)
    try:
        file = inspect.getsourcefile(code)
    except TypeError:
        file = None
    if file is None or not name.isidentifier() or not Path(file).is_file():
        raise BadInput(
            f"{name} is not at the top of a file, and a certificate needs its file; write it into one, and give FILE.py:NAME.",
            "method-not-top-level",
        )
    return f"{file}:{name}"


def _file(address: str, others: Sequence[Path]) -> Code:
    """Return the code in a Python file or a library."""
    match = FILE.fullmatch(address)
    assert match is not None
    path = existing(match["path"], "method", "daebench list methods")
    imports = imported(path.absolute()) if match["ending"] == "py" else []
    return Code(f"./{path.name}:{match['name']}", _gathered(path, [*imports, *others]))


def _program(address: str, others: Sequence[Path]) -> Code:
    """Return a program with its arguments: what is found on the PATH is called by its name, and is not a part of the code."""
    program, (first, *rest) = command(address)
    arguments = [Path(word) if Path(word).is_file() else None for word in rest]
    scripts = [path for path in arguments if path is not None]
    interpreter = _is_on_path(first)
    if interpreter and not scripts:
        raise BadInput(
            f"{address}: {first} is on the PATH, and a certificate needs a separate file; give its path, for example exec:./program.",
            "program-on-path",
        )
    main = scripts[0] if interpreter else Path(program)
    near = [file for path in scripts if path.suffix == ".py" for file in imported(path.absolute())]
    contents = _gathered(main, [*scripts, *near, *others])
    words = [Path(first).name if interpreter else f"./{main.name}"]
    words += [word if path is None else f"./{_place(path, main)}" for word, path in zip(rest, arguments, strict=True)]
    return Code(PROGRAM + shlex.join(words), contents, frozenset() if interpreter else frozenset({main.name}))


def _is_on_path(program: str) -> bool:
    """Return whether a program is found by its name alone: it belongs to the machine, and not to who wrote the code."""
    by_name = shutil.which(Path(program).name, path=os.environ.get("PATH"))
    by_path = shutil.which(program)
    return by_name is not None and by_path is not None and Path(by_name).resolve() == Path(by_path).resolve()


def _gathered(main: Path, others: Iterable[Path]) -> dict[str, bytes]:
    """Return the contents of files by their places beside the first."""
    contents: dict[str, bytes] = {}
    paths: dict[str, Path] = {}
    for path in [main, *others]:
        name = _place(path, main)
        if paths.setdefault(name, path.resolve()) != path.resolve():
            raise BadInput(f"{path} and {paths[name]} would both be put at {name} beside the code; rename one.", "files-of-one-place")
        try:
            contents[name] = path.read_bytes()
        except OSError as error:
            raise BadInput(f"{path} cannot be read ({error.strerror}); give a file that can.", "certified-file-unreadable") from error
    if sum(map(len, contents.values())) > LARGEST:
        raise BadInput(
            f"the files of {main} are larger than {LARGEST >> 20} MB; a certificate has a copy of them: leave some out.",
            "certified-files-too-large",
        )
    return contents


def _place(path: Path, main: Path) -> str:
    """Return the path of a file seen from the folder of the main one, its name alone where it is not in it."""
    root, path = main.absolute().parent.resolve(), path.absolute()
    near = path.parent.resolve() / path.name
    return near.relative_to(root).as_posix() if near.is_relative_to(root) else path.name

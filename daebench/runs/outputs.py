"""Output files of a command: each is described by a text that is written before it, and replaces no file of somebody else unasked."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass, field, replace
from pathlib import Path

from daebench.errors import BadInput
from daebench.runs.files import before_rename
from daebench.runs.provenance import beside, write_beside

MAKER = "Made by: "
"""Beginning of the line that says which command made a file."""

PICTURES = "Pictures: "
"""Beginning of the line of a table's text that names the pictures of the table, which have no text of their own."""

COMMAND = "Command: "
"""Beginning of the line with the command line, from which the command is known where an older version wrote the text."""


@dataclass(frozen=True)
class Writer:
    """The command that writes files."""

    command: str = ""
    """Words of the command, for example "daebench run"; "" outside of a command: a caller in Python answers for its paths."""
    overwrite: bool = True
    """Whether it may replace files that it did not write."""
    texts: Mapping[Path, Mapping[str, str]] = field(default_factory=dict)
    """Files that get a text beside them, and its lines."""


_writer: ContextVar[Writer] = ContextVar("_writer", default=Writer())  # noqa: B039  it is frozen


@contextmanager
def writing(command: str, *, overwrite: bool) -> Iterator[None]:
    """Name the command that writes the files of a block, and say whether it may replace files that it did not write."""
    token = _writer.set(Writer(command, overwrite))
    try:
        yield
    finally:
        _writer.reset(token)


@contextmanager
def described(paths: Iterable[Path], about: Mapping[str, str], pictures: Sequence[Path] = ()) -> Iterator[None]:
    """Write the text beside each of some files before the file, when :func:`daebench.runs.files.atomic` writes it in the block.

    An interruption then leaves no file without its text, and the same command can be given again.
    """
    writer, files = _writer.get(), [*paths]
    # All are checked before the first is written: a refusal leaves nothing half replaced.
    for file in (*files, *pictures):
        require_own(file)
    lines = {MAKER.strip(": "): writer.command} if writer.command else {}
    lines |= {PICTURES.strip(": "): ", ".join(picture.name for picture in pictures)} if pictures else {}
    texts = {file: {**lines, **writer.texts.get(file, {}), **about} for file in files}
    token = _writer.set(replace(writer, texts={**writer.texts, **texts}))
    try:
        with before_rename(_write_text):
            yield
    finally:
        _writer.reset(token)


def _write_text(path: Path, scratch: Path) -> None:
    texts = _writer.get().texts
    if path in texts:
        write_beside(path, texts[path], scratch)


def require_own(path: Path, option: str = "--out") -> None:
    """Check that an output file is new, or was made by the same command according to the text beside it, and that text likewise.

    BadInput is raised if another command made it, or if there is no such text, unless any file may be replaced.
    """
    writer = _writer.get()
    if writer.overwrite:
        return
    text = beside(path)
    if path.exists() and not _made(path, writer.command):
        maker = _maker(text)
        whose = f"{maker} made it" if maker else f"nothing beside it says that {writer.command} made it"
        raise taken(f"{option} {path}".strip(), whose)
    if text.exists() and not path.exists() and not _lines(text)[0].startswith(f"{path.name} was made by daebench "):
        raise taken(f"{option} {text}".strip(), f"{writer.command} writes there how {path.name} was made")


def require_own_folder(path: Path, *, own: bool) -> None:
    """Check that a folder of output is new or empty, or the command's own; raise BadInput otherwise, unless any file may be replaced."""
    if _writer.get().overwrite or own or not path.exists() or all(entry.name.startswith(".") for entry in path.iterdir()):
        return
    raise BadInput(
        f"--out {path}: the folder has files of another kind; choose another folder, or add --overwrite to replace them.",
        "folder-of-other-files",
    )


def taken(place: str, whose: str) -> BadInput:
    """Return the error for a file or folder that a command did not write and would replace."""
    return BadInput(f"{place}: the file exists, and {whose}; choose another name, or add --overwrite to replace it.", "output-file-taken")


def _made(path: Path, command: str) -> bool:
    """Return whether a command made a file, according to the text beside it, or beside the table of which it is the picture."""
    if _by(_maker(beside(path)), command):
        return True
    table = beside(path.with_suffix(".csv"))
    return path.name in _line(table, PICTURES).split(", ") and _by(_maker(table), command)


def _by(maker: str, command: str) -> bool:
    # With a space, so that "daebench run" is no beginning of "daebench runs".
    return f"{maker} ".startswith(f"{command} ")


def _maker(text: Path) -> str:
    """Return the command that made a file, according to the text beside it; "" if there is none."""
    return _line(text, MAKER) or _line(text, COMMAND)


def _line(text: Path, beginning: str) -> str:
    """Return the rest of the first line of a text that begins so; "" if there is none."""
    return next((line.removeprefix(beginning).strip() for line in _lines(text) if line.startswith(beginning)), "")


def _lines(text: Path) -> list[str]:
    """Return the lines of a text, [""] if it cannot be read."""
    try:
        return text.read_text(encoding="utf-8", errors="replace").splitlines() or [""]
    except OSError:
        return [""]

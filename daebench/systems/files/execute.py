"""The user's own files: they are executed with the files beside them that they import, and mistakes are reported with their place."""

import contextlib
import os
import sys
import traceback
import types
from collections.abc import Callable, Iterable, Iterator
from contextvars import ContextVar
from pathlib import Path
from typing import NoReturn

from daebench.errors import LONGEST, BadInput, DaebenchError, Overdue, foreign, in_words
from daebench.systems.files.imports import Fresh

MODELS = (".xml", ".mjcf", ".urdf", ".xacro", ".sdf", ".mo")
"""Endings of the model files of other programs."""


def is_path(name: str) -> bool:
    """Return whether a name is the path of a file: it ends as a Python file or a model does, or contains a path separator."""
    return name.endswith(".py") or is_model(name) or "/" in name or "\\" in name


def is_model(name: str) -> bool:
    """Return whether a name is the path of a model file of another program."""
    return name.endswith(MODELS)


def existing(name: str, what: str, listed: str) -> Path:
    """Return the path of an existing file; otherwise raise BadInput with the kind of file needed and the command that lists names."""
    try:
        path = Path(name).expanduser()
        exists = path.is_file()
    except (OSError, RuntimeError, ValueError):  # too long a name, ~ of an unknown user, a character that no path may contain
        exists = False
    if not exists:
        raise BadInput(
            f"{name}: there is no such file; give the path of a {what} file, or a name that {listed} has.", "no-such-file-or-name"
        )
    return path


_REFUSAL: ContextVar[str] = ContextVar("refusal", default="")
"""Why no code is executed that does not come with daebench; "" where it may be."""


@contextlib.contextmanager
def executing_nothing(refusal: str) -> Iterator[None]:
    """Refuse, for the time of a block, all code that does not come with daebench, with these words after its name."""
    before = _REFUSAL.set(refusal)
    try:
        yield
    finally:
        _REFUSAL.reset(before)


def require_allowed(name: str) -> None:
    """Accept code that may be executed here; raise BadInput with its name if it may not."""
    if refusal := _REFUSAL.get():
        raise BadInput(f"{name} {refusal}", "file-not-allowed")


@contextlib.contextmanager
def telling_exits() -> Iterator[None]:
    """Let ``os._exit`` raise SystemExit for the time of a block, as ``sys.exit`` does; a process that is forked in it still ends."""
    process, leave = os.getpid(), os._exit

    def tell(status: int) -> NoReturn:
        # In a child that was forked meanwhile, os._exit keeps its meaning: it must not run the parent's cleanup.
        if os.getpid() != process:
            leave(status)
        raise SystemExit(f"os._exit({status})")

    os._exit = tell
    try:
        yield
    finally:
        os._exit = leave


def executed(path: Path, name: str) -> types.ModuleType:
    """Return the module of a file, executed once under a name that no other file or content of this file has."""
    if name not in sys.modules:
        require_allowed(str(path))
        module = types.ModuleType(name, None)
        module.__file__ = str(path)
        sys.modules[name] = module  # before it is executed: dataclasses look up the module of their class
        exec(Fresh(name, str(path)).get_code(name), module.__dict__)
    return sys.modules[name]


@contextlib.contextmanager
def naming(
    name: str,
    path: Path,
    user_files: Callable[[], Iterable[Path]],
    wrong: type[DaebenchError],
    passing: tuple[type[BaseException], ...] = (),
) -> Iterator[None]:
    """Turn any error in a file into one sentence with its file and line; printed output goes to standard error.

    The sentence calls the file ``name``, and gives lines of the files that ``user_files`` returns, which include the file itself. The
    exception is of the type ``wrong``; exceptions of the types ``passing`` are not changed.
    """
    try:
        # Standard output belongs to the command, whose JSON a line printed by the file would break.
        with contextlib.redirect_stdout(sys.stderr):
            yield
    except passing:
        raise
    except DaebenchError as error:
        raise wrong(f"{_place(name, path, user_files, error)}: {foreign(str(error), LONGEST)}", error.code, **error.fields) from error
    except SyntaxError as error:
        where = f"{Path(error.filename).name}, line {error.lineno}" if error.filename else "a file that it imports"
        raise wrong(f"{name}: {where} is not Python: {error.msg}.", "user-file-not-python") from error
    except (KeyboardInterrupt, Overdue):
        raise
    # Everything, because a file of the user's own may raise SystemExit or an exception class of its own.
    except BaseException as error:
        raise wrong(f"{_place(name, path, user_files, error)}: {in_words(error)}; correct the file.", "user-file-raises") from error


def _place(name: str, path: Path, user_files: Callable[[], Iterable[Path]], error: BaseException) -> str:
    """Return the file and line of the innermost call in the user's own files."""
    files = {source.resolve() for source in user_files()}
    # From the innermost call outwards: the last line of the user's own files, not the line in SymPy that raised.
    for frame in reversed(traceback.extract_tb(error.__traceback__)):
        file = Path(frame.filename).resolve()
        if file in files:
            place = name if is_path(name) and file == path.resolve() else f"{name}, in {file.name}"
            return f"{place}, line {frame.lineno}"
    return name

"""Files of the user's own: code that is executed, with the files beside it that it imports, and mistakes that are named."""

import contextlib
import sys
import traceback
import types
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path

from daebench.errors import BadInput, DaebenchError
from daebench.systems.files.imports import Fresh


def is_path(name: str) -> bool:
    """Return whether a name is the path of a file: it ends in .py, or has a separator of folders in it."""
    return name.endswith(".py") or "/" in name or "\\" in name


def existing(name: str, what: str, listed: str) -> Path:
    """Return the path of a file that is there; else BadInput says which kind of file it is to be, and which command lists names."""
    try:
        path = Path(name).expanduser()
        there = path.is_file()
    except (OSError, RuntimeError, ValueError):  # a name too long, ~ of a user that there is not, a character that no path has
        there = False
    if not there:
        raise BadInput(f"{name}: there is no such file; give the path of a {what} file, or a name that {listed} has.")
    return path


def executed(path: Path, name: str) -> types.ModuleType:
    """Return the module of a file, run once under a name that no other file or text of this file has."""
    if name not in sys.modules:
        module = types.ModuleType(name, None)
        module.__file__ = str(path)
        sys.modules[name] = module
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
    """Turn whatever goes wrong in a file into one sentence with its file and line; what it prints goes to standard error.

    The sentence calls the file by ``name``, and names lines of the files that ``user_files`` returns, the file itself among them. It is
    an error of the type ``wrong``; errors of the types ``passing`` pass as they are.
    """
    try:
        with contextlib.redirect_stdout(sys.stderr):
            yield
    except passing:
        raise
    except DaebenchError as error:
        raise wrong(f"{_place(name, path, user_files, error)}: {error}") from error
    except SyntaxError as error:
        where = f"{Path(error.filename).name}, line {error.lineno}" if error.filename else "a file that it imports"
        raise wrong(f"{name}: {where} is not Python: {error.msg}.") from error
    except KeyboardInterrupt:
        raise
    except BaseException as error:
        text = " ".join(str(error).split()).rstrip(".")
        what = type(error).__name__ + (f": {text}" if text else "")
        raise wrong(f"{_place(name, path, user_files, error)}: {what}; correct the file.") from error


def _place(name: str, path: Path, user_files: Callable[[], Iterable[Path]], error: BaseException) -> str:
    """Return the file and line of the innermost call in the user's own files."""
    files = {source.resolve() for source in user_files()}
    for frame in reversed(traceback.extract_tb(error.__traceback__)):
        file = Path(frame.filename).resolve()
        if file in files:
            place = name if is_path(name) and file == path.resolve() else f"{name}, in {file.name}"
            return f"{place}, line {frame.lineno}"
    return name

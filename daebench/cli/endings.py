"""Failed commands: one sentence and an exit status for every exception."""

import os
import select
import signal
import sys
import threading
import traceback
from collections.abc import Callable
from pathlib import Path
from typing import Any

import typer

from daebench.cli.console import printable
from daebench.errors import BadInput, DaebenchError, Interrupted, bounded
from daebench.runs.files import FULL

ClickException: type[Exception] = next(base for base in typer.BadParameter.__mro__ if base.__name__ == "ClickException")
"""Base of the errors of the command line itself, in any version of typer."""

INTERRUPTED = 130
"""Status of a command that Ctrl-C ended, which some versions of typer return without a message."""

FAULT = 70
"""Status of a command that a fault of daebench ended, different from other statuses, as in sysexits.h."""

TRACEBACK = "DAEBENCH_TRACEBACK"
"""Environment variable that prints the traceback of a fault."""

STANDARD_OUTPUT = "standard output"

AGAIN = 0.02
"""Seconds after which a Ctrl-C that could not be raised is repeated."""

Ending = tuple[str, int]


def ending(error: BaseException) -> Ending:
    """Return the sentence and the exit status of an exception."""
    if _interrupted(error):
        return "interrupted.", INTERRUPTED
    return next(end(error) for kind, end in ENDINGS if isinstance(error, kind))


def complain(message: str) -> None:
    """Print one sentence on standard error, if it is open."""
    if message and sys.stderr is not None:
        try:
            print(bounded(f"daebench: {printable(' '.join(message.split()))}"), file=sys.stderr, flush=True)
        except OSError:  # no reader
            _discard(sys.stderr)


def keep_interrupts(unraisable: Any) -> None:
    """Repeat a Ctrl-C that came where no exception can be raised, for example in the middle of an import.

    It is repeated a moment later, from another thread: raised here, it would be in the same place and be ignored again.
    """
    if issubclass(unraisable.exc_type, KeyboardInterrupt):
        again = threading.Timer(AGAIN, _interrupt)
        again.daemon = True
        again.start()
    else:
        sys.__unraisablehook__(unraisable)


def _interrupt() -> None:
    """Send Ctrl-C to the main thread, and wake it if it waits."""
    main = threading.main_thread().ident
    if hasattr(signal, "pthread_kill") and main is not None:
        signal.pthread_kill(main, signal.SIGINT)
    else:
        signal.raise_signal(signal.SIGINT)


def _interrupted(error: BaseException) -> bool:
    """Return whether an exception is Ctrl-C, or was made from it by a library that was being loaded."""
    seen: BaseException | None = error
    while seen is not None and not isinstance(seen, DaebenchError):
        if isinstance(seen, KeyboardInterrupt | typer.Abort):
            return True
        seen = seen.__cause__ or seen.__context__ if isinstance(seen, ImportError | SystemError) else None
    return False


def _of_command_line(error: BaseException) -> Ending:
    """Return the message of the command line itself, and a reference to its help."""
    message: str = error.format_message()  # type: ignore[attr-defined]
    return (f"{bounded(message).rstrip('.')}; see daebench --help." if message else ""), 2


def _unread(error: BaseException) -> Ending:
    """Return an empty message if standard output has no reader any more, as after ``| head -1``; any other broken pipe is an error."""
    if _hung_up():
        _discard(sys.stdout)
        return "", 1
    return f"a process or a connection that daebench writes to has ended ({error}); run again.", 1


def _hung_up() -> bool:
    try:
        if not hasattr(select, "poll"):  # on Windows; a command that prints writes to no other pipe
            return True
        poll = select.poll()
        poll.register(sys.stdout.fileno(), select.POLLOUT)
        return any(event & (select.POLLERR | select.POLLHUP) for _, event in poll.poll(0))
    except (OSError, ValueError, AttributeError):
        return False


def _printing(error: BaseException) -> bool:
    """Return whether an exception was raised in printing: commands write nothing else to a stream, and files have names."""
    last = traceback.extract_tb(error.__traceback__)[-1:]
    return any(Path(frame.filename).parent.name in ("cli", "reference", "rich") for frame in last)


def _discard(stream: Any) -> None:
    """Redirect a closed stream to nowhere, because Python complains at exit otherwise."""
    try:
        os.dup2(os.open(os.devnull, os.O_WRONLY), stream.fileno())
    except (OSError, ValueError, AttributeError):
        return


def _of_file(error: BaseException) -> Ending:
    assert isinstance(error, OSError)
    place = error.filename
    if place is None and _printing(error):
        place = STANDARD_OUTPUT
        _discard(sys.stdout)
    advice = "; make room, and run again" if error.errno in FULL and place != STANDARD_OUTPUT else ""
    return f"{place or 'a file or connection'}: {error.strerror or error}{advice}.", 2


def _of_memory(error: BaseException) -> Ending:
    why = f" ({error})" if str(error) else ""
    return f"there is not enough memory for this{why}; ask for fewer steps, nodes or members.", 1


def _fault(error: BaseException) -> Ending:
    if os.environ.get(TRACEBACK):
        traceback.print_exception(error)
    *_, last = traceback.extract_tb(error.__traceback__) or [None]
    where = f" in {Path(last.filename).name}, line {last.lineno}" if last else ""
    what = f"{type(error).__name__}: {bounded(str(error))}"
    return f"this is a fault of daebench{where}: {what.rstrip('. ')}; report it with the output of {TRACEBACK}=1.", FAULT


ENDINGS: tuple[tuple[type[BaseException], Callable[[BaseException], Ending]], ...] = (
    (ClickException, _of_command_line),
    (Interrupted, lambda error: (str(error), INTERRUPTED)),
    (BadInput, lambda error: (str(error), 2)),
    (DaebenchError, lambda error: (str(error), 1)),
    (BrokenPipeError, _unread),
    (OSError, _of_file),
    (MemoryError, _of_memory),
    (BaseException, _fault),
)
"""Message of each kind of exception; the first that fits is used."""

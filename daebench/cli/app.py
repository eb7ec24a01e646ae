"""The command line: one file per command, and one place where errors become a sentence and an exit status."""

import sys
import warnings
from collections.abc import Callable
from functools import cache
from typing import Annotated

import typer

from daebench.cli.commands import Commands
from daebench.cli.endings import INTERRUPTED, complain, ending, keep_interrupts

app = typer.Typer(
    cls=Commands,
    no_args_is_help=True,
    invoke_without_command=True,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
    help="What a treatment of constraints costs, and what it breaks.",
)


@app.callback()
def top(version: Annotated[bool, typer.Option("--version", help="Print the version and exit.")] = False) -> None:
    """What a treatment of constraints costs, and what it breaks."""
    if version:
        from importlib.metadata import version as version_of

        print(version_of("daebench"))
        raise typer.Exit


PROCESSES = "daebench.methods.outside.process"
"""The module of processes of code from outside, which is loaded only where there is such code."""


def main() -> None:
    """Run the command line; exit 2 on bad input, 1 on a run that stopped early, 130 on Ctrl-C, and never with a traceback."""
    warnings.showwarning = _say
    sys.unraisablehook = keep_interrupts
    for stream in (sys.stdout, sys.stderr):
        if hasattr(stream, "reconfigure"):
            stream.reconfigure(errors="backslashreplace")  # a character that the terminal's encoding lacks is no reason to stop
    # A process may call this more than once, and what ended in an earlier command is none of this one's.
    if PROCESSES in sys.modules:
        sys.modules[PROCESSES].ended.clear()
    try:
        status = _called() or _ended()
    except (Exception, KeyboardInterrupt) as error:  # noqa: BLE001  each ends as a sentence of its own
        message, status = ending(error)
        complain(message)
    sys.exit(status or 0)


@cache
def _commands() -> Callable[..., int | None]:
    """Return the function that parses and calls a command; it is built from the signatures of all commands, once a process."""
    return typer.main.get_command(app)


def _called() -> int | None:
    try:
        status = _commands()(standalone_mode=False)
    except typer.Exit as stop:
        status = stop.exit_code
    if status == INTERRUPTED:
        raise KeyboardInterrupt
    if sys.stdout is not None:  # it is None if standard output is closed
        sys.stdout.flush()
    return status


def _ended() -> int:
    """Say which code from outside has ended its process, where the command itself has not failed; return the status of that."""
    ended = sys.modules[PROCESSES].ended if PROCESSES in sys.modules else {}
    for name, how in ended.items():
        complain(f"{name}: {how}.")
    return 1 if ended else 0


def _say(message: Warning | str, *_: object, **__: object) -> None:
    complain(str(message))

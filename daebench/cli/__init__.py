"""The command line: one command a file, and one place where errors become a sentence and an exit status."""

import os
import sys
import warnings
from typing import Annotated

import typer

from daebench.cli.animate import animate
from daebench.cli.archive import archive
from daebench.cli.bench import bench
from daebench.cli.check import check
from daebench.cli.compare import compare
from daebench.cli.export import export
from daebench.cli.lesson import lesson
from daebench.cli.listing import listing
from daebench.cli.long import long
from daebench.cli.order import order
from daebench.cli.precision import precision
from daebench.cli.reference import app as reference
from daebench.cli.report import report
from daebench.cli.reproduce import reproduce
from daebench.cli.run import run
from daebench.cli.show import show
from daebench.cli.stability import stability
from daebench.cli.work_precision import work_precision
from daebench.errors import BadInput, DaebenchError, Interrupted

ClickException: type[Exception] = next(base for base in typer.BadParameter.__mro__ if base.__name__ == "ClickException")
"""Base of the errors of the command line itself, wherever this version of typer keeps it."""

INTERRUPTED = 130
"""Status of a command that Ctrl-C ended, which some versions of typer return without a word."""

app = typer.Typer(
    add_completion=False,
    no_args_is_help=True,
    invoke_without_command=True,
    pretty_exceptions_enable=False,
    help="What a treatment of constraints really costs, and what it breaks.",
)


@app.callback()
def top(version: Annotated[bool, typer.Option("--version", help="Print the version and leave.")] = False) -> None:
    """What a treatment of constraints really costs, and what it breaks."""
    if version:
        from importlib.metadata import version as version_of

        print(version_of("daebench"))
        raise typer.Exit


app.command("list")(listing)
for command in (show, run, compare, order, check, precision, stability, long, animate, report, lesson, bench, export, archive, reproduce):
    app.command()(command)
app.command("work-precision")(work_precision)
app.add_typer(reference, name="reference")


def main() -> None:
    """Run the command line; exit 2 on bad input, 1 on a run that stopped early, and never with a traceback of ours."""
    warnings.showwarning = _say
    try:
        status = _called()
    except ClickException as error:
        status = _complain(_sentence(error), 2)
    except Interrupted as error:
        status = _complain(str(error), INTERRUPTED)
    except DaebenchError as error:
        status = _complain(str(error), 2 if isinstance(error, BadInput) else 1)
    except (typer.Abort, KeyboardInterrupt):
        status = _complain("interrupted.", INTERRUPTED)
    except BrokenPipeError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())  # or Python complains at exit
        status = 1
    except OSError as error:
        status = _complain(f"{error.filename or 'output'}: {error.strerror or error}.", 2)
    sys.exit(status or 0)


def _called() -> int | None:
    try:
        status: int | None = app(standalone_mode=False)
    except typer.Exit as stop:
        status = stop.exit_code
    if status == INTERRUPTED:
        raise KeyboardInterrupt
    if sys.stdout is not None:  # it is None where standard output is closed
        sys.stdout.flush()
    return status


def _sentence(error: BaseException) -> str:
    """Return what the command line itself has to say, and where to read on; its help needs no more words."""
    message: str = error.format_message()  # type: ignore[attr-defined]
    return f"{message.rstrip('.')}; see daebench --help." if message else ""


def _complain(message: str, status: int) -> int:
    if message:
        print(f"daebench: {' '.join(message.split())}", file=sys.stderr)
    return status


def _say(message: Warning | str, *_: object, **__: object) -> None:
    print(f"daebench: {message}", file=sys.stderr)

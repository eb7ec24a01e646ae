"""The command of a study: its options are the signature of the study, their help is its docstring, and what it prints is its result."""

import inspect
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Annotated, Any

import typer

import daebench
from daebench.cli import arguments
from daebench.cli.console import Bar, bar, print_json, print_written
from daebench.cli.docstrings import descriptions, introduction
from daebench.cli.folder import Folder
from daebench.cli.own_start import Shown, own_start_of
from daebench.cli.picture_file import OPTIONS, PictureFile, picture_file
from daebench.cli.starts import Box, Distribution, Energy, Grid, Size, settings_of
from daebench.cli.study_arguments import argument_of, expanded, option_of
from daebench.cli.summary import print_part
from daebench.errors import Interrupted
from daebench.runs.files import require_new
from daebench.runs.result import Result

DRAWN = "drawn"
"""Argument of a study with the settings of a distribution of starts, each of which is an option of its own."""

SETTINGS: Mapping[str, Any] = {"size": Size, "box": Box, "energy": Energy}

GRID: Mapping[str, Any] = {"grid": Grid}
"""The setting of a grid of starts, of studies whose argument of settings has the option."""

GENERATE = "generate"
"""Option of a command whose result can be written as code."""

PROGRESS = "progress"
"""Argument of a study that is called with the part of the work that is done."""

EXECUTOR = "executor"
"""Argument of a study, beside ``store``, for what computes stored runs."""

RUNS = "runs"
"""Argument of a study that makes the rows of its runs, at first of all that are known beforehand; the command stores them."""

BESIDE = "beside"
"""Argument of a study for whether its timed runs are made beside others."""

BY_THE_COMMAND = (DRAWN, PROGRESS, RUNS, BESIDE, EXECUTOR)
"""Arguments that are no options; nor is the store beside an executor."""

STORED: Mapping[str, Any] = {
    "store": arguments.Store,
    "workers": arguments.Workers,
    "scheduler": arguments.Scheduler,
    "tls_ca_file": arguments.TlsCaFile,
    "tls_cert": arguments.TlsCert,
    "tls_key": arguments.TlsKey,
}
"""Options of a study whose runs are stored."""


def command_of(function: Callable[..., Any]) -> Callable[..., None]:
    """Return the command of a study: a function with options in the form of typer.

    Parameters
    ----------
    function : callable
        A public function with a docstring that returns a :class:`daebench.runs.result.Result`; or its table, and wraps one that returns a
        result, see :func:`daebench.runs.result.tabular`. Its first argument is given to the command by its place, the others by options.
    """
    study = inspect.unwrap(function)
    parameters = expanded(inspect.signature(study).parameters)
    docstring, names = inspect.getdoc(study) or "", {name: f"--{name.replace('_', '-')}" for name in parameters}
    described = descriptions(docstring, names)
    first, apart = next(iter(parameters)), {*BY_THE_COMMAND, *(["store"] if EXECUTOR in parameters else [])}
    taken = {
        name: argument_of(p, described.get(name, ""), placed=name == first)
        for name, p in parameters.items()
        if name not in apart and _is_option(p)
    }
    settings = {**SETTINGS, **(GRID if option_of(parameters[DRAWN]).names else {})} if DRAWN in parameters else {}
    kind: type[Result] = inspect.signature(study).return_annotation
    title = study.__name__.replace("_", "-")

    def command(*, as_json: bool = False, **given: Any) -> None:
        if given.get(GENERATE):
            require_new(given[GENERATE])
        asked = {name: argument.read(given[name]) for name, argument in taken.items() if given[name] is not None}
        if settings:
            asked["starts"] = "grid" if given.get("grid") and asked["starts"] == Distribution.neighbourhood else asked["starts"]
            asked[DRAWN] = settings_of(asked["starts"], **{name: given[name] for name in settings})
        output, several = _output(kind, asked, given), [name for name, argument in taken.items() if argument.several]
        with (
            _printing_interrupted(as_json=as_json),
            bar(f"{title} {given[first]}") as progress,
            _runs(parameters, output, asked, given, progress) as runs,
        ):
            shown = {PROGRESS: progress, **runs}
            result = _result(partial(study, **{name: shown[name] for name in shown if name in parameters}), asked, several)
        written = output.write(result) if any(kind.outputs()) else None
        made_again = runs[RUNS].made_again if RUNS in runs else None
        _show(result, own_start_of(asked), written, made_again, _generated(result, given.get(GENERATE)), as_json=as_json)
        raise typer.Exit(result.status)

    options = [
        *(argument.parameter for argument in taken.values()),
        *(_optional(*entry) for entry in settings.items()),
        *(_optional(*entry) for entry in _stored(parameters).items()),
        *([_optional("side_by_side", arguments.SideBySide, False)] if BESIDE in parameters else []),
        *([_optional("dry_run", arguments.DryRun, False)] if RUNS in parameters else []),
        *_outputs(kind, f"output/{title}" if RUNS in parameters else None),
    ]
    command.__signature__ = inspect.Signature(options, return_annotation=None)  # type: ignore[attr-defined]
    command.__annotations__ = {option.name: option.annotation for option in options}
    command.__doc__, command.__name__ = introduction(docstring, kind.fails_if, names), study.__name__
    return command


def _is_option(parameter: inspect.Parameter) -> bool:
    """Return whether the command has an option for an argument of a study."""
    return option_of(parameter).command


def _stored(parameters: Mapping[str, Any]) -> Mapping[str, Any]:
    """Return the options of a study whose runs are stored: by default with an executor, or on request in one process."""
    if RUNS in parameters:
        return STORED
    return {**STORED, "workers": arguments.StoredWorkers} if EXECUTOR in parameters else {}


@contextmanager
def _printing_interrupted(*, as_json: bool) -> Iterator[None]:
    """Print the result so far of a study that is interrupted in the block."""
    try:
        yield
    except Interrupted as stop:
        if stop.result and not as_json:
            for part in stop.result.printed():
                print_part(part)
        raise


def _output(kind: type[Result], asked: Mapping[str, Any], given: Mapping[str, Any]) -> Folder | PictureFile:
    """Return the folder of ``--out``, or its one picture."""
    folder = Folder(given["out"] if any(kind.outputs()) else None, *kind.outputs(**asked))
    if not _has_look(kind):
        return folder
    return picture_file(folder.out, len(asked["methods"]), {name: given[name] for name in OPTIONS}) or folder


@contextmanager
def _runs(
    parameters: Mapping[str, Any], output: Any, asked: Mapping[str, Any], given: Mapping[str, Any], progress: Bar
) -> Iterator[Mapping[str, Any]]:
    """Check the output of a study, and yield what its runs are stored and made by; a store of rows checks it before the first of them."""
    if RUNS in parameters:
        from daebench.cli.grids import stored_runs

        with stored_runs(output, given, progress, timed=asked.get("repeat", 0) > 0) as runs:
            yield {RUNS: runs, BESIDE: runs.executors.beside}
        return
    output.check()
    if EXECUTOR in parameters:
        from daebench.cli.executors import storing

        with storing(given) as store:
            yield store
    else:
        yield {}


def _result(study: Callable[..., Any], asked: Mapping[str, Any], several: Sequence[str]) -> Any:
    """Return the result of a study; of several, for the values of an argument, that of all of them together."""
    if not several:
        return study(**asked)
    (name,) = several
    results = [study(**{**asked, name: value}) for value in asked[name]]
    return results[0].together(results)


def _optional(name: str, annotation: Any, default: Any = None) -> inspect.Parameter:
    return inspect.Parameter(name, inspect.Parameter.KEYWORD_ONLY, annotation=annotation, default=default)


def _outputs(kind: type[Result], folder: str | None) -> Iterator[inspect.Parameter]:
    """Yield the options that every study has for its output; a study whose runs are stored has a folder for them."""
    tables, pictures = kind.outputs()
    if tables or pictures:
        alone = "; or FILE.pdf, .svg or .png for the picture alone" if _has_look(kind) else ""
        about = f"the picture, {kind.stem}.svg and .png, with its data, {kind.stem}.csv" if kind.stem else "pictures with their tables"
        listed = f"{', '.join(tables)}{',' if len(tables) > 1 else ''} and " if tables else ""
        about = f"Folder for {listed}{about}{alone}."
        yield _optional("out", Annotated[Path if folder else Path | None, typer.Option("--out", help=about)], folder and Path(folder))
        if alone:
            yield from (_optional(*entry) for entry in OPTIONS.items())
        yield _optional("overwrite", arguments.Overwrite, False)
    if kind.generates:
        yield _optional(GENERATE, Annotated[Path | None, typer.Option("--generate", help="New folder for the choice as code in C.")])
    yield _optional("as_json", arguments.Json, False)


def _has_look(kind: type[Result]) -> bool:
    """Return whether the layout of the picture of a result can be chosen."""
    return "look" in inspect.signature(kind.plot).parameters


def _generated(result: Any, out: Path | None) -> list[str]:
    """Write the answer as code, if a folder for it is named and there is one; return the paths."""
    if out is None:
        return []
    arguments, note = result.to_generate()
    if note:
        print(f"daebench: {note}", file=sys.stderr)
    return [*map(str, daebench.generate(**arguments, out=out).files)] if arguments else []


def _show(
    result: Result,
    start: Shown | None,
    written: Sequence[str] | None,
    made_again: str | None,
    generated: Sequence[str],
    *,
    as_json: bool,
) -> None:
    """Print a result, a start of one's own, which stored runs were made again, and the written files; or all as JSON."""
    if as_json:
        more = {**(start.plain if start else {}), "made_again": made_again, "written": written}
        print_json({**result.summary(), **{name: value for name, value in more.items() if value is not None}})
        return
    for part in [*(start.printed if start else ()), *result.printed(), *([made_again] if made_again else [])]:
        print_part(part)
    print_written([*(written or ()), *generated])

"""The command of a study: its options are the signature of the study, their help is its docstring, and what it prints is its result."""

import inspect
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from copy import copy
from functools import partial
from operator import attrgetter
from pathlib import Path
from types import UnionType
from typing import Annotated, Any, NamedTuple, Union, get_args, get_origin

import typer

import daebench
from daebench.cli import arguments
from daebench.cli.console import Bar, bar, method_names, print_json, print_written
from daebench.cli.docstrings import descriptions, introduction
from daebench.cli.executors import storing
from daebench.cli.folder import Folder
from daebench.cli.integer import whole
from daebench.cli.picture_file import OPTIONS, PictureFile, picture_file
from daebench.cli.starts import Box, Distribution, Energy, Grid, Size, Starts, settings_of
from daebench.cli.summary import print_part
from daebench.errors import BadInput, Interrupted
from daebench.runs.files import require_new
from daebench.runs.option import Option
from daebench.runs.result import Result
from daebench.runs.texts import bounds, numbers, pairs, words

SHARED: Mapping[str, Any] = {
    "problem": arguments.Problem,
    "case": arguments.Case,
    "parameters": arguments.Param,
    "method": arguments.Method,
    "methods": arguments.Methods,
    "options": arguments.Free,
    "compensated": arguments.Compensated,
    "precision": arguments.Precision,
    "on_singular": arguments.OnSingular,
    "project": arguments.Project,
    "algebra": arguments.Algebra,
    "anyway": arguments.Anyway,
    "overwrite": arguments.Overwrite,
    "starts": Starts,
}
"""Arguments that many studies have, with the option of each, which is described once."""

DRAWN = "drawn"
"""Argument of a study with the settings of a distribution of starts, each of which is an option of its own."""

SETTINGS: Mapping[str, Any] = {"size": Size, "box": Box, "energy": Energy}

GRID: Mapping[str, Any] = {"grid": Grid}
"""The setting of a grid of starts, of studies whose argument of settings has the option."""

METHODS = {"method": "", "methods": "; comma-separated"}
"""Arguments that name methods, whose help is that of each study, and what is said there of their form."""

FEW = 6
"""Numbers of a default that a help names."""

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


class Argument(NamedTuple):
    """An argument of a study, as a parameter of its command, and what reads the value that is given there."""

    parameter: inspect.Parameter
    read: Callable[[Any], Any]
    several: bool = False


def command_of(function: Callable[..., Any]) -> Callable[..., None]:
    """Return the command of a study: a function with options in the form of typer.

    Parameters
    ----------
    function : callable
        A public function with a docstring that returns a :class:`daebench.runs.result.Result`; or its table, and wraps one that returns a
        result, see :func:`daebench.runs.result.tabular`. Its first argument is given to the command by its place, the others by options.
    """
    study = inspect.unwrap(function)
    parameters = inspect.signature(study).parameters
    described = descriptions(inspect.getdoc(study) or "", {name: f"--{name.replace('_', '-')}" for name in parameters})
    first, apart = next(iter(parameters)), {*BY_THE_COMMAND, *(["store"] if EXECUTOR in parameters else [])}
    taken = {
        name: _argument(p, described.get(name, ""), placed=name == first)
        for name, p in parameters.items()
        if name not in apart and _is_option(p)
    }
    settings = {**SETTINGS, **(GRID if _option(parameters[DRAWN]).names else {})} if DRAWN in parameters else {}
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
        _show(result, written, made_again, _generated(result, given.get(GENERATE)), as_json=as_json)
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
    command.__doc__, command.__name__ = introduction(inspect.getdoc(study) or "", kind.fails_if), study.__name__
    return command


def _is_option(parameter: inspect.Parameter) -> bool:
    """Return whether the command has an option for an argument of a study."""
    return _option(parameter).command and parameter.kind is not parameter.VAR_KEYWORD


def _option(parameter: inspect.Parameter) -> Option:
    """Return how a command takes an argument."""
    return get_args(parameter.annotation)[1] if get_origin(parameter.annotation) is Annotated else Option()


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


def _argument(given: inspect.Parameter, about: str, *, placed: bool) -> Argument:
    """Return an argument of a study as an option, or as an argument of the command that is given by its place."""
    name, kind, option = given.name, given.annotation, _option(given)
    if get_origin(kind) is Annotated:
        kind = get_args(kind)[0]
    shared, default = f"{name}s" if option.several else name, given.default
    if shared in SHARED and not option.names:
        form, info = get_args(SHARED[shared])
        # A copy, because all commands share the option, and each has a help of its own for it.
        read, info = READERS.get(shared, _same), copy(info)
        if shared in METHODS:
            info.help = f"{about.rstrip('.')}{METHODS[shared]}."
    else:
        names, kind = option.names or (f"--{name.replace('_', '-')}",), _bare(kind)
        about = _with_form(about, kind, default, repeatable=option.repeatable)
        default = None if isinstance(default, tuple) else default  # the study has it to the last digit
        form, read, settings = _form(kind, names[0])
        place = " ".join(option.names) or None
        info = typer.Argument(help=about, metavar=place) if placed else typer.Option(*names, help=about, **settings)
    if option.repeatable:
        form, read = list[_bare(get_args(kind)[0])], list  # type: ignore[misc]
    if option.read:
        form, read = form if option.repeatable else str, option.read
    default = ",".join(default) if isinstance(default, tuple) else default
    annotation: Any = Annotated[form if default is not None else form | None, info]
    return Argument(given.replace(annotation=annotation, default=default, kind=inspect.Parameter.KEYWORD_ONLY), read, option.several)


def _with_form(about: str, kind: Any, default: Any, *, repeatable: bool) -> str:
    """Return the help of an option with the form of several values, and the numbers of its default."""
    form = "; repeatable" if repeatable else "; comma-separated" if get_origin(kind) is Sequence else ""
    form = _between(default) if isinstance(default, tuple) and default else form
    return f"{about.rstrip('.')}{form}." if form else about


def _same(value: Any) -> Any:
    return value


READERS: Mapping[str, Callable[[Any], Any]] = {
    "parameters": partial(pairs, "param"),
    "options": partial(pairs, "option"),
    "methods": method_names,
    "starts": attrgetter("value"),
}
"""Readers of shared arguments whose values are not what is given."""


def _bare(kind: Any) -> Any:
    """Return a type without None; that of a path is Path, and one that a text may be of is str."""
    if kind is Any:
        return str
    rest = [part for part in get_args(kind) if part is not type(None)]
    if get_origin(kind) in (Union, UnionType) and (texts := [text for text in (Path, str) if text in rest]):
        return texts[0]
    return rest[0] if type(None) in get_args(kind) and len(rest) == 1 else kind


def _form(kind: Any, option: str) -> tuple[Any, Callable[[Any], Any], dict[str, Any]]:
    """Return the type of an option, the reader of its value, and settings of typer, for an argument of a type."""
    if get_origin(kind) is Sequence:
        (entry,) = get_args(kind)
        return str, (words if entry is str else partial(_numbers, entry, option)), {}
    if get_origin(kind) is Mapping:
        ranged = get_origin(get_args(kind)[1]) is tuple
        return list[str], partial(bounds, option) if ranged else partial(pairs, option.strip("-")), {}
    return kind, _same, {"parser": whole} if kind is int else {}


def _numbers(entry: type, option: str, text: str) -> list[Any]:
    """Return the numbers of a text of numbers separated by commas."""
    values = numbers(option, text) or []
    if entry is int and any(value != int(value) for value in values):
        raise BadInput(f"{option} {text}: give whole numbers separated by commas, for example 2,4,8.")
    return [entry(value) for value in values]


def _between(numbers: Sequence[float]) -> str:
    """Return the end of a help that gives the numbers of a default: all of them, or the first and the last."""
    first, *rest = (f"{x:g}" for x in numbers)
    return f"; comma-separated [{','.join([first, *rest]) if len(numbers) <= FEW else f'{len(numbers)} from {first} to {rest[-1]}'}]"


def _optional(name: str, annotation: Any, default: Any = None) -> inspect.Parameter:
    return inspect.Parameter(name, inspect.Parameter.KEYWORD_ONLY, annotation=annotation, default=default)


def _outputs(kind: type[Result], folder: str | None) -> Iterator[inspect.Parameter]:
    """Yield the options that every study has for its output; a study whose runs are stored has a folder for them."""
    tables, pictures = kind.outputs()
    if tables or pictures:
        alone = "; or FILE.pdf, .svg or .png for the picture alone" if _has_look(kind) else ""
        about = f"the picture, {kind.stem}.svg and .png, with its data, {kind.stem}.csv" if kind.stem else "tables and pictures"
        about = f"Folder for {''.join(f'{name}, and ' for name in tables)}{about}{alone}."
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


def _show(result: Result, written: Sequence[str] | None, made_again: str | None, generated: Sequence[str], *, as_json: bool) -> None:
    """Print a result, which stored runs were made again, and the written files; or all as JSON."""
    if as_json:
        more = {"made_again": made_again, "written": written}
        print_json({**result.summary(), **{name: value for name, value in more.items() if value is not None}})
        return
    for part in [*result.printed(), *([made_again] if made_again else [])]:
        print_part(part)
    print_written([*(written or ()), *generated])

"""The command of a study: its options are the signature of the study, their help is its docstring, and what it prints is its result."""

import inspect
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Annotated, Any, NamedTuple, get_args, get_origin

import typer

from daebench.cli import arguments
from daebench.cli.console import bar, method_names, numbers, pairs, print_json, print_table, print_written, words
from daebench.cli.folder import Folder
from daebench.cli.integer import whole
from daebench.cli.summary import print_summary
from daebench.errors import BadInput
from daebench.runs.option import Option
from daebench.runs.result import Result, Table

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
    "anyway": arguments.Anyway,
}
"""Arguments that many studies have, with the option of each, which is described once."""

PROGRESS = "progress"
"""Argument of a study that is called with the part of the work that is done."""


class Argument(NamedTuple):
    """An argument of a study, as a parameter of its command, and what reads the value that is given there."""

    parameter: inspect.Parameter
    read: Callable[[Any], Any]
    several: bool = False


def command_of(study: Callable[..., Any], title: str = "") -> Callable[..., None]:
    """Return the command of a study: a function with options in the form of typer.

    Parameters
    ----------
    study : callable
        A public function of keyword arguments, with a docstring, that returns a :class:`daebench.runs.result.Result`.
    title : str
        Title of its progress bar, with arguments in braces; by default the name of the study and the problem.
    """
    described = _descriptions(inspect.getdoc(study) or "")
    parameters = inspect.signature(study).parameters
    taken = {name: _argument(p, described.get(name, "")) for name, p in parameters.items() if name != PROGRESS}
    result: type[Result] = inspect.signature(study).return_annotation
    title = title or f"{study.__name__.replace('_', '-')} on {{problem}}"

    def command(*, out: Path | None = None, overwrite: bool = False, as_json: bool = False, **given: Any) -> None:
        folder = Folder(out, pictures=(result.stem,) if result.stem else ())
        folder.check()
        asked = {name: taken[name].read(value) for name, value in given.items() if value is not None}
        with bar(title.format(**given)) as progress:
            told = {PROGRESS: progress} if PROGRESS in parameters else {}
            made = _made(partial(study, **told), asked, [name for name, argument in taken.items() if argument.several])
        written = _written(folder, made)
        if as_json:
            print_json({**made.summary(), **({"written": written} if result.stem else {})})
        else:
            _print(made)
            print_written(written)
        raise typer.Exit(made.status)

    kept = [argument.parameter for argument in taken.values()] + list(_outputs(result))
    command.__signature__ = inspect.Signature(kept, return_annotation=None)  # type: ignore[attr-defined]
    command.__annotations__ = {parameter.name: parameter.annotation for parameter in kept}
    command.__doc__, command.__name__ = _about(inspect.getdoc(study) or ""), study.__name__
    return command


def _made(study: Callable[..., Any], asked: Mapping[str, Any], several: Sequence[str]) -> Any:
    """Return the result of a study; of several, for the values of an argument, that of all of them together."""
    if not several:
        return study(**asked)
    (name,) = several
    results = [study(**{**asked, name: value}) for value in asked[name]]
    return results[0].together(results)


def _argument(given: inspect.Parameter, about: str) -> Argument:
    """Return an argument of a study as an option, or, if it is positional, as an argument of the command."""
    name, kind, option = given.name, given.annotation, Option()
    if get_origin(kind) is Annotated:
        kind, option = get_args(kind)
    shared = f"{name}s" if option.several else name
    if shared in SHARED:
        form, info = get_args(SHARED[shared])
        read = READERS.get(shared, _same)
    else:
        names = option.names or (f"--{name.replace('_', '-')}",)
        form, read, settings = _form(_bare(kind), names[0])
        info = typer.Argument(help=about) if given.kind is given.POSITIONAL_OR_KEYWORD else typer.Option(*names, help=about, **settings)
    if option.read:
        form, read = str, option.read
    required = given.default is inspect.Parameter.empty
    default = given.default if required or given.default is None else _shown(given.default)
    annotation = Annotated[form if default is not None else form | None, info]
    return Argument(given.replace(annotation=annotation, default=default, kind=inspect.Parameter.KEYWORD_ONLY), read, option.several)


def _same(value: Any) -> Any:
    return value


READERS: Mapping[str, Callable[[Any], Any]] = {
    "parameters": partial(pairs, "param"),
    "options": partial(pairs, "option"),
    "methods": method_names,
}
"""Readers of shared arguments whose values are not what is given."""


def _bare(kind: Any) -> Any:
    """Return a type without None."""
    rest = [part for part in get_args(kind) if part is not type(None)]
    return rest[0] if type(None) in get_args(kind) and len(rest) == 1 else kind


def _form(kind: Any, option: str) -> tuple[Any, Callable[[Any], Any], dict[str, Any]]:
    """Return the type of an option, the reader of its value, and settings of typer, for an argument of a type."""
    if get_origin(kind) is Sequence:
        (entry,) = get_args(kind)
        return str, (words if entry is str else partial(_numbers, entry, option)), {}
    if get_origin(kind) is Mapping:
        return list[str], partial(pairs, option.strip("-")), {}
    return kind, _same, {"parser": whole} if kind is int else {}


def _numbers(entry: type, option: str, text: str) -> list[Any]:
    """Return the numbers of a text of numbers separated by commas."""
    values = numbers(option, text) or []
    if entry is int and any(value != int(value) for value in values):
        raise BadInput(f"{option} {text}: give whole numbers separated by commas, for example 2,4,8.")
    return [entry(value) for value in values]


def _shown(default: Any) -> Any:
    """Return a default as it is given to a command."""
    return ",".join(f"{x:g}" if isinstance(x, float) else str(x) for x in default) if isinstance(default, tuple | list) else default


def _outputs(result: type[Result]) -> Iterator[inspect.Parameter]:
    """Yield the options that every study has for its output."""
    options: dict[str, tuple[Any, Any]] = {"as_json": (arguments.Json, False)}
    if result.stem:
        help_of_out = f"Folder for the picture, {result.stem}.svg and .png, and its table, {result.stem}.csv."
        options = {"out": (Annotated[Path | None, typer.Option("--out", help=help_of_out)], None), "overwrite": (arguments.Overwrite, False)} | options
    for name, (annotation, default) in options.items():
        yield inspect.Parameter(name, inspect.Parameter.KEYWORD_ONLY, annotation=annotation, default=default)


def _written(folder: Folder, made: Any) -> list[str]:
    """Write the picture with its table, if a folder is named; return the paths."""
    if folder.out is None:
        return []
    from daebench.draw.figures import save

    with folder.described(made.ivp, made.about) as written:
        save(made.plot(), folder.out, made.stem, made.table)
    return written


def _print(made: Result) -> None:
    for part in made.printed():
        if isinstance(part, Table):
            print_table(part.columns, part.rows, part.title)
        elif isinstance(part, str):
            print(part)
        else:
            print_summary(part)


ROLE = re.compile(r":\w+:`~?([^`]+)`")
"""A reference to an object in a docstring."""


def _plain(text: str) -> str:
    """Return a sentence of a docstring without markup."""
    return " ".join(ROLE.sub(r"\1", text).replace("``", "").split())


def _about(docstring: str) -> str:
    """Return what a docstring says before its sections, without examples."""
    before = re.split(r"\n\n\w+\n-{3,}\n", docstring)[0]
    paragraphs = [paragraph for paragraph in before.split("\n\n") if not paragraph.lstrip().startswith(">>>")]
    return "\n\n".join(re.sub(r"::$", ".", _plain(paragraph)) for paragraph in paragraphs)


def _descriptions(docstring: str) -> dict[str, str]:
    """Return the descriptions of parameters in a docstring of NumPy's form, by name."""
    section = re.search(r"\nParameters\n-+\n(.*?)(?:\n\n\w+\n-{3,}\n|$)", docstring, re.DOTALL)
    entries = re.findall(r"^(\S[^\n]*?) : [^\n]*\n((?:[ ]+[^\n]*\n?)+)", section[1] if section else "", re.MULTILINE)
    return {name.strip(): _plain(text) for names, text in entries for name in names.split(",")}

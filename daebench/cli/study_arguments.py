"""Arguments of a study as options of its command: their types, their readers, and their help, which is in the docstring of the study."""

import inspect
from collections.abc import Callable, Mapping, Sequence
from copy import copy
from functools import partial
from operator import attrgetter
from pathlib import Path
from types import UnionType
from typing import Annotated, Any, NamedTuple, Union, Unpack, get_args, get_origin, get_type_hints

import typer

from daebench.cli import arguments
from daebench.cli.console import method_names
from daebench.cli.integer import whole
from daebench.cli.starts import Starts
from daebench.errors import BadInput
from daebench.runs.option import Option
from daebench.runs.own_start import NAMES, OwnStart, values_in
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
    "q0": arguments.Q0,
    "p0": arguments.P0,
    "v0": arguments.V0,
    "y0": arguments.Y0,
    "project": arguments.Project,
    "algebra": arguments.Algebra,
    "anyway": arguments.Anyway,
    "overwrite": arguments.Overwrite,
    "starts": Starts,
}
"""Arguments that many studies have, with the option of each, which is described once."""

METHODS = {"method": "", "methods": "; comma-separated"}
"""Arguments that name methods, whose help is that of each study, and what is said there of their form."""

FEW = 6
"""Numbers of a default that a help names."""


class Argument(NamedTuple):
    """An argument of a study, as a parameter of its command, and what reads the value that is given there."""

    parameter: inspect.Parameter
    read: Callable[[Any], Any]
    several: bool = False


def option_of(parameter: inspect.Parameter) -> Option:
    """Return how a command takes an argument."""
    return get_args(parameter.annotation)[1] if get_origin(parameter.annotation) is Annotated else Option()


def argument_of(given: inspect.Parameter, about: str, *, placed: bool) -> Argument:
    """Return an argument of a study as an option, or as an argument of the command that is given by its place."""
    name, kind, option = given.name, given.annotation, option_of(given)
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
        about = _with_form(about, kind, default, repeatable=option.repeatable or (get_origin(kind) is Mapping and not option.read))
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
    first, point, rest = about.rstrip(".").partition(". ")
    return f"{first}{form}{point}{rest}." if form else about


def expanded(parameters: Mapping[str, inspect.Parameter]) -> dict[str, inspect.Parameter]:
    """Return the parameters of a study with those of a start of one's own, which it takes by keyword."""
    named = {name: p for name, p in parameters.items() if p.kind is not p.VAR_KEYWORD}
    if any(p.kind is p.VAR_KEYWORD and get_origin(p.annotation) is Unpack for p in parameters.values()):
        kinds = get_type_hints(OwnStart)
        named |= {name: inspect.Parameter(name, inspect.Parameter.KEYWORD_ONLY, annotation=kinds[name], default=None) for name in kinds}
    return named


def _same(value: Any) -> Any:
    return value


READERS: Mapping[str, Callable[[Any], Any]] = {
    "parameters": partial(pairs, "param"),
    "options": partial(pairs, "option"),
    "methods": method_names,
    "starts": attrgetter("value"),
    **{name: partial(values_in, f"--{name}") for name in NAMES},
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
        raise BadInput(f"{option} {text}: give whole numbers separated by commas, for example 2,4,8.", "not-whole-numbers-list")
    return [entry(value) for value in values]


def _between(numbers: Sequence[float]) -> str:
    """Return the end of a help that gives the numbers of a default: all of them, or the first and the last."""
    first, *rest = (f"{x:g}" for x in numbers)
    return f"; comma-separated [{','.join([first, *rest]) if len(numbers) <= FEW else f'{len(numbers)} from {first} to {rest[-1]}'}]"

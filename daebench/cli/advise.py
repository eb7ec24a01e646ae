"""``daebench advise``: the method for an accuracy, and its cost."""

import sys
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from daebench.cli.arguments import OUTSIDE, Anyway, Case, Json, OnSingular, Overwrite, Param, Problem
from daebench.cli.console import bar, methods_if_given, print_json, print_table, print_written
from daebench.cli.folder import Folder
from daebench.cli.integer import whole
from daebench.errors import BadInput
from daebench.runs.files import require_new
from daebench.runs.texts import number, pairs, words
from daebench.studies.advise.run import advise as made

if TYPE_CHECKING:
    from daebench.studies.advise.advice import Advice, Choice
    from daebench.studies.advise.choice import Progress


def advise(
    problem: Problem,
    accuracy: Annotated[float, typer.Option("--accuracy", help="Largest error of a position, or of a component of y, in its unit.")],
    t_end: Annotated[float, typer.Option("--t-end", help="Horizon, s.")],
    keep: Annotated[str | None, typer.Option("--keep", help="What has to be conserved: energy, constraints, casimirs, two-form.")] = None,
    budget: Annotated[str | None, typer.Option("--budget", help="Largest CPU time of the run, as 1s, 20ms or a number of seconds.")] = None,
    share: Annotated[float, typer.Option("--share", help="Share of starts within the accuracy; 0: the start of the case only.")] = 0.95,
    ensemble: Annotated[int, typer.Option("--ensemble", parser=whole, help="Number of other starts from which errors are measured.")] = 128,
    methods: Annotated[str | None, typer.Option("--methods", help=f"Methods to try, comma-separated; {OUTSIDE}.")] = None,
    also: Annotated[str | None, typer.Option("--also", help="Further methods to try, for example your own integrator.")] = None,
    case: Case = None,
    param: Param = None,
    seed: Annotated[int, typer.Option("--seed", help="Seeds the starts of --ensemble.")] = 0,
    anyway: Anyway = False,
    on_singular: OnSingular = None,
    store: Annotated[Path | None, typer.Option("--store", help="File of the stored runs; beside the compiled kernels if left out.")] = None,
    out: Annotated[Path | None, typer.Option("--out", help="Folder for the picture and the table of runs.")] = None,
    generate: Annotated[Path | None, typer.Option("--generate", help="New folder for the choice as code in C.")] = None,
    overwrite: Overwrite = False,
    as_json: Json = False,
) -> None:
    """Find the cheapest method for an accuracy, with its step size or tolerance; exit 1 if no run meets the request.

    The accuracy holds for a share of starts: some near the start of the case are run as well. The choice conserves a quantity if it claims
    this and a run over ten times the horizon shows it. Runs are stored, so a second question takes little time.
    """
    asked: dict[str, Any] = {"accuracy": accuracy, "t_end": t_end, "share": share, "case": case, "starts": ensemble, "seed": seed}
    asked |= {"store": store, "keep": [name.replace("-", "_") for name in words(keep)] if keep else (), "budget": _seconds(budget)}
    asked |= {"methods": methods_if_given(methods), "also": words(also) if also else ()}
    asked |= {"anyway": anyway, "on_singular": on_singular}
    folder = Folder(out, pictures=("advise",))
    folder.check()
    if generate is not None:
        require_new(generate)
    with bar(f"advice on {problem}") as progress:
        advice = made(problem, **asked, parameters=pairs("param", param or []), progress=_planned(progress))
    written = _write(folder, advice) + _generated(advice, generate)
    if as_json:
        print_json(advice.summary() | {"written": written})
    else:
        _print(advice)
        print_written(written)
    raise typer.Exit(1 if advice.choice is None else 0)


def _planned(progress: "Progress") -> "Progress":
    """Return the function that shows the progress, and that prints the plan, which comes first."""
    shown: list[str] = []

    def tell(fraction: float, what: str) -> None:
        if not shown:
            print(f"daebench: plan: {what}", file=sys.stderr)
        shown.append(what)
        progress(fraction, what if len(shown) > 1 else "")

    return tell


def _seconds(text: str | None) -> float | None:
    """Return a time in seconds."""
    if text is None:
        return None
    for ending, unit in (("us", 1e-6), ("ms", 1e-3), ("s", 1.0)):
        if text.endswith(ending):
            return unit * number("--budget", text.removesuffix(ending))
    return number("--budget", text)


def _write(folder: Folder, advice: "Advice") -> list[str]:
    """Write the picture, with the table of runs beside it; return the paths."""
    if folder.out is None:
        return []
    from daebench.studies.advise.figure import draw

    about = {"Accuracy": f"{advice.question.accuracy:g}", "Seed": str(advice.question.seed)}
    with folder.described(advice.question.ivp, about) as written:
        draw(folder.out, advice)
    return written


def _generated(advice: "Advice", out: Path | None) -> list[str]:
    """Write the cheapest choice with a fixed step as code; return the paths."""
    if out is None or advice.choice is None:
        return []

    asked, fixed = advice.question, [some for some in (advice.choice, *advice.runners_up) if some.knob == "h"]
    if not fixed:
        raise BadInput(f"{advice.choice.method} chooses its own steps, so that it cannot be generated; name schemes with --methods.")
    if fixed[0] is not advice.choice:
        print(f"daebench: {advice.choice.method} chooses its own steps; generated is {fixed[0].method}.", file=sys.stderr)
    more: dict[str, Any] = {"case": asked.case, "parameters": asked.parameters, "anyway": asked.anyway, "on_singular": asked.on_singular}
    from daebench.pages.generation.run import generate

    return [str(file) for file in generate(asked.problem, fixed[0].method, out, h=fixed[0].value, **more).files]


def _print(advice: "Advice") -> None:
    """Print the answer."""
    asked, choice = advice.question, advice.choice
    wanted = "error" if choice else "wanted: error"
    print(
        f"{asked.problem}, case {asked.case}, to t = {asked.t_end:g} s, {wanted} of {asked.part} at most {asked.accuracy:g} {advice.holds}"
    )
    print(f"errors are against: {advice.reference}, which may be wrong by {advice.bound:.1e}")
    if choice is None:
        print(advice.why)
        return
    rows = [[what, *_cells(some, choice)] for what, some in zip(("take", "or", "or"), (choice, *advice.runners_up), strict=False)]
    print_table(["", "method", "with", "error", "CPU time", "times as long"], rows)
    print(_from_starts(advice))
    conserved = advice.summary()["kept"]
    print_table(["keeps", "", "claimed", "measured"], [_kept(name, row) for name, row in conserved.items()])
    print_table(["what breaks first", "error over the accuracy"], [[change.what, _factor(advice, change)] for change in advice.changes])
    print(advice.command)
    print(advice.python)
    for name, became in advice.outside.items():
        print(f"{name}: {became}")
    if advice.left_out:
        print(f"not tried, or left out: {', '.join(advice.left_out)}; --json says why")


def _cells(some: "Choice", choice: "Choice") -> list[str]:
    ratio = some.seconds / choice.seconds
    return [some.method, f"{some.knob} = {some.value:.4g}", f"{some.error:.1e}", f"{1e3 * some.seconds:.3g} ms", f"{ratio:.2g}"]


def _kept(name: str, row: Mapping[str, Any]) -> list[str]:
    answer = "yes" if row["kept"] else "no"
    return [name.replace("_", "-"), answer, "yes" if row["claimed"] else "no", f"{row['value']:.1e}, {row['words']}"]


def _from_starts(advice: "Advice") -> str:
    """Return a sentence on the error of the choice from other starts."""
    starts, accuracy = advice.starts, advice.question.accuracy
    if not starts.errors:
        return f"from other starts nothing is known: {starts.failure or 'their references are not good enough'}"
    within = starts.within(accuracy)
    low, middle, high = (starts.quantile(part) for part in (0.05, 0.5, 0.95))
    return (
        f"from {starts.number} other starts: error {middle:.1e} in the median, {low:.1e} to {high:.1e} (5 to 95 %); "
        f"{100 * within.value:.3g} % of them within {accuracy:g} [{100 * within.low:.3g} to {100 * within.high:.3g} of all]"
    )


def _factor(advice: "Advice", change: Any) -> str:
    factor = change.factor(advice.question.accuracy)
    if factor != factor:
        return f"not known: {_clause(change.found.failure) or 'no reference is good enough'}"
    return f"stops: {_clause(change.found.failure)}" if factor == float("inf") else f"{factor:.2g}"


def _clause(sentence: str) -> str:
    """Return the part of a sentence before its first colon or semicolon."""
    return sentence.partition(":")[0].partition(";")[0]

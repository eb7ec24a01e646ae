"""``daebench reference at``: one state of a reference, with its bound."""

from typing import TYPE_CHECKING, Annotated, Any

import typer

from daebench.cli.arguments import Case, Json, Problem
from daebench.cli.console import print_json, print_table
from daebench.cli.reference.arguments import Folder, whose
from daebench.reference.keep.dense_evaluation import states_at, text_of
from daebench.reference.keep.store import find, kept_in

if TYPE_CHECKING:
    from daebench.reference.keep.dense_evaluation import At
    from daebench.reference.keep.record import Reference


def at(
    problem: Problem,
    t: Annotated[float, typer.Option("--t", help="Time, s.")],
    case: Case = None,
    folder: Folder = None,
    as_json: Json = False,
) -> None:
    """Print q, p, lam, or y, and their bounds at a time: stored digits, or digits integrated from the nearest time in double precision."""
    reference = find(problem, case, folder)
    home = whose(kept_in(reference.name, folder))
    evaluation = states_at(reference, [t])
    if as_json:
        print_json(_object(reference, evaluation) | {"kept_in": home})
        return
    print(f"{reference.name} of {home} at t = {t!r}: {_origin(reference, evaluation)}\n")
    print_table(["", "value", "bound"], [[name, value, f"{bound:.2g}"] for name, value, bound in _rows(reference, evaluation)])


def _origin(reference: "Reference", evaluation: "At") -> str:
    if evaluation.stored[0]:
        return "stored digits"
    if reference.rank_losses:
        return "computed from the closed form, because the motion passes rank loss"
    nearest = reference.t[abs(reference.t - evaluation.t[0]).argmin()]
    return f"integrated in double precision from the stored state at t = {nearest:g}"


def _rows(reference: "Reference", evaluation: "At") -> list[tuple[str, str, float]]:
    text = _texts(reference, evaluation)
    rows = []
    for part in reference.state.stored:
        bound = reference.bound[part][evaluation.row[0]] if evaluation.stored[0] else evaluation.bound[part][0]
        rows += [(f"{part}{i + 1}", value, float(bound[i])) for i, value in enumerate(text[part])]
    return rows


def _texts(reference: "Reference", evaluation: "At") -> dict[str, list[str]]:
    """Return the digits of each part."""
    text = text_of(reference, evaluation)
    return {part: [text[f"{part}{i + 1}"][0] for i in range(rows.shape[1])] for part, rows in evaluation.states.items()}


def _object(reference: "Reference", evaluation: "At") -> dict[str, Any]:
    return {
        "reference": reference.name,
        "problem": reference.problem,
        "case": reference.case,
        "parameters": reference.parameters,
        "t": float(evaluation.t[0]),
        "origin": _origin(reference, evaluation),
        **{part: rows[0] for part, rows in evaluation.states.items()},
        "digits": _texts(reference, evaluation),
        "bound": {part: rows[0] for part, rows in evaluation.bound.items()},
        "bound_of_digits": {part: rows[evaluation.row[0]] for part, rows in reference.bound.items()} if evaluation.stored[0] else None,
        "horizon": reference.horizon,
    }

"""``daebench list``: what there is."""

from enum import StrEnum
from typing import Annotated, Any

import typer

from daebench.cli.arguments import Json
from daebench.cli.console import print_json, print_table
from daebench.errors import unknown


class What(StrEnum):
    """What can be listed."""

    problems = "problems"
    methods = "methods"
    compositions = "compositions"
    projections = "projections"
    forms = "forms"
    formulations = "formulations"
    reports = "reports"


def listing(
    what: Annotated[
        str | None,
        typer.Argument(help="problems, methods, compositions, projections, forms, formulations, reports; or everything."),
    ] = None,
    as_json: Json = False,
) -> None:
    """List problems, methods and what they can be combined with, formulations and reports."""
    if what is not None and what not in list(What):
        raise unknown("listing", what, list(What))
    chosen = [What(what)] if what else list(What)
    tables = {each.value: _rows(each) for each in chosen}
    if as_json:
        print_json(tables)
        return
    for title, rows in tables.items():
        columns = list(rows[0]) if rows else ["name"]
        print_table(columns, [[_text(row[column]) for column in columns] for row in rows], title)


def _rows(what: What) -> list[dict[str, Any]]:
    from daebench import catalogue, names, pose
    from daebench.compositions import COMPOSITIONS
    from daebench.fixed_step import PROJECTIONS
    from daebench.forms import FORMS

    if what is What.problems:
        found = catalogue.problems().values()
        return [{"name": each.name, "parameters": {**each.parameters, **each.structure}, "about": each.summary} for each in found]
    if what is What.methods:
        return [_method(each) for each in names.listed()]
    if what is What.compositions:
        return [{"name": f"/{name}", "order": x.order, "stages": x.stages, "source": x.source} for name, x in COMPOSITIONS.items()]
    if what is What.projections:
        return [{"name": f"+{name}", "about": about} for name, about in PROJECTIONS.items()]
    if what is What.forms:
        return [{"name": f"{name}:", "options": dict(form.options), "about": form.about} for name, form in FORMS.items()]
    about = pose.FORMULATIONS if what is What.formulations else catalogue.reports()
    return [{"name": name, "about": text} for name, text in about.items()]


def _method(each: Any) -> dict[str, Any]:
    from daebench.members import members

    about: dict[str, Any] = {"name": each.name, "knob": each.knob, "system": each.system, "options": dict(each.options)}
    if each.name not in members():
        return about | dict.fromkeys(("order", "symmetric", "symplectic", "on_manifold", "source"))
    claims = members()[each.name][1].claims
    return about | {
        "order": claims.order,
        "symmetric": claims.symmetric,
        "symplectic": claims.symplectic,
        "on_manifold": claims.on_manifold,
        "source": claims.source,
    }


def _text(value: Any) -> str:
    if value is None:
        return ""
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, dict):
        return ", ".join(f"{name}={number:g}" for name, number in value.items())
    return str(value)

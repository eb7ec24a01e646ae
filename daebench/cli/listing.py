"""``daebench list``: problems, methods, reports and other names."""

import sys
from enum import StrEnum
from typing import Annotated, Any

import typer

from daebench.cli.arguments import Json
from daebench.cli.console import print_json, print_table
from daebench.errors import unknown
from daebench.methods import catalogue


class What(StrEnum):
    """Kinds of names that can be listed."""

    problems = "problems"
    methods = "methods"
    compositions = "compositions"
    projections = "projections"
    forms = "forms"
    formulations = "formulations"
    faults = "faults"
    reports = "reports"
    lessons = "lessons"


def listing(
    what: Annotated[
        str | None,
        typer.Argument(
            help="problems, methods, compositions, projections, forms, formulations, faults, reports or lessons; all if left out."
        ),
    ] = None,
    as_json: Json = False,
) -> None:
    """List problems, methods and their combinations, formulations, faults of integrators, reports and lessons."""
    if what is not None and what not in list(What):
        raise unknown("listing", what, list(What))
    chosen = [What(what)] if what else list(What)
    tables = {category.value: _rows(category) for category in chosen}
    if as_json:
        print_json(tables)
        return
    for title, rows in tables.items():
        for columns in dict.fromkeys(tuple(row) for row in rows) or [("name",)]:
            print_table(columns, [[_text(value) for value in row.values()] for row in rows if tuple(row) == columns], title)


def _rows(what: What) -> list[dict[str, Any]]:
    """Return the listings; rows of one listing need not have the same columns."""
    if what is What.problems:
        return _problems()
    if what is What.methods:
        return _methods()
    if what is What.forms:
        return _forms()
    if what is What.faults:
        from daebench.studies.diagnose.dictionary import FAULTS

        return [{"name": name, "about": f"the code {fault.about}", "remedy": fault.remedy} for name, fault in FAULTS.items()]
    if what in (What.lessons, What.reports):
        return [
            {"name": name, "about": text} for name, text in (catalogue.lessons if what is What.lessons else catalogue.reports)().items()
        ]
    from daebench.methods.fixed_step.compositions import COMPOSITIONS
    from daebench.methods.fixed_step.parts import PROJECTIONS
    from daebench.methods.formulations.table import FORMULATIONS, POISSON_FORMULATIONS

    if what is What.compositions:
        return [{"name": f"/{name}", "order": x.order, "stages": x.stages, "source": x.source} for name, x in COMPOSITIONS.items()]
    if what is What.projections:
        return [{"name": f"+{name}", "about": about} for name, about in PROJECTIONS.items()]
    kinds = {"constrained": FORMULATIONS, "poisson": POISSON_FORMULATIONS}
    return [{"name": name, "kind": kind, "about": text} for kind, table in kinds.items() for name, text in table.items()]


def _problems() -> list[dict[str, Any]]:
    """Return daebench's own problems and those of other packages; a broken problem of another package is reported in the list."""
    others = catalogue.plugins()
    for sentence in others.broken.values():
        print(f"daebench: {sentence}", file=sys.stderr)
    rows = []
    for problem in (*catalogue.problems().values(), *others.problems.values()):
        origin = {"package": problem.package} if others.problems else {}
        parameters = {**problem.parameters, **problem.structure}
        rows.append({"name": problem.name, "kind": problem.kind, **origin, "parameters": parameters, "about": problem.summary})
    return rows


def _forms() -> list[dict[str, Any]]:
    from daebench.methods.fixed_step.forms import FORMS
    from daebench.methods.names_tables import POISSON

    rows = [{"name": f"{name}:", "kind": "constrained", "options": dict(form.options), "about": form.about} for name, form in FORMS.items()]
    return rows + [{"name": f"{name}:", "kind": "poisson", "options": {}, "about": about} for name, about in POISSON.forms.items()]


def _methods() -> list[dict[str, Any]]:
    from daebench.methods.names_tables import CONSTRAINED, POISSON

    return [_constrained(method) for method in CONSTRAINED.listed()] + [_poisson(method) for method in POISSON.listed()]


def _constrained(method: Any) -> dict[str, Any]:
    from daebench.methods.registry import registry

    about: dict[str, Any] = {"name": method.name, "kind": "constrained", "knob": method.knob, "system": method.system}
    claims = registry()[method.name][1].claims if method.name in registry() else None
    claimed = ("order", "symmetric", "symplectic", "on_manifold", "source")
    return about | {"options": dict(method.options)} | {name: getattr(claims, name, None) for name in claimed}


def _poisson(method: Any) -> dict[str, Any]:
    """Return a method for Poisson systems with its claims; ``poisson`` is the class of B for which it is a Poisson integrator."""
    from daebench.methods.registry import poisson_registry
    from daebench.schemes.kernels.claims import CLASSES

    about: dict[str, Any] = {"name": method.name, "kind": "poisson", "knob": method.knob, "system": method.system}
    claims = poisson_registry().get(method.name)
    about |= {claim: getattr(claims, claim, None) for claim in ("order", "symmetric", "keeps")}
    return about | {"poisson": CLASSES.get(claims.poisson, "no B") if claims else None, "source": claims.source if claims else None}


def _text(value: Any) -> str:
    if value is None:
        return ""
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, dict):
        return ", ".join(f"{name}={number:g}" for name, number in value.items())
    return str(value)

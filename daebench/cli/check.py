"""``daebench check``: what a method claims, or what a problem declares, and what is measured."""

from functools import partial
from typing import TYPE_CHECKING, Annotated

import typer

from daebench.cli.arguments import Anyway, Case, Free, Json, Param, Problem
from daebench.cli.console import Bar, bar, pairs, print_json, print_table
from daebench.errors import BadInput

if TYPE_CHECKING:
    from collections.abc import Mapping

    from daebench.studies.claims.bench import Finding


def check(
    problem: Problem,
    method: Annotated[
        str | None, typer.Option("--method", help="Name of a fixed-step method, for example rattle; if left out, the problem is checked.")
    ] = None,
    case: Case = None,
    h: Annotated[float | None, typer.Option("--h", help="Step size of all but the order; a small part of the motion if left out.")] = None,
    steps: Annotated[int | None, typer.Option("--steps", help="Steps along which what is kept is monitored; 200 if left out.")] = None,
    param: Param = None,
    option: Free = None,
    anyway: Anyway = False,
    as_json: Json = False,
) -> None:
    """Hold the claims of a fixed-step method, or what a problem declares, against what is measured; exit 1 if one falls short.

    Without --method the problem itself is checked, in all its cases or in one: initial values, mass matrix, second derivatives, first
    integrals, closed form, kinetic flow and chart.
    """
    if method is None:
        _refuse_idle({"--param": param, "--h": h, "--steps": steps, "--option": option, "--anyway": anyway or None})
        raise typer.Exit(_checked(problem, case, as_json=as_json))
    from dataclasses import asdict

    from daebench.methods.initial_value_problem import initial_value_problem
    from daebench.methods.names import method_of
    from daebench.studies.claims.bench import FALLS_SHORT
    from daebench.studies.claims.check import NO_CLAIMS, check_claims, default_step
    from daebench.studies.measurable import measured

    ivp = initial_value_problem(problem, case, pairs("param", param or []))
    chosen = measured(method_of(ivp, method, pairs("option", option or []), anyway=anyway), ivp, NO_CLAIMS)
    with bar(f"{method} on {problem}") as progress:
        value, steps = default_step(ivp) if h is None else h, 200 if steps is None else steps
        found = check_claims(ivp, chosen, h=value, steps=steps, progress=progress)
    short = [each.property for each in found if each.verdict == FALLS_SHORT]
    if as_json:
        about = {"problem": ivp.problem, "case": ivp.case, "parameters": dict(ivp.parameters), "method": chosen.name}
        print_json(about | {"h": value, "steps": steps, "claims": [asdict(each) for each in found], "falls_short": short})
    else:
        _print(f"{chosen.name} on {ivp.problem}, case {ivp.case}, h = {value:g}, {steps} steps", found)
        if short:
            print(f"{chosen.name} falls short of what it claims: {', '.join(short)}.")
    raise typer.Exit(1 if short else 0)


def _refuse_idle(given: "Mapping[str, object]") -> None:
    """Refuse options that only the check of a method has."""
    for name, value in given.items():
        if value is not None:
            raise BadInput(f"{name} is for the check of a method; add --method, or leave it out.")


def _checked(problem: str, case: str | None, *, as_json: bool) -> int:
    """Say what was checked of a problem and what is wrong; return the exit status."""
    from dataclasses import asdict

    from daebench.diagnostics.problem.check import Held, held
    from daebench.methods.initial_value_problem import declared_ivps

    found: list[Held] = []
    with bar(f"check {problem}") as progress:
        ivps = declared_ivps(problem, case)
        for k, ivp in enumerate(ivps):
            found += held(ivp, partial(_tell, progress, k / len(ivps), f"check {problem}, case {ivp.case}"))
    if as_json:
        print_json({"problem": problem, "checks": [asdict(each) for each in found], "ok": not any(each.fault for each in found)})
    else:
        print_table(["case", "checked", ""], [[each.case, each.what, "FAILS" if each.fault else "ok"] for each in found], problem)
        for each in found:
            if each.fault:
                print(each.fault)
    return 1 if any(each.fault for each in found) else 0


def _tell(progress: Bar, part: float, where: str, what: str) -> None:
    progress(part, f"{where}: {what}")


def _print(title: str, found: "list[Finding]") -> None:
    rows = [[each.property, _claim(each.claimed), _measured(each), _bound(each), each.verdict] for each in found]
    print(title)
    print_table(["property", "claimed", "measured", "bound", "verdict"], rows)
    for each in found:
        if each.note:
            print(f"{each.property}: {each.note}")


def _claim(claimed: int | bool | None) -> str:
    return "" if claimed is None else {True: "yes", False: "no"}[claimed] if isinstance(claimed, bool) else str(claimed)


def _measured(each: "Finding") -> str:
    if each.measured != each.measured:
        return ""
    return f"{each.measured:.3f} ± {each.standard_error:.1g}" if each.property == "order" else f"{each.measured:.2g}"


def _bound(each: "Finding") -> str:
    if each.bound != each.bound:
        return ""
    return f"> {each.bound:.3g}" if each.property == "order" else f"<= {each.bound:.2g}"

"""``daebench check``: claims of a method, or declarations of a problem, and their measurement."""

from dataclasses import asdict
from functools import partial
from typing import TYPE_CHECKING, Annotated, Any

import typer

from daebench.cli import mechanism
from daebench.cli.arguments import OUTSIDE, Anyway, Case, Free, Json, OnSingular, Param, Problem
from daebench.cli.console import Bar, bar, print_json, print_table, printable
from daebench.cli.integer import whole
from daebench.errors import BadInput
from daebench.methods.initial_value_problem import declared_ivps, initial_value_problem
from daebench.methods.names import method_of
from daebench.runs.texts import pairs
from daebench.studies.claims.bench import FALLS_SHORT
from daebench.studies.claims.measured_run import default_step
from daebench.studies.claims.second import on_second, unseen
from daebench.studies.measurable import measured
from daebench.systems.parts import Parts

if TYPE_CHECKING:
    from collections.abc import Mapping

    from daebench.studies.claims.bench import Finding


def check(
    problem: Problem,
    method: Annotated[
        str | None,
        typer.Option("--method", help=f"Name of a fixed-step method, for example rattle; if left out, the problem is checked; {OUTSIDE}."),
    ] = None,
    case: Case = None,
    h: Annotated[float | None, typer.Option("--h", help="Step size of all but the order; a small part of the motion if left out.")] = None,
    steps: Annotated[
        int | None, typer.Option("--steps", parser=whole, help="Number of steps along which conserved quantities are monitored [200].")
    ] = None,
    param: Param = None,
    option: Free = None,
    anyway: Anyway = False,
    on_singular: OnSingular = None,
    as_json: Json = False,
) -> None:
    """Measure the claims of a fixed-step method, or check the declarations of a problem; exit 1 if one does not hold.

    Where the force of the problem is the same everywhere, a scheme is measured on two_bodies_on_sphere as well, whose U has curvature.
    Sentences say what the problem cannot show.

    Without --method the problem itself is checked, in all its cases or in one: initial values, mass matrix, second derivatives, first
    integrals, closed form, kinetic flow and chart; degrees of freedom are counted, and redundant constraints named.
    """
    from daebench.studies.claims.check import NO_CLAIMS, check_claims

    if method is None:
        _refuse_idle({"--h": h, "--steps": steps, "--option": option, "--anyway": anyway or None, "--on-singular": on_singular})
        raise typer.Exit(_checked(problem, case, pairs("param", param or []), as_json=as_json))

    ivp = initial_value_problem(problem, case, pairs("param", param or []), on_singular=on_singular)
    chosen = measured(method_of(ivp, method, pairs("option", option or []), anyway=anyway), ivp, NO_CLAIMS)
    with bar(f"{method} on {problem}") as progress:
        value, steps = default_step(ivp) if h is None else h, 200 if steps is None else steps
        findings = check_claims(ivp, chosen, h=value, steps=steps, progress=progress)
        progress(1.0, f"{chosen.name} on another problem")
        findings += on_second(ivp, chosen)
    raise typer.Exit(_said(ivp, chosen.name, value, steps, findings, as_json=as_json))


def _said(ivp: Any, name: str, h: float, steps: int, findings: "list[Finding]", *, as_json: bool) -> int:
    """Print the measured claims of a method, and what the problem cannot show; return the exit status."""
    short = [finding.property for finding in findings if finding.verdict == FALLS_SHORT]
    if as_json:
        about = {"problem": ivp.problem, "case": ivp.case, "parameters": dict(ivp.parameters), "method": name, "h": h, "steps": steps}
        print_json(about | {"claims": [asdict(finding) for finding in findings], "falls_short": short, "unseen": unseen(ivp)})
    else:
        _print(f"{name} on {ivp.problem}, case {ivp.case}, h = {h:g}, {steps} steps", findings)
        for sentence in unseen(ivp):
            print(sentence)
        if short:
            print(f"{name} falls short of what it claims: {', '.join(short)}.")
    return 1 if short else 0


def _refuse_idle(given: "Mapping[str, object]") -> None:
    """Refuse options that belong to the check of a method."""
    for name, value in given.items():
        if value is not None:
            raise BadInput(f"{name} belongs to the check of a method; add --method, or leave it out.")


def _checked(problem: str, case: str | None, parameters: "Mapping[str, float]", *, as_json: bool) -> int:
    """Print the checks of a problem with these values of parameters, and their failures; return the exit status."""
    from daebench.diagnostics.problem.check import Held, held

    findings: list[Held] = []
    with bar(f"check {problem}") as progress:
        ivps = declared_ivps(problem, case, parameters)
        for k, ivp in enumerate(ivps):
            findings += held(ivp, partial(_tell, progress, k / len(ivps), f"check {problem}, case {ivp.case}"))
    faults = [finding.fault for finding in findings if finding.fault]
    parts = getattr(ivps[0].source.derivation.definition, "parts", None) if ivps else None
    parts = parts if isinstance(parts, Parts) else None
    if as_json:
        checks = [asdict(finding) for finding in findings]
        print_json({"problem": problem, "checks": checks, "ok": not faults} | mechanism.as_json(parts))
    else:
        rows = [[finding.case, finding.what, "FAILS" if finding.fault else "ok"] for finding in findings]
        print_table(["case", "checked", ""], rows, problem)
        mechanism.print_parts(parts)
        for finding in findings:
            if finding.note:
                print(printable(f"case {finding.case}: {finding.note}"))
        for fault in faults:
            print(fault)
    return 1 if faults else 0


def _tell(progress: Bar, part: float, where: str, what: str) -> None:
    progress(part, f"{where}: {what}")


def _print(title: str, findings: "list[Finding]") -> None:
    rows = [[finding.property, _claim(finding.claimed), _measured(finding), _bound(finding), finding.verdict] for finding in findings]
    print(title)
    print_table(["property", "claimed", "measured", "bound", "verdict"], rows)
    for finding in findings:
        if finding.note:
            print(f"{finding.property}: {finding.note}")


def _claim(claimed: int | bool | None) -> str:
    return "" if claimed is None else {True: "yes", False: "no"}[claimed] if isinstance(claimed, bool) else str(claimed)


def _measured(finding: "Finding") -> str:
    if finding.measured != finding.measured:
        return ""
    if finding.standard_error == finding.standard_error:
        return f"{finding.measured:.3f} ± {finding.standard_error:.1g}"
    return f"{finding.measured:.3f}" if finding.property.startswith("order") else f"{finding.measured:.2g}"


def _bound(finding: "Finding") -> str:
    if finding.bound != finding.bound:
        return ""
    return f"> {finding.bound:.3g}" if finding.property.startswith("order") else f"<= {finding.bound:.2g}"

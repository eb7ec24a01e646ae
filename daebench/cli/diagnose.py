"""``daebench diagnose``: the mistake in a code that is meant to be RATTLE, or another scheme."""

from dataclasses import asdict
from typing import TYPE_CHECKING, Annotated

import typer

from daebench.cli.arguments import Case, Json, Param
from daebench.cli.console import bar, print_json, printable
from daebench.errors import BadInput
from daebench.runs.texts import pairs
from daebench.studies.diagnose.choose import diagnose_somewhere
from daebench.studies.diagnose.dictionary import FAULTS
from daebench.studies.diagnose.verdict import CORRECT
from daebench.studies.diagnose.verdict import diagnose as diagnosed

if TYPE_CHECKING:
    from daebench.studies.diagnose.verdict import Diagnosis

MEASURED = {
    "symmetric": "defect of symmetry",
    "symplectic": "defect of the two-form",
    "g": "largest |g|",
    "G H_p": "largest |G H_p|",
    "H": "largest |H - H0|",
}
"""Words for the measurements."""


def diagnose(
    code: Annotated[str, typer.Argument(help="FILE.py:NAME, LIBRARY.so:NAME or exec:PROGRAM; it is executed.")],
    problem: Annotated[
        str | None,
        typer.Option(
            "--problem", help="The problem that the code solves, or the path of its file, which is executed; searched for if left out."
        ),
    ] = None,
    case: Case = None,
    param: Param = None,
    scheme: Annotated[
        str, typer.Option("--as", help="The scheme that the code is meant to be. Faults are known only for rattle.")
    ] = "rattle",
    h: Annotated[
        float | None, typer.Option("--h", help="Step size; if left out, a large one, with which faults have a visible effect.")
    ] = None,
    as_json: Json = False,
) -> None:
    """Name the mistake in an integrator that is meant to be RATTLE; exit 1 unless it is correct.

    First of all, the limit of (step - state) / h as h goes to zero is held against the equations of the problem, which tells a wrong mass,
    inertia or force. Then its steps are compared with those of the scheme, of codes with one of 35 known faults, and of the schemes of
    daebench. A fault is named if the steps agree to 1e-12, or if the parts of a step show it. If two faults explain the steps, both are
    named and the verdict is unsure. A code is correct only if it meets both constraints to round-off.
    """
    if problem is None and (case is not None or param):
        raise BadInput(
            f"{'--case' if case is not None else '--param'} belongs to a problem; name it, for example --problem double_pendulum."
        )
    with bar(f"diagnose {code}") as progress:
        if problem is None:
            shown = diagnose_somewhere(code, scheme=scheme, h=h, tell=progress)
        else:
            shown = diagnosed(code, problem, case=case, parameters=pairs("param", param or []), scheme=scheme, h=h)
    if as_json:
        print_json(asdict(shown))
    else:
        _print(shown)
    raise typer.Exit(0 if shown.verdict == CORRECT else 1)


def _print(shown: "Diagnosis") -> None:

    parameters = ", ".join(f"{name}={value:g}" for name, value in shown.parameters.items())
    print(f"{shown.method} as {shown.scheme} on {shown.problem}, case {shown.case}, {parameters}, h = {shown.h:g}")
    names = [*shown.faults, *([f"resembles {shown.resembles}"] if shown.resembles else [])]
    lines = [f"{shown.verdict}: {', '.join(names)}" if names else shown.verdict]
    for name, remedy in zip(shown.faults, shown.remedies, strict=True):
        lines += [f"  {name}: the code {FAULTS[name].about}.", f"    {remedy}"]
    lines += [f"- {line.rstrip('.')}." for line in shown.evidence]
    lines += [f"- measured: {', '.join(_measured(name, value) for name, value in shown.measured.items())}."] if shown.measured else []
    if shown.not_seen:
        lines.append(f"On this problem these faults have no effect: {', '.join(shown.not_seen)}; try another with --problem.")
    print(printable("\n".join(lines)))


def _measured(name: str, value: float | str) -> str:
    what = MEASURED.get(name, name)
    return f"{what} {value}" if isinstance(value, str) else f"{what} {value:.2g}"

"""``daebench certify``: measure a code, and write a certificate that allows the measurement to be repeated."""

from pathlib import Path
from typing import Annotated, Any

import typer

from daebench.cli.arguments import Anyway, Free, Json, OnSingular, Overwrite, Param
from daebench.cli.console import bar, print_json, printable
from daebench.errors import BadInput
from daebench.pages.generation.compiled import compiled
from daebench.runs.texts import pairs
from daebench.studies.certificate.record import title

CLAIMED = {"yes": True, "true": True, "no": False, "false": False}
"""Words for claims that hold and claims that do not."""

SecondsLimit = Annotated[float, typer.Option("--seconds-limit", help="Wall-clock limit on each problem, s.")]


def certify(
    mine: Annotated[
        str,
        typer.Argument(help="FILE.py:NAME, LIBRARY.so:NAME, exec:PROGRAM or a folder of generated C, which are executed; or a scheme."),
    ],
    out: Annotated[Path, typer.Option("--out", help="Folder to write: a new one, or one with a certificate, which is replaced.")],
    problem: Annotated[
        list[str] | None, typer.Option("--problem", help="PROBLEM or PROBLEM:CASE, repeatable; three of the catalogue if left out.")
    ] = None,
    h: Annotated[float | None, typer.Option("--h", help="Step size of all but the orders; a small part of the motion if left out.")] = None,
    param: Param = None,
    claim: Annotated[
        list[str] | None, typer.Option("--claim", help="A claim of the code, for example order=2 or symplectic=yes; repeatable.")
    ] = None,
    include: Annotated[list[Path] | None, typer.Option("--include", help="Another file that the code reads or loads; repeatable.")] = None,
    option: Free = None,
    anyway: Anyway = False,
    on_singular: OnSingular = None,
    seconds_limit: SecondsLimit = 300.0,
    overwrite: Overwrite = False,
    as_json: Json = False,
) -> None:
    """Certify a code: write a page and a JSON certificate with measurements, beside copies of its files.

    Order, symmetry, two-form, constraints, energy and first integrals are measured, claimed or not, and the error against certified
    references. Problems that the code does not solve are noted; if it solves none, no certificate is written. Claims that do not hold are
    in the certificate; they are not an error. THE CODE IS EXECUTED.
    """
    from daebench.pages.certificate.certify import certify as certified

    asked: dict[str, Any] = {"problems": problem or [], "h": h, "claims": _claims(claim or []), "files": include or []}
    if Path(mine).is_dir():
        mine, asked = _of_folder(Path(mine), asked)
    with bar(f"certify {mine}") as progress:
        certificate = certified(
            mine,
            out=out,
            parameters=pairs("param", param or []),
            options=pairs("option", option or []),
            anyway=anyway,
            on_singular=on_singular,
            seconds_limit=seconds_limit,
            overwrite=overwrite,
            progress=progress,
            **asked,
        )
    if as_json:
        print_json({**certificate.content, "written": [str(out / "index.html"), str(out / "certificate.json")]})
    else:
        print(printable("\n".join(_said(certificate, out))))


def _of_folder(folder: Path, asked: dict[str, Any]) -> tuple[str, dict[str, Any]]:
    """Return the code of a folder of generated C, and what is asked, with what the folder says of itself where nothing else is asked."""
    code = compiled(folder)
    files, claims = [*asked["files"], *code.files], code.claims | asked["claims"]
    return code.code, {"problems": asked["problems"] or [code.problem], "h": asked["h"] or code.h, "claims": claims, "files": files}


def _claims(given: list[str]) -> dict[str, Any]:
    """Return name=value texts as claims."""
    claims: dict[str, Any] = {}
    for text in given:
        name, equals, value = (part.strip() for part in text.partition("="))
        if not equals:
            raise BadInput(f"--claim {text!r} must be of the form name=value, for example order=2 or symplectic=yes.")
        claims[name] = CLAIMED.get(value.lower(), int(value) if value.isdecimal() else value)
    return claims


def _said(certificate: Any, out: Path) -> list[str]:
    """Return the summary of a certificate: claims, problems, and its place."""
    whole = len(certificate.holds) + len(certificate.falls_short) + len(certificate.undetermined)
    lines = [
        f"{certificate.method}: {len(certificate.holds)} of {whole} claims hold."
        if whole
        else f"{certificate.method}: no claims are stated."
    ]
    for word, names in (("does not hold", certificate.falls_short), ("not known", certificate.undetermined)):
        lines += [f"{word}: {', '.join(names)}."] if names else []

    lines += [f"{title(problem)}: {_numbers(problem)}" for problem in certificate.measured]
    lines += [f"{where}: not measured: {why}" for where, why in certificate.refused.items()]
    return [*lines, f"written: {out / 'index.html'}, {out / 'certificate.json'}; verify it by: daebench certificate verify {out}"]


def _numbers(problem: Any) -> str:
    """Return the numbers of a problem in one line."""
    numbers, h = problem["numbers"], problem["setting"]["h"]
    components = numbers["orders"]["components"].items()
    orders = ", ".join(f"{name} {'-' if part['order'] is None else format(part['order'], '.3f')}" for name, part in components)
    energy, error = numbers["energy"], numbers["error"]
    law = f", {energy['law']}" if energy["law"] else ""
    off = "unknown" if error["value"] is None else f"{error['value']:.2g}"
    return f"order {orders}; energy {energy['verdict']}{law}; error {off} up to t = {error['t']:g} with h = {h:g}."

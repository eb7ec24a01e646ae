"""``daebench certificate``: commands on an existing certificate."""

from pathlib import Path
from typing import Annotated

import typer

from daebench.cli.arguments import Json, Trusted, TrustedCode
from daebench.cli.commands import Command
from daebench.cli.console import bar, print_json, printable
from daebench.studies.certificate.verify import Unverified, verify_certificate

app = typer.Typer(no_args_is_help=True, help="Certificates of codes: verify them.")


@app.callback()
def top() -> None:
    """Certificates of codes: verify them."""


@app.command(cls=Command)
def verify(
    file: Annotated[Path, typer.Argument(help="A certificate that daebench certify wrote, or its folder.")],
    trust: Trusted = False,
    code: TrustedCode = None,
    seconds_limit: Annotated[float, typer.Option("--seconds-limit", help="Wall-clock limit on each problem, s.")] = 300.0,
    as_json: Json = False,
) -> None:
    """Verify a certificate: run the same code on the same problems, and compare; exit 1 if a number does not agree.

    First the hashes of the code's files are checked; if a file is missing or differs, nothing is run. With --trust THE CODE BESIDE THE
    CERTIFICATE IS EXECUTED: read it first. Numbers agree if they are equal to the bit, or within the effect of round-off on another
    machine. Times are not compared.
    """
    try:
        with bar(f"verify {file}") as progress:
            verification = verify_certificate(file, trust=trust, code=code or (), seconds_limit=seconds_limit, progress=progress)
    except Unverified as error:
        if not as_json:
            raise
        print_json({"file": str(file), "agrees": False, "sentence": str(error), "equal": 0, "within": 0, "faults": [str(error)]})
        raise typer.Exit(1) from error
    if as_json:
        counts = {"equal": verification.equal, "within": verification.within, "faults": list(verification.faults)}
        print_json({"file": str(file), "agrees": verification.agrees, "sentence": verification.sentence, **counts})
    else:
        print(printable(verification.sentence))
    raise typer.Exit(0 if verification.agrees else 1)

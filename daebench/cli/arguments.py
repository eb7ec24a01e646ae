"""Arguments that several commands take, each described once."""

from pathlib import Path
from typing import Annotated

import typer

from daebench.cli.completion import case_names, method_names, problem_names

Problem = Annotated[
    str,
    typer.Argument(help="Name of a problem, or path of a problem file (ends in .py); it is executed.", autocompletion=problem_names),
]
Case = Annotated[
    str | None, typer.Option("--case", help="Named initial values; the problem's first if left out.", autocompletion=case_names)
]
OUTSIDE = "FILE.py:NAME, LIBRARY.so:NAME and exec:PROGRAM are executed"
"""Note on code from outside in the help of methods."""

Method = Annotated[
    str,
    typer.Option(
        "--method", "--methods", help=f"Name of a method, for example rattle or ida:index2; {OUTSIDE}.", autocompletion=method_names
    ),
]
Methods = Annotated[
    str, typer.Option("--methods", "--method", help=f"Names of methods, comma-separated; {OUTSIDE}.", autocompletion=method_names)
]
Param = Annotated[list[str] | None, typer.Option("--param", help="Value of a parameter, name=value; repeatable.")]
Free = Annotated[list[str] | None, typer.Option("--option", help="Free number of a method, name=value; repeatable.")]
Q0 = Annotated[str | None, typer.Option("--q0", help="Positions of a start of your own: 0.6,-0.8; points of a mechanism: B=(0.3, 0.4).")]
P0 = Annotated[str | None, typer.Option("--p0", help="Momenta of a start of your own, comma-separated.")]
V0 = Annotated[str | None, typer.Option("--v0", help="Velocities in place of momenta: 0.8,0.6; of a mechanism: B=(0, 1), spin(arm)=2.")]
Y0 = Annotated[str | None, typer.Option("--y0", help="Start of your own of a Poisson system, comma-separated.")]
Project = Annotated[bool, typer.Option("--project", help="Project the initial values onto the manifold.")]
Anyway = Annotated[bool, typer.Option("--anyway", help="Run a scheme on a structure matrix B for which it is not a Poisson integrator.")]
Algebra = Annotated[
    str, typer.Option("--algebra", help="Form of vectors: values, or arrays, for a chain of nodes; by its size if left out.")
]
OnSingular = Annotated[
    str | None,
    typer.Option(
        "--on-singular",
        help="Where G loses rank: stop, continue, or least-squares, also for redundant constraints; as the case declares if left out.",
    ),
]
Overwrite = Annotated[bool, typer.Option("--overwrite", help="Replace a file at --out that was made by another command or program.")]
Trusted = Annotated[bool, typer.Option("--trust", help="Execute the code that the file names or has with it; read that first.")]
TrustedCode = Annotated[
    list[Path] | None,
    typer.Option("--code", help="File of your own that may be executed where the file names one of the same content; repeatable."),
]
Json = Annotated[bool, typer.Option("--json", help="One JSON object on standard output.")]
Workers = Annotated[
    int | None, typer.Option("--workers", help="Number of processes on this machine for runs that are not timed; all cores if left out.")
]
StoredWorkers = Annotated[int | None, typer.Option("--workers", help="Number of processes that compute stored runs; one if left out.")]
Scheduler = Annotated[
    str | None,
    typer.Option(
        "--scheduler",
        help="Address of a Dask scheduler whose workers compute instead: tls://host:port, or tcp://host:port, where anybody who reaches "
        "the scheduler can run any code on the workers and on this machine.",
    ),
]
TlsCaFile = Annotated[
    Path | None, typer.Option("--tls-ca-file", help="For tls://, in PEM: certificate of the authority, which is for that cluster only.")
]
TlsCert = Annotated[Path | None, typer.Option("--tls-cert", help="For tls://: certificate of this machine, signed by that authority.")]
TlsKey = Annotated[Path | None, typer.Option("--tls-key", help="For tls://: the key of that certificate; in the same file if left out.")]
SideBySide = Annotated[
    bool, typer.Option("--side-by-side", help="Make timed runs side by side with others, whose load then affects the times.")
]
Compensated = Annotated[bool, typer.Option("--compensated", help="Use compensated summation over steps.")]
Store = Annotated[Path | None, typer.Option("--store", help="File of the stored runs; studies.db in the folder if left out.")]
DryRun = Annotated[bool, typer.Option("--dry-run", help="Print the number of runs to make and about how long they take.")]

Precision = Annotated[str, typer.Option("--precision", help="Number type: float64, float32, or mixed: forces in float32.")]

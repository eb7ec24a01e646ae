"""A code is certified: measured, and written down with all that is needed to measure it again, as a page and as JSON."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any

from daebench.errors import BadInput
from daebench.pages.certificate.page import write_page_of
from daebench.pages.generation.compiled import compiled
from daebench.records.code import put
from daebench.runs.files import atomic_folder, make_folder
from daebench.runs.json_values import plain
from daebench.runs.option import Option
from daebench.runs.request import Told, silent
from daebench.studies.certificate import process
from daebench.studies.certificate.make import make
from daebench.studies.certificate.record import NAME, Certificate, write
from daebench.studies.certificate.verify import Unverified, read

CLAIMED = {"yes": True, "true": True, "no": False, "false": False}
"""Words for claims that hold and claims that do not."""


def claims_in(texts: Iterable[str]) -> dict[str, Any]:
    """Return the claims in texts such as order=2 and symplectic=yes."""
    claims: dict[str, Any] = {}
    for text in texts:
        name, equals, value = (part.strip() for part in text.partition("="))
        if not equals:
            raise BadInput(f"--claim {text!r} must be of the form name=value, for example order=2 or symplectic=yes.", "claim-malformed")
        claims[name] = CLAIMED.get(value.lower(), int(value) if value.isdecimal() else value)
    return claims


def certify(
    method: Annotated[str | Callable[..., Any], Option("mine")],
    *,
    out: str | Path,
    problems: Annotated[Sequence[str], Option("--problem", repeatable=True)] = (),
    h: float | None = None,
    parameters: Mapping[str, float] | None = None,
    claims: Annotated[Mapping[str, int | bool] | None, Option("--claim", read=claims_in, repeatable=True)] = None,
    options: Mapping[str, float] | None = None,
    anyway: bool = False,
    on_singular: str | None = None,
    files: Annotated[Iterable[str | Path], Option("--include", repeatable=True)] = (),
    seconds_limit: float = process.SECONDS,
    overwrite: bool = False,
    progress: Told = silent,
) -> Certificate:
    """Certify a code: write a page and a JSON certificate with measurements, beside copies of its files.

    Order, symmetry, two-form, constraints, energy and first integrals are measured, claimed or not, and the error against certified
    references. Problems that the code does not solve are noted; if it solves none, no certificate is written. Claims that do not hold are
    in the certificate; they are not an error. THE CODE IS EXECUTED, from the copies, in processes of its own.

    Parameters
    ----------
    method : str or callable
        FILE.py:NAME, LIBRARY.so:NAME, exec:PROGRAM or a folder of generated C, which are executed; the name of a fixed-step method of
        daebench; or a function at the top of a Python file.
    out : str or Path
        Folder to write: new, empty, or with a certificate, which is replaced.
    problems : sequence of str
        PROBLEM or PROBLEM:CASE, each a name or the path of a problem file, which is executed; by default that of the folder of generated
        C, or three of the catalogue, of which those that the code is not for are noted with why.
    h : float, optional
        Step size, s, of all but the orders; by default the largest 1, 2 or 5 times a power of ten up to a quarter of a step of DOP853 at
        1e-13, on each problem.
    parameters : mapping of str to float, optional
        Parameters of the problems that are named.
    claims : mapping of str to int or bool, optional
        Claims on the code in addition to its own, for example order=2 or symplectic=yes, see
        :class:`daebench.methods.outside.method.Stated`.
    options : mapping of str to float, optional
        Free numbers of a method of daebench.
    anyway : bool
        Whether a scheme of daebench may run on a Poisson system for which it is not a Poisson integrator.
    on_singular : str, optional
        What to do where G loses rank: "stop", "continue" or "least-squares"; by default what the case declares.
    files : iterable of path
        Other files that the code reads or loads.
    seconds_limit : float
        Wall-clock limit on each problem, s.
    overwrite : bool
        Whether files may be replaced in a folder that has something else in it; other files there are kept.
    progress : callable
        Called with the fraction done and a label of the current task.

    Returns
    -------
    daebench.studies.certificate.record.Certificate

    Raises
    ------
    BadInput
        If the code, a problem or a number cannot be used, or the folder has something else in it.
    RunFailed
        If the code runs on none of the problems.

    Examples
    --------
    >>> import tempfile
    >>> import daebench
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     certificate = daebench.certify("rattle", problems=["planar_pendulum:horizontal"], out=folder)
    >>> certificate.falls_short
    []
    """
    if isinstance(method, str) and Path(method).is_dir():
        generated = compiled(Path(method))
        method, problems, h = generated.code, problems or [generated.problem], h or generated.h
        files, claims = [*files, *generated.files], {**generated.claims, **(claims or {})}
    out = Path(out)
    _require_free(out, overwrite=overwrite)
    certificate = make(
        method,
        problems=problems,
        h=h,
        parameters=parameters,
        claims=claims,
        options=options,
        anyway=anyway,
        on_singular=on_singular,
        files=files,
        seconds_limit=seconds_limit,
        progress=progress,
    )
    with atomic_folder(out) as folder:
        if certificate.code.files:
            (folder / "code").mkdir()
            certificate.code.put(folder / "code")
        put(certificate.files, folder)
        write_page_of(Certificate(folder, plain(certificate.content)))
        write(folder, certificate.content)
    return read(out / NAME)


def _require_free(out: Path, *, overwrite: bool) -> None:
    """Refuse a folder that has anything in it but a certificate, unless its files may be replaced."""
    if out.exists() and not out.is_dir():
        raise BadInput(f"--out {out}: that is not a folder; choose another path.", "certificate-out-not-folder")
    if not overwrite and out.exists() and next(out.iterdir(), None) is not None:
        try:
            read(out / NAME)
        except (BadInput, Unverified) as error:
            why = "the folder is not empty and has no certificate to replace"
            raise BadInput(
                f"--out {out}: {why}; choose a new one, or add --overwrite to replace its files.", "certificate-out-taken"
            ) from error
    make_folder(out.parent)

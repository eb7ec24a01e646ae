"""A code is certified: measured, and written down with all that is needed to measure it again, as a page and as JSON."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

from daebench.errors import BadInput
from daebench.pages.certificate.page import write_page_of
from daebench.records.code import put
from daebench.runs.files import atomic_folder, make_folder
from daebench.runs.json_values import plain
from daebench.studies.certificate import process
from daebench.studies.certificate.make import make
from daebench.studies.certificate.read import Unverified, read
from daebench.studies.certificate.record import NAME, Certificate, write


def certify(
    method: str | Callable[..., Any],
    *,
    out: str | Path,
    problems: Sequence[str] = (),
    h: float | None = None,
    parameters: Mapping[str, float] | None = None,
    claims: Mapping[str, int | bool] | None = None,
    options: Mapping[str, float] | None = None,
    anyway: bool = False,
    on_singular: str | None = None,
    files: Iterable[str | Path] = (),
    seconds_limit: float = process.SECONDS,
    overwrite: bool = False,
    progress: process.Progress = process.silent,
) -> Certificate:
    """Measure a code on some problems, and write its certificate: a page, a JSON file, and copies of all files that it is made of.

    What is measured, of claims that are stated and of others alike: orders, symmetry, symplecticity, constraints, energy and first
    integrals, the error against a certified reference where one fits, and the energy of a long run. The code is run from the copies, in
    processes of its own::

        certificate = daebench.certify("./mine.py:step", problems=["double_pendulum:swing"], out="certificate")
        print(certificate.holds, certificate.falls_short)
        print(daebench.verify_certificate("certificate", trust=True).sentence)

    Parameters
    ----------
    method : str or callable
        ``FILE.py:NAME``, ``LIBRARY.so:NAME``, ``exec:PROGRAM``, the name of a fixed-step method of daebench, or a function at the top of a
        Python file. It is executed.
    out : str or Path
        Folder to write: new, empty, or with a certificate, which is replaced.
    problems : sequence of str
        PROBLEM or PROBLEM:CASE, each a name or the path of a problem file, which is executed; by default three of the catalogue, of
        which those that the code is not for are noted with why.
    h : float, optional
        Step size, s, of all but the orders; by default the largest 1, 2 or 5 times a power of ten up to a quarter of a step of DOP853 at
        1e-13, on each problem.
    parameters : mapping of str to float, optional
        Parameters of the problems that are named.
    claims : mapping of str to int or bool, optional
        Claims on the code in addition to its own, see :class:`daebench.methods.outside.method.Stated`.
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
    out = Path(out)
    if out.exists() and not out.is_dir():
        raise BadInput(f"--out {out}: that is not a folder; choose another path.")
    if not overwrite:
        _require_free(out)
    make_folder(out.parent)
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


def _require_free(out: Path) -> None:
    """Refuse a folder that has anything in it but a certificate."""
    if not out.exists():
        return
    if next(out.iterdir(), None) is None:
        return
    try:
        read(out / NAME)
    except (BadInput, Unverified) as error:
        why = "the folder is not empty and has no certificate to replace"
        raise BadInput(f"--out {out}: {why}; choose a new one, or add --overwrite to replace its files.") from error

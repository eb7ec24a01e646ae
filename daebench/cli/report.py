"""``daebench report``: write one page with its computations, or all pages."""

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from daebench.cli.console import bar
from daebench.errors import BadInput, Interrupted

if TYPE_CHECKING:
    from daebench.pages.report.gallery import Made

ALL, COURT = "all", "court"


def report(
    name: Annotated[str, typer.Argument(help="Name of a report, for example index-reduction; the path of a file; court; or all.")],
    certificates: Annotated[
        Path | None, typer.Argument(help="With court: a folder of certificates, each in a separate folder.", show_default=False)
    ] = None,
    out: Annotated[Path, typer.Option("--out", help="Folder to write to.")] = Path("output"),
    anew: Annotated[bool, typer.Option("--anew", help="With all: make every page, not only stale ones.")] = False,
    archive: Annotated[Path | None, typer.Option("--archive", help="With all: also put the pages into this ZIP file.")] = None,
    trust: Annotated[bool, typer.Option("--trust", help="With court: execute the code of the certificates; read it first.")] = False,
) -> None:
    """Write a report: one HTML page, its figures as SVG and PNG, and every figure's data as CSV; or all pages and an index.

    With all, pages that are up to date are not changed; after an interruption, the same command continues. With court, each certificate of
    a folder is verified, which requires --trust, and a table of the verified ones is written.
    """
    if name == COURT:
        _court(certificates, out, trust)
        return
    if certificates or trust:
        raise BadInput(f"{certificates or '--trust'} belongs to court; leave it out.")
    if name != ALL and (anew or archive):
        raise BadInput(f"--{'anew' if anew else 'archive'} belongs to all; a single report is always made anew.")
    from daebench.runs.files import make_folder

    if name == ALL:
        _all(out, anew, archive)
        return
    from daebench.pages.report.gallery import build
    from daebench.pages.report.reports import find

    find(name)
    make_folder(out)
    with bar(f"report {name}") as progress:
        page = build(name, out, progress)
    print(f"written: {page}")


def _court(certificates: Path | None, out: Path, trust: bool) -> None:
    """Verify certificates, and write the page of those that hold."""
    if certificates is None:
        raise BadInput("report court needs a folder of certificates, as daebench report court certificates --trust.")
    from daebench.pages.certificate.court import court

    with bar(f"report {COURT}") as progress:
        page = court(certificates, out, trust=trust, progress=progress)
    print(f"written: {page}")


def _all(out: Path, anew: bool, archive: Path | None) -> None:
    from daebench.pages.gallery import pages
    from daebench.pages.lesson.installed import missing
    from daebench.pages.report.archive import write_archive
    from daebench.pages.report.gallery import build_all
    from daebench.runs.files import check_zip, make_folder

    if archive:
        check_zip(archive, "--archive")
    make_folder(out)
    with bar("gallery") as progress:
        try:
            build_all(out, pages(), progress, _tell, anew=anew)
        except (KeyboardInterrupt, Interrupted) as stop:
            raise Interrupted(f"interrupted; the finished pages are in {out}: run again to continue.") from stop
    if absent := missing():
        print(
            f"daebench: the lessons are left out, because they need {' and '.join(absent)}: pip install 'daebench[lessons]'.",
            file=sys.stderr,
        )
    print(f"written: {out / 'index.html'}")
    if archive:
        print(f"written: {write_archive(out, archive)}")


def _tell(made: "Made") -> None:
    """Print the outcome of a page."""
    outcome = f"failed: {made.failure}" if made.failure else f"made in {made.seconds:.0f} s" if made.seconds else "up to date"
    print(f"{made.name}: {outcome}", flush=True)

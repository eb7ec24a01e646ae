"""``daebench report``: a page that is computed as it is written, or all of them."""

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
        Path | None, typer.Argument(help="With court: a folder of certificates, each in a folder of its own.", show_default=False)
    ] = None,
    out: Annotated[Path, typer.Option("--out", help="Folder to write to.")] = Path("output"),
    anew: Annotated[bool, typer.Option("--anew", help="With all: make every page, not only those that are stale.")] = False,
    archive: Annotated[Path | None, typer.Option("--archive", help="With all: put the pages into this ZIP file as well.")] = None,
    trust: Annotated[bool, typer.Option("--trust", help="With court: execute the code of the certificates: read it first.")] = False,
) -> None:
    """Write a report: one HTML page, its figures as SVG and PNG, and every figure's data as CSV; or all pages and an index.

    With all, pages that are as they should be are left alone: interrupted, the same command goes on where it stopped. With court, each
    certificate of a folder is made again, which takes --trust, and those that are verified become a table of contestants.
    """
    if name == COURT:
        _court(certificates, out, trust)
        return
    if certificates or trust:
        raise BadInput(f"{certificates or '--trust'} goes with court; leave it out.")
    if name != ALL and (anew or archive):
        raise BadInput(f"--{'anew' if anew else 'archive'} goes with all; a single report is always made anew.")
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
            raise Interrupted(f"interrupted; what was made is in {out}: run again to go on.") from stop
    if absent := missing():
        print(
            f"daebench: the lessons are left out, for they need {' and '.join(absent)}: pip install 'daebench[lessons]'.", file=sys.stderr
        )
    print(f"written: {out / 'index.html'}")
    if archive:
        print(f"written: {write_archive(out, archive)}")


def _tell(made: "Made") -> None:
    """Print what became of a page."""
    outcome = f"failed: {made.failure}" if made.failure else f"made in {made.seconds:.0f} s" if made.seconds else "as it should be"
    print(f"{made.name}: {outcome}", flush=True)

"""``daebench report``: write one page with its computations, or all pages."""

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from daebench.cli.arguments import Json, Overwrite
from daebench.cli.console import bar, print_json, print_written
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
    overwrite: Overwrite = False,
    as_json: Json = False,
) -> None:
    """Write a report: one HTML page, its figures as SVG and PNG, and every figure's data as CSV; or all pages and an index.

    With all, pages that are up to date are not changed; after an interruption, the same command continues. With court, each certificate of
    a folder is verified, which requires --trust, and a table of the verified ones is written.
    """
    if name == COURT:
        print_written([_court(certificates, out, trust)], as_json=as_json)
        return
    if certificates or trust:
        raise BadInput(f"{certificates or '--trust'} belongs to court; leave it out.", "option-belongs-to-court")
    if name != ALL and (anew or archive):
        raise BadInput(f"--{'anew' if anew else 'archive'} belongs to all; a single report is always made anew.", "option-belongs-to-all")
    from daebench.runs.files import make_folder

    if name == ALL:
        _all(out, anew, archive, as_json=as_json)
        return
    from daebench.pages.report.gallery import build
    from daebench.pages.report.reports import find

    find(name)
    make_folder(out)
    with bar(f"report {name}") as progress:
        page = build(name, out, progress)
    print_written([page], as_json=as_json)


def _court(certificates: Path | None, out: Path, trust: bool) -> Path:
    """Verify certificates, write the page of those that hold, and return its path."""
    if certificates is None:
        raise BadInput(
            "report court needs a folder of certificates, as daebench report court certificates --trust.", "court-without-folder"
        )
    from daebench.pages.certificate.court import court

    with bar(f"report {COURT}") as progress:
        return court(certificates, out, trust=trust, progress=progress)


def _all(out: Path, anew: bool, archive: Path | None, *, as_json: bool) -> None:
    """Make all pages, and print what became of them; as JSON also where some failed."""
    from daebench.pages.lesson.installed import missing
    from daebench.pages.report.archive import write_archive
    from daebench.pages.report.gallery import PagesFailed
    from daebench.runs.files import check_zip, make_folder
    from daebench.runs.outputs import described, require_own

    if archive:
        check_zip(archive, "--archive")
        require_own(archive, "--archive")
    make_folder(out)
    outcomes: list[Made] = []
    summary: dict[str, Any] = {"missing": missing(), "written": [str(out / "index.html")]}
    try:
        _make(out, outcomes, anew=anew, as_json=as_json)
    except PagesFailed:
        if as_json:
            print_json({"pages": list(map(_plain, outcomes)), **summary})
        raise
    if archive:
        with described([archive], {"Pages": f"those of {out}"}):
            summary["written"].append(str(write_archive(out, archive)))
    if as_json:
        print_json({"pages": list(map(_plain, outcomes)), **summary})
        return
    if absent := summary["missing"]:
        print(
            f"daebench: the lessons are left out, because they need {' and '.join(absent)}: pip install 'daebench[lessons]'.",
            file=sys.stderr,
        )
    for path in summary["written"]:
        print(f"written: {path}")


def _make(out: Path, outcomes: "list[Made]", *, anew: bool, as_json: bool) -> None:
    """Make the pages that are stale; note the outcome of each, and print it unless JSON is asked for."""
    from daebench.pages.gallery import pages
    from daebench.pages.report.gallery import build_all

    def tell(page: "Made") -> None:
        outcomes.append(page)
        if not as_json:
            print(f"{page.name}: {_outcome(page)}", flush=True)

    with bar("gallery") as progress:
        try:
            build_all(out, pages(), progress, tell, anew=anew)
        except (KeyboardInterrupt, Interrupted) as stop:
            raise Interrupted(f"interrupted; the finished pages are in {out}: run again to continue.") from stop


def _outcome(page: "Made") -> str:
    return f"failed: {page.failure}" if page.failure else f"made in {page.seconds:.0f} s" if page.seconds else "up to date"


def _plain(page: "Made") -> dict[str, Any]:
    """Return the outcome of a page, for JSON."""
    status = "failed" if page.failure else "made" if page.seconds else "fresh"
    path = None if page.page is None else str(page.page)
    return {"name": page.name, "status": status, "page": path, "seconds": page.seconds, "failure": page.failure or None}

"""The gallery: pages in one folder, each with a build stamp of what it was made of, and an index of all that is there."""

from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from daebench.errors import DaebenchError, Interrupted
from daebench.pages.report import build_stamp
from daebench.pages.report.deferred import Waiting, clock, putting_off
from daebench.pages.report.index import write_index
from daebench.pages.report.page import Progress
from daebench.pages.report.reports import Report, find
from daebench.runs.outputs import require_own, writing
from daebench.runs.request import silent

SECONDS = {
    "index-reduction": 30,
    "methods": 105,
    "tolerances": 110,
    "poisson": 30,
    "problems": 210,
    "work-precision": 155,
    "ensembles": 85,
    "molecules": 90,
    "nonholonomic": 110,
    "extremes": 85,
    "lesson-why-symplectic": 5,
    "lesson-shake-to-lobatto": 5,
    "lesson-tolerance": 5,
    "lesson-poisson-maps": 5,
    "lesson-nonholonomic": 5,
    "lesson-extremes": 5,
}
"""Pages in the order in which they are best read, others follow; and how long each takes, about, on two cores with nothing compiled.
Lessons are made while processes of reports compute, and so their time is no part of the time of a gallery."""


class PagesFailed(DaebenchError):
    """Pages of the gallery could not be made, or would have said what is not so."""


@dataclass(frozen=True)
class Made:
    """Outcome of making a page."""

    name: str
    """Its name."""
    page: Path | None
    """The page; None where it failed."""
    seconds: float
    """How long it took; 0 where it was as it should be."""
    failure: str = ""
    """Why it failed, or nothing."""


def build(name: str, out: Path, progress: Progress | None = None) -> Path:
    """Write a report into a folder of its name, and the index of all that is beside it; return the path of its page.

    Parameters
    ----------
    name : str
        Name as ``daebench list reports`` has it, or the path of a file, which is executed.
    out : Path
        Folder for all reports; made where it is missing.
    progress : callable, optional
        Called with the fraction done and a label of the current task.

    Raises
    ------
    BadInput
        If there is no such report, or something is wrong with a report of one's own.
    DaebenchError
        If what the report is about to say is not what was measured; nothing is written over an older page then.

    Examples
    --------
    >>> from tempfile import mkdtemp
    >>> folder = Path(mkdtemp())
    >>> code = "def make(out, progress): (out / 'index.html').write_text('Hello')"
    >>> written = (folder / "mine.py").write_text(code)
    >>> build(f"{folder}/mine.py", folder / "out").name
    'index.html'
    """
    return put(find(name), out, progress)


def put(report: Report, out: Path, progress: Progress | None = None) -> Path:
    """Write a page into a folder of its name, and the index of all that is beside it; return the path of the page."""
    out = Path(out)
    began = clock()
    digest = build_stamp.digest(report.files())
    with _own(out, [report]):
        page = report.make(out / report.name, progress or silent)
        _stamp(report, out, digest, clock() - began)
        write_index(out, order(out), {})
    return page


@contextmanager
def _own(out: Path, reports: Iterable[Report]) -> Iterator[None]:
    """Mark the folders of pages as theirs before they are written; refuse folders and an index of somebody else."""
    index = out / "index.html"
    if index.exists() and not any(out.glob(f"*/{build_stamp.STAMP}")):
        require_own(index)
    for report in reports:
        build_stamp.begin(out / report.name, **_about(report))
    with writing("", overwrite=True):
        yield


def _about(report: Report) -> dict[str, str]:
    return {"title": report.name, "kind": report.kind, "about": report.summary, "command": report.command}


def _stamp(report: Report, out: Path, digest: str, seconds: float) -> None:
    build_stamp.write(out / report.name, **_about(report), digest=digest, seconds=seconds)


def order(out: Path) -> list[str]:
    """Return the names of the pages that are in a folder in the order in which they are best read."""
    return in_order(path.parent.name for path in out.glob(f"*/{build_stamp.STAMP}") if (path.parent / "index.html").is_file())


def in_order(names: Iterable[str]) -> list[str]:
    """Return names of pages in the order in which they are best read; those that are not known here follow by their names."""
    known = list(SECONDS)
    return sorted(names, key=lambda name: (known.index(name) if name in known else len(known), name))


def build_all(
    out: Path, reports: Sequence[Report], progress: Progress, callback: Callable[[Made], None], *, anew: bool = False
) -> list[Made]:
    """Make every page that is stale, and the index; return what became of each page.

    A page is stale where daebench, a file of one's own that makes it, or the version of a package that it stands on is another than when
    it was made, and where one of its files has been changed or lost. Interrupted, it goes on where it stopped. A page that fails does not
    keep the others from being made. Lessons are made while processes of a report compute, or at the end.
    """
    digests = {page.name: build_stamp.digest(page.files()) for page in reports}
    stale = [page.name for page in reports if anew or not build_stamp.is_fresh(out / page.name, digests[page.name])]
    measured = {page: expected(page, out) for page in reports if page.name in stale and page.kind != "lesson"}
    over, reached, outcomes = 0.0, 0.0, list[Made]()

    def report_outcome(outcome: Made) -> None:
        outcomes.append(outcome)
        callback(outcome)
        write_index(out, order(out), {outcome.name: outcome.failure for outcome in outcomes if outcome.failure})

    def tell(fraction: float, label: str) -> None:
        nonlocal reached
        reached = max(reached, fraction)
        progress(reached, label)

    with _own(out, [page for page in reports if page.name in stale]), putting_off() as waiting:
        for page in reports:
            if page.name not in stale:
                report_outcome(Made(page.name, out / page.name / "index.html", 0.0))
            elif page.kind == "lesson":
                waiting.spare.append(
                    partial(_make, page, out, digests[page.name], _part(tell, page.name, 0.0, 0.0), waiting, report_outcome)
                )
        for page, seconds in measured.items():
            share = seconds / sum(measured.values())
            _make(page, out, digests[page.name], _part(tell, page.name, over, share), waiting, report_outcome)
            over += share
    progress(1.0, "done")
    if failures := [f"{outcome.name}: {outcome.failure.rstrip('.')}" for outcome in outcomes if outcome.failure]:
        raise PagesFailed(
            f"{len(failures)} of {len(outcomes)} pages failed, the others are written: {'; '.join(failures)}.", "pages-failed"
        )
    return outcomes


def expected(report: Report, out: Path) -> float:
    """Return how many seconds a page will take, about: as long as the last time, or as is known of it, or a minute."""
    stamp = build_stamp.read(out / report.name)
    return stamp.seconds if stamp and stamp.seconds > 0 else SECONDS.get(report.name, 60.0)


def _part(progress: Progress, name: str, over: float, share: float) -> Progress:
    return lambda fraction, doing: progress(over + share * fraction, f"{name}: {doing}")


def _make(report: Report, out: Path, digest: str, progress: Progress, waiting: Waiting, callback: Callable[[Made], None]) -> None:
    """Measure a page, draw, write and stamp it, and tell what became of it; where it puts something off, all that follows is put off."""
    began, before = clock(), list(waiting.works)
    try:
        page = report.make(out / report.name, progress)
    except Interrupted:
        raise
    except DaebenchError as error:
        callback(Made(report.name, None, clock() - began, str(error)))
        return
    later_works = [work for work in waiting.works if work not in before]
    waiting.works = [work for work in waiting.works if work in before]
    measured = clock() - began

    def finish() -> None:
        again = clock()
        try:
            for work in later_works:
                work()
        except Interrupted:
            raise
        except DaebenchError as error:
            callback(Made(report.name, None, measured, str(error)))
            return
        seconds = measured + clock() - again
        _stamp(report, out, digest, seconds)
        callback(Made(report.name, page, seconds))

    if later_works:
        waiting.works.append(finish)
    else:
        finish()

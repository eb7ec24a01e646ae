"""Comparison of certificates: a folder of them becomes a table of contestants, only of those that can be verified."""

import math
from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path
from typing import Any

import pandas as pd
from markupsafe import Markup

from daebench.draw.figures import curve, drawing, grid_of_axes, legend_below, save
from daebench.errors import BadInput, DaebenchError
from daebench.pages.certificate.tables import defect, holds, known, order, tabulated
from daebench.pages.report import build_stamp
from daebench.pages.report.gallery import put
from daebench.pages.report.page import Progress, write_page
from daebench.pages.report.pictures import picture
from daebench.pages.report.reports import Report
from daebench.pages.report.sentences import at_most, number
from daebench.pages.report.tables import Of, code, long, text
from daebench.runs.files import make_folder
from daebench.runs.request import silent
from daebench.studies.certificate import process
from daebench.studies.certificate.record import energy, title, verdicts
from daebench.studies.certificate.verify import Unverified, Verification, code_in, foreign_names, read, verify_certificate

NAME = "court"

ABOUT = "A table of certified codes, only of those whose certificates were reproduced."


@dataclass(frozen=True)
class Excluded:
    """A file that is not a verifiable certificate."""

    name: str
    """Its path in the folder."""
    why: str
    """The reason, in one sentence."""


@dataclass(frozen=True)
class Entry:
    """A certificate that was verified."""

    name: str
    """The path of its folder, seen from that of the court."""
    verification: Verification
    """What was measured here."""


def candidates(folder: Path) -> list[Path]:
    """Return the files that may be certificates: all JSON files of a folder and of the folders in it."""
    if not folder.is_dir():
        raise BadInput(f"there is no folder {folder}; give one with folders of certificates.", "no-court-folder")
    # A build stamp is JSON, too; one is there if pages are written into the same folder.
    files = sorted(
        {*folder.glob("*.json"), *folder.glob("*/*.json")} - {*folder.glob(f"*/{build_stamp.STAMP}"), folder / build_stamp.STAMP}
    )
    if not files:
        raise BadInput(
            f"{folder} has no certificates; daebench certify writes one into a folder, and {folder} must contain such folders.",
            "no-certificates-in-folder",
        )
    return files


def executed(files: Iterable[Path]) -> list[str]:
    """Return the codes that would be executed to verify certificates: those that stand beside them."""
    names = []
    for file in files:
        try:
            certificate = read(file)
            if not all(name.is_own for name in foreign_names(certificate, code_in(certificate))):
                names.append(f"{certificate.method} of {file.parent.name}")
        except (BadInput, Unverified):
            continue
    return names


def court(
    folder: str | Path, out: str | Path, *, trust: bool = False, seconds_limit: float = process.SECONDS, progress: Progress = silent
) -> Path:
    """Write the page of a court into ``out/court``, and return its path; every certificate is made again.

    Parameters
    ----------
    folder : str or Path
        A folder of certificates, each in a folder of its own, as :func:`daebench.certify` writes them.
    out : str or Path
        Folder for pages.
    trust : bool
        Whether code that stands beside the certificates may be executed, as it must be to verify them.
    seconds_limit : float
        Wall-clock limit on each problem of each certificate, s.
    progress : callable
        Called with the fraction done and a label of the current task.

    Raises
    ------
    BadInput
        If the folder does not exist or has no certificates, or if they have their own code and ``trust`` is not given.
    """
    folder = Path(folder)
    files = candidates(folder)
    if (names := executed(files)) and not trust:
        raise BadInput(
            f"{folder} has certificates of {', '.join(names)}, whose code would be executed; read it first, and add --trust.",
            "certificates-not-trusted",
        )
    make_folder(Path(out))

    def make(place: Path, tell: Progress) -> Path:
        entries, excluded = judged(folder, files, seconds_limit, tell, trust=trust)
        return _page(place, f"daebench report {NAME} {folder}{' --trust' * bool(names)}", entries, excluded)

    return put(Report(NAME, ABOUT, f"daebench report {NAME} {folder}", make, lambda: files), Path(out), progress)


def judged(
    folder: Path, files: Sequence[Path], seconds_limit: float, progress: Progress, *, trust: bool
) -> tuple[list[Entry], list[Excluded]]:
    """Return the certificates that were verified, and the files that were not, with why."""
    entries, excluded = [], []
    for k, file in enumerate(files):
        name = file.relative_to(folder).as_posix()
        progress(k / len(files), name)
        try:
            verification = verify_certificate(file, trust=trust, seconds_limit=seconds_limit)
        except (DaebenchError, OSError) as error:
            excluded.append(Excluded(name, str(error)))
            continue
        if verification.agrees:
            entries.append(Entry(file.parent.relative_to(folder).as_posix() if file.parent != folder else file.stem, verification))
        else:
            excluded.append(Excluded(name, verification.sentence))
    progress(1.0, "page")
    return entries, excluded


def _page(out: Path, command: str, entries: Sequence[Entry], excluded: Sequence[Excluded]) -> Path:
    fields = groups(entries)
    return write_page(
        (Path(__file__).parent / "court.html").read_text(encoding="utf-8"),
        out / "index.html",
        command,
        entries=entries,
        excluded=excluded_table(excluded) if excluded else "",
        left_out=len(excluded),
        tables=[contestants_table(k, where, rows) for k, (where, rows) in enumerate(fields.items(), 1)],
        drawn=draw(out, fields) if fields else "",
        equal=sum(entry.verification.equal for entry in entries),
        within=sum(entry.verification.within for entry in entries),
    )


Row = tuple[Entry, Any]
"""A contestant, and a problem as it was measured here."""


def groups(entries: Sequence[Entry]) -> dict[str, list[Row]]:
    """Return contestants by what they can be compared on, a problem with its case, parameters and step size; the one with most is first."""
    together: dict[str, list[Row]] = {}
    for entry in entries:
        for problem in entry.verification.problems:
            if "refused" not in problem:
                together.setdefault(f"{title(problem)}, h = {problem['setting']['h']:g}", []).append((entry, problem))
    return dict(sorted(together.items(), key=lambda pair: -len(pair[1])))


def label(name: str) -> str:
    """Return a name as Matplotlib takes it: no formula, and not one of those that a legend leaves out."""
    return f" {name}".replace("$", r"\$")


SHOWN = 1e3
"""Errors are shown up to so many times the least of the contestant that is furthest off."""


def _top(parts: Sequence[Any]) -> float | None:
    """Return the largest error that is shown: with large steps some are without measure."""
    least = [float(part["error"].min()) for part in parts if part["error"].min() > 0]
    largest = max((float(part["error"].max()) for part in parts), default=math.nan)
    return SHOWN * max(least) if least and largest > SHOWN * max(least) else None


def draw(out: Path, fields: dict[str, list[Row]]) -> Markup:
    """Return the picture of a court: the errors of all contestants over step sizes, on the problem that most of them have."""
    where, rows = next(iter(fields.items()))
    parts = []
    with drawing():
        figure, axes = grid_of_axes(1, 1, 3.4, x="step size h (s)", y="largest error")
        for k, (entry, problem) in enumerate(rows):
            orders = problem["numbers"]["orders"]
            component = "y" if "y" in orders["errors"] else "q"
            errors = [float("nan") if error is None else error for error in orders["errors"][component]]
            axes[0, 0].loglog(orders["h"], errors, label=label(entry.name), **curve(k))
            parts.append(pd.DataFrame({"contestant": entry.name, "h": orders["h"], "error": errors}))
        axes[0, 0].set_ylim(top=_top(parts))
        axes[0, 0].set_title(label(where.rpartition(", h = ")[0]))
        legend_below(figure, axes[0, 0], 3)
        svg = save(figure, out / "figures", "errors", pd.concat(parts, ignore_index=True))
    alt = "Errors over step sizes, a curve for each contestant."
    return picture(
        svg, alt, "<b>Errors of the positions, or of the state of a Poisson system, over step sizes,</b> as they were measured here."
    )


def contestants_table(k: int, where: str, rows: Sequence[Row]) -> Markup:
    """Return a row for each contestant on one problem with one step size, the most accurate first."""
    cells = sorted((_row(entry, problem) for entry, problem in rows), key=lambda row: (math.isnan(row["error"]), row["error"]))
    rounding = partial(number, digits=1)  # there may be no more than rounding
    columns = {
        "name": "contestant",
        "method": (code, "code"),
        "holds": "claims<small>that hold</small>",
        "numbers": (Of(order, "numbers"), "order"),
        "error": (at_most, "error<small>largest</small>"),
        "energy": text,
        "size": (at_most, "energy error<small>of kinetic energy</small>"),
        "g": (rounding, "|<i>g</i>|"),
        "defect": (rounding, "defect of the<small>two-form</small>"),
        "microseconds": (number, "a step<small>µs</small>"),
    }
    t = rows[0][1]["numbers"]["error"]["t"]
    caption = Markup("<b>{}.</b> Error: the largest of a coordinate up to t = {:g}. Every number was measured here.").format(where, t)
    return tabulated(f"contestants-{k}", cells, columns, caption)


def _row(entry: Entry, problem: Any) -> dict[str, Any]:
    numbers = problem["numbers"]
    return {
        "name": entry.name,
        "method": entry.verification.certificate.method,
        "holds": holds(verdicts(entry.verification.problems)),
        "numbers": numbers,
        "error": known(numbers["error"]["value"]),
        "energy": energy(numbers),
        "size": known(numbers["energy"]["size"]),
        "g": known(numbers["conserved"].get("g")),
        "defect": defect(numbers),
        "microseconds": 1e6 * known(problem["seconds"]),
    }


def excluded_table(excluded: Sequence[Excluded]) -> Markup:
    """Return a row for each file that was left out, with why."""
    caption = "<b>Left out.</b> The tables contain nothing from these files."
    return tabulated("excluded", map(asdict, excluded), {"name": (code, "file"), "why": long}, caption)

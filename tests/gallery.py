"""The small gallery that is kept with the sources: ``python tests/gallery.py OUT`` takes it from what ``daebench report all`` wrote."""

import json
import re
import shutil
import sys
from pathlib import Path
from zipfile import ZipFile

from PIL import Image

from daebench.methods.catalogue import reports
from daebench.pages.gallery import pages
from daebench.pages.report import build_stamp
from daebench.pages.report.archive import write_archive
from daebench.pages.report.gallery import order
from daebench.pages.report.index import write_index

PLACE = Path(__file__).parent.parent / "reports" / "gallery"
SHOWN = {
    "two_motions": "index-reduction/figures/two_motions",
    "drift": "index-reduction/figures/drift",
    "methods": "methods/figures/matrix",
    "tolerances": "tolerances/figures/accuracy",
    "poisson": "poisson/figures/orbits",
    "problems": "problems/figures/scenes",
    "extremes": "extremes/figures/map",
    "engines": "engines/figures/cost",
    "ensembles": "ensembles/figures/errors",
    "nonholonomic": "nonholonomic/figures/energy",
}
"""Pictures of the README: their names there, and where they come from."""

COLORS, WIDE = 64, 1300
LARGE = 1_000_000
"""Bytes of a table from which on it is not kept beside its picture, nor ten times as many in the archive: the report writes it."""


def small(picture, path):
    """Write a picture with few colours, which is a third of its size."""
    with Image.open(picture) as whole:
        flat = whole.convert("RGB")
    flat.thumbnail((WIDE, 10 * WIDE))
    flat.quantize(COLORS, dither=Image.Dither.NONE).save(path, optimize=True)


def restore(out):
    """Put the pages that a folder has not there from the gallery as it was: that of the engines, which is made by hand, or all others."""
    known = {page.name: {"title": page.name, "kind": page.kind, "about": page.summary, "command": page.command} for page in pages()}
    with ZipFile(PLACE / "gallery.zip") as archive:
        for name in sorted({Path(file).parts[0] for file in archive.namelist() if "/" in file} - set(order(out))):
            print(f"{name}: as it was")
            archive.extractall(out, [file for file in archive.namelist() if file.startswith(f"{name}/")])
            by_hand = {"title": name, "kind": "report", "about": reports().get(name, ""), "command": f"daebench report {name}"}
            build_stamp.write(out / name, **known.get(name, by_hand), digest="", seconds=0.0)
            date(out / name)
    write_index(out, order(out), {})


def date(folder):
    """Let the build stamp of a page that is as it was say the last day that the page itself has."""
    days = re.findall(r"\b20\d\d-\d\d-\d\d\b", (folder / "index.html").read_text(encoding="utf-8"))
    stamp = json.loads((folder / build_stamp.STAMP).read_text(encoding="utf-8"))
    (folder / build_stamp.STAMP).write_text(json.dumps(stamp | {"day": max(days)}, indent=1), encoding="utf-8")


def main(out):
    restore(out)  # first: the index says of which commit it is, and has no changes to tell of yet
    for name, source in SHOWN.items():
        if (out / f"{source}.png").is_file():
            small(out / f"{source}.png", PLACE / f"{name}.png")
            numbers = out / f"{source}.csv"
            if numbers.stat().st_size < LARGE:
                shutil.copy(numbers, PLACE / f"{name}.csv")
    write_archive(out, PLACE / "gallery.zip", largest=10 * LARGE)


if __name__ == "__main__":
    main(Path(sys.argv[1]))

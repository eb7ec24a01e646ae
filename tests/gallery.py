"""The small gallery that is kept with the sources: ``python tests/gallery.py OUT`` takes it from what ``daebench report all`` wrote."""

import shutil
import sys
from pathlib import Path

from PIL import Image

from daebench.pages.report.archive import write_archive

PLACE = Path(__file__).parent.parent / "reports" / "gallery"
SHOWN = {
    "drift": "index-reduction/figures/drift",
    "methods": "methods/figures/matrix",
    "tolerances": "tolerances/figures/accuracy",
    "poisson": "poisson/figures/orbits",
    "problems": "problems/figures/scenes",
    "extremes": "extremes/figures/map",
}
"""Pictures of the README: their names there, and where they come from."""

COLORS, WIDE = 64, 1300


def small(picture, path):
    """Write a picture with few colours, which is a third of its size."""
    with Image.open(picture) as whole:
        flat = whole.convert("RGB")
    flat.thumbnail((WIDE, 10 * WIDE))
    flat.quantize(COLORS, dither=Image.Dither.NONE).save(path, optimize=True)


def main(out):
    for name, source in SHOWN.items():
        small(out / f"{source}.png", PLACE / f"{name}.png")
        shutil.copy(out / f"{source}.csv", PLACE / f"{name}.csv")
    write_archive(out, PLACE / "gallery.zip")


if __name__ == "__main__":
    main(Path(sys.argv[1]))

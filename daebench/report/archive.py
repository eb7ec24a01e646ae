"""The gallery as one ZIP file for those who have no daebench: the pages and the pictures of the index, without what lies beside them."""

import re
from pathlib import Path
from zipfile import ZIP_DEFLATED, ZipFile, ZipInfo

from daebench.errors import BadInput
from daebench.files import atomic, check_place
from daebench.report import freshness

LONG_AGO = (1980, 1, 1, 0, 0, 0)
"""Time of every file in the archive, so that the same pages give the same bytes."""

BESIDE = re.compile(r'\s*<span class="(?:files|beside)">.*?</span>', re.DOTALL)
"""What a page says of the files beside it, which are not in the archive."""


def check_archive(path: Path) -> None:
    """Refuse an archive before the work that would fill it.

    Raises
    ------
    BadInput
        If it does not end in .zip, or cannot be written.
    """
    if path.suffix.lower() != ".zip":
        raise BadInput(f"--archive {path}: the file must end in .zip.")
    check_place(path, "--archive")


def write_archive(out: Path, path: Path) -> Path:
    """Write the pages of a gallery, its index, and the pictures of that into a ZIP file; return its path."""
    index = (out / "index.html").read_text(encoding="utf-8")
    with atomic(path) as scratch, ZipFile(scratch, "w", ZIP_DEFLATED) as archive:
        for stamp in ["", *sorted(each.parent.name for each in out.glob(f"*/{freshness.STAMP}"))]:
            page = Path(stamp) / "index.html"
            text = BESIDE.sub("", (out / page).read_text(encoding="utf-8"))
            _add(archive, page.as_posix(), text.encode())
        for picture in sorted(set(re.findall(r'<img src="([^"]+)"', index))):
            _add(archive, picture, (out / picture).read_bytes())
    return path


def _add(archive: ZipFile, name: str, content: bytes) -> None:
    archive.writestr(ZipInfo(name, LONG_AGO), content, ZIP_DEFLATED, 9)

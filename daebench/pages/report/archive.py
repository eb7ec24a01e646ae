"""The gallery as one ZIP file for those who have no daebench: the pages and the pictures of the index, without what lies beside them."""

import posixpath
import re
from pathlib import Path
from zipfile import ZIP_DEFLATED, ZipFile, ZipInfo

from daebench.pages.report import build_stamp
from daebench.runs.files import atomic

LONG_AGO = (1980, 1, 1, 0, 0, 0)
"""Time of every file in the archive, so that the same pages give the same bytes."""

BESIDE = re.compile(r'\s*<span class="(?:files|beside)">.*?</span>', re.DOTALL)
"""What a page says of the files beside it, which are not in the archive."""

LINK = re.compile(r'<a\b[^>]*?href="(?![a-z]+:|#)([^"#]+)[^"]*"[^>]*>(.*?)</a>', re.DOTALL)
"""A link to another file."""


def write_archive(out: Path, path: Path) -> Path:
    """Write the pages of a gallery, its index, and the pictures of that into a ZIP file; return its path."""
    index = (out / "index.html").read_text(encoding="utf-8")
    pages = ["index.html", *sorted(f"{stamp.parent.name}/index.html" for stamp in out.glob(f"*/{build_stamp.STAMP}"))]
    pictures = sorted(set(re.findall(r'<img src="([^"]+)"', index)))
    with atomic(path) as scratch, ZipFile(scratch, "w", ZIP_DEFLATED) as archive:
        for page in pages:
            _add(archive, page, _alone((out / page).read_text(encoding="utf-8"), page, {*pages, *pictures}).encode())
        for picture in pictures:
            _add(archive, picture, (out / picture).read_bytes())
    return path


def _alone(text: str, page: str, there: set[str]) -> str:
    """Return a page without what it says of files beside it, and with the words alone of links to files that are not there."""

    def kept(link: re.Match[str]) -> str:
        return link[0] if posixpath.normpath(posixpath.join(posixpath.dirname(page), link[1])) in there else link[2]

    return LINK.sub(kept, BESIDE.sub("", text))


def _add(archive: ZipFile, name: str, content: bytes) -> None:
    archive.writestr(ZipInfo(name, LONG_AGO), content, ZIP_DEFLATED, 9)

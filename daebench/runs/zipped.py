"""ZIP files from elsewhere, read with bounds: their unpacked size is checked before anything is unpacked."""

import io
import zipfile
import zlib
from collections.abc import Mapping
from pathlib import Path
from typing import IO, Any

import numpy as np
from numpy.typing import NDArray

from daebench.errors import BadInput
from daebench.runs.schema import shown

MOST_MEMBERS = 10_000
"""Largest number of files in a ZIP file."""

UNREADABLE = (
    OSError,
    EOFError,
    ValueError,
    KeyError,
    TypeError,
    AttributeError,
    SyntaxError,  # from a header of an array
    RuntimeError,  # a file that is encrypted, or nested too deeply
    zipfile.BadZipFile,
    zlib.error,
)
"""Exceptions from reading a damaged ZIP file, or an array or a text in it."""

KINDS = "fiubU"
"""Kinds of arrays of numbers and texts; objects are not among them."""


def unpacked(source: Path | IO[bytes], name: str, *, small: int, ratio: float, most: int = 2**31) -> dict[str, bytes]:
    """Return the files in a ZIP file: ``small`` bytes in any case, or ``ratio`` times those of the file, and never more than ``most``."""
    with zipfile.ZipFile(source) as archive:
        members = [member for member in archive.infolist() if not member.is_dir()]
        # Of two files of one name, it depends on the program which one is read.
        if len(members) > MOST_MEMBERS or len({member.filename for member in members}) < len(members):
            raise BadInput(f"{name} has over {MOST_MEMBERS} files, or two of one name; it is not unpacked.", "zip-of-too-many-files")
        # By the directory of the archive, before anything is unpacked: a small file may unpack to any size.
        size, packed = sum(member.file_size for member in members), _size(source)
        allowed = int(min(most, max(small, ratio * packed)))
        if size > allowed:
            raise BadInput(
                f"{name} has {packed} bytes, and {size} when it is unpacked, more than the {allowed} that are allowed; it is not unpacked.",
                "zip-too-large",
            )
        return {member.filename: archive.read(member) for member in members}


def _size(source: Path | IO[bytes]) -> int:
    if isinstance(source, Path):
        return source.stat().st_size
    return source.seek(0, io.SEEK_END)


def arrays_in(source: Path | IO[bytes], name: str, *, small: int = 2**28, ratio: float = 100.0) -> dict[str, NDArray[Any]]:
    """Return the arrays of an NPZ file by their names; nothing is unpickled, and no array is larger than the bytes of its file."""
    files = unpacked(source, name, small=small, ratio=ratio)
    return {file.removesuffix(".npy"): _array(file, content) for file, content in files.items()}


def _array(name: str, content: bytes) -> NDArray[Any]:
    """Return the array of an NPY file."""
    stream = io.BytesIO(content)
    version = np.lib.format.read_magic(stream)
    if version not in HEADERS:
        raise ValueError(f"{shown(name)} is of another version of the format of arrays")
    shape, fortran, dtype = HEADERS[version](stream)
    if dtype.kind not in KINDS:
        raise ValueError(f"{shown(name)} has entries of type {str(dtype)[:20]}, which are no numbers")
    size = dtype.itemsize
    for length in shape:
        # In Python's integers, which cannot overflow as a product of NumPy's can.
        size *= length
    rest = content[stream.tell() :]
    if size != len(rest) or any(length < 0 for length in shape) or len(shape) > 8:
        raise ValueError(f"{shown(name)} has not the bytes that its shape says")
    # Texts of length zero have an item size of zero, which frombuffer refuses.
    if not size:
        return np.zeros(shape, dtype)
    # A bytearray, because arrays of bytes cannot be written to.
    return np.frombuffer(bytearray(rest), dtype).reshape(shape, order="F" if fortran else "C")


HEADERS: Mapping[tuple[int, int], Any] = {
    (1, 0): np.lib.format.read_array_header_1_0,
    (2, 0): np.lib.format.read_array_header_2_0,
}
"""Readers of headers, by the version of the format."""

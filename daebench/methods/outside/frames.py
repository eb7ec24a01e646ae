"""Messages between daebench and the process in which code from outside runs: a line of JSON, and numbers in binary."""

import json
import struct
from typing import IO, Any

import numpy as np
from numpy.typing import NDArray

HEAD = struct.Struct("<QQ")
"""Lengths of the JSON and of the numbers."""

LONGEST = 2**24
"""Most bytes of the JSON; more says that something else has written into the pipe."""

Numbers = NDArray[Any]
Frame = tuple[dict[str, Any], Numbers]


def write(pipe: IO[bytes], content: dict[str, Any], numbers: Numbers | None = None) -> None:
    """Write a message, whose numbers are real or complex."""
    data = np.ascontiguousarray(np.empty(0) if numbers is None else numbers)
    data = data.astype(complex if np.iscomplexobj(data) else float, copy=False)
    text = json.dumps({**content, "complex": bool(np.iscomplexobj(data))}).encode()
    pipe.write(HEAD.pack(len(text), data.nbytes) + text)
    pipe.write(data.tobytes())
    pipe.flush()


def read(pipe: IO[bytes]) -> Frame | None:
    """Return a message, its numbers in one vector; None at the end, or where something else has been written."""
    head = pipe.read(HEAD.size)
    if len(head) < HEAD.size:
        return None
    length, size = HEAD.unpack(head)
    if length > LONGEST:
        return None
    text, data = pipe.read(length), pipe.read(size)
    if len(data) < size:
        return None
    try:
        content: dict[str, Any] = json.loads(text)
        return content, np.frombuffer(data, dtype=complex if content["complex"] else float).copy()
    except (ValueError, KeyError, TypeError, RecursionError):
        return None

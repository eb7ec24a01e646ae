"""Memory for the new arrays of one call of machine code."""

import ctypes
import mmap
import struct
import threading

from daebench.errors import RunFailed

LEAST, PARTS = 2**26, 256
"""Bytes for new arrays: at least so many, and so many times those of the arrays that are given. Pages that are not used cost nothing."""

MATRICES = 16
"""Matrices, of as many rows and columns as there are unknowns, for which there is room in the memory of callbacks."""


class Memory:
    """Memory for new arrays of one call."""

    def __init__(self, size: int) -> None:
        self.size = size
        flags = mmap.MAP_PRIVATE | mmap.MAP_ANONYMOUS | getattr(mmap, "MAP_NORESERVE", 0)
        self._map = mmap.mmap(-1, size, flags=flags)
        self._start = ctypes.addressof((ctypes.c_char * size).from_buffer(self._map))
        self._fresh = struct.pack("=4q", self._start, self._start + size, self._start, 0)
        self._words = bytearray(self._fresh)
        self._place = ctypes.addressof((ctypes.c_char * len(self._words)).from_buffer(self._words))

    @classmethod
    def of_unknowns(cls, n: int) -> "Memory":
        """Return memory for callbacks of a system of n unknowns: for matrices of n rows."""
        return cls(max(LEAST, PARTS * 8 * n, MATRICES * 8 * n * n))

    def begun(self) -> int:
        """Return the address of where its next array goes, its end, its beginning, and whether it was too small; all of it is free."""
        self._words[:] = self._fresh
        return self._place

    def require_enough(self) -> None:
        """Raise :class:`RunFailed` if it was too small."""
        if any(self._words[24:]):  # the last word is set where it was too small
            raise RunFailed(f"new arrays of a step need more than the {self.size >> 20} MiB set aside for them; use a smaller problem.")


_memories = threading.local()


def memory_for(given: int) -> Memory:
    """Return memory of this thread for a call with arrays of so many bytes."""
    size = max(LEAST, PARTS * given)
    memory: Memory | None = getattr(_memories, "memory", None)
    if memory is None or memory.size < size:
        memory = _memories.memory = Memory(size)
    return memory

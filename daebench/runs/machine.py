"""A description of the machine on which numbers were computed."""

import os
import platform
import re
from functools import cache
from pathlib import Path


def cores() -> int:
    """Return the number of cores that this process may use."""
    # A container or a queue may allow fewer cores than the machine has.
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


@cache
def machine() -> str:
    """Return the processor and the operating system in words, without the name of the machine."""
    processor, cpuinfo = platform.processor(), Path("/proc/cpuinfo")
    if cpuinfo.is_file() and (match := re.search(r"^model name\s*:\s*(.+)$", cpuinfo.read_text(encoding="utf-8"), re.MULTILINE)):
        processor = match[1]
    system = f"{platform.system()} on {platform.machine()}"
    return f"{processor or platform.machine()}, {os.cpu_count()} logical cores, {system}"

"""The machine that numbers come from, in words."""

import os
import platform
import re
from functools import cache
from pathlib import Path


def cores() -> int:
    """Return how many cores this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


@cache
def machine() -> str:
    """Return the processor and the operating system in words; no name by which the machine is known to others."""
    processor, cpuinfo = platform.processor(), Path("/proc/cpuinfo")
    if cpuinfo.is_file() and (match := re.search(r"^model name\s*:\s*(.+)$", cpuinfo.read_text(encoding="utf-8"), re.MULTILINE)):
        processor = match[1]
    system = f"{platform.system()} on {platform.machine()}"
    return f"{processor or platform.machine()}, {os.cpu_count()} logical cores, {system}"

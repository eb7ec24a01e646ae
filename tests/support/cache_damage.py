"""Damage to files that daebench keeps: cut short, bits flipped, zeroed, put in each other's place, or a folder where a file was."""

import shutil


def flipped(content, place):
    """Return bytes with one bit changed, at a fraction of their length."""
    k = min(int(place * len(content)), len(content) - 1)
    return content[:k] + bytes([content[k] ^ 1 << k % 8]) + content[k + 1 :]


def zeroed(content, start, end):
    """Return bytes with zeros between two fractions of their length."""
    a, b = int(start * len(content)), int(end * len(content))
    return content[:a] + bytes(b - a) + content[b:]


FAMILY = {
    **{f"cut at {x}": lambda content, x=x: content[: int(x * len(content))] for x in (0, 0.001, 0.1, 0.3, 0.5, 0.7, 0.9, 0.99)},
    "last byte lost": lambda content: content[:-1],
    "a byte too many": lambda content: content + b"\n",
    **{f"bit flipped at {x}": lambda content, x=x: flipped(content, x) for x in (0, 0.01, 0.05, *(k / 10 for k in range(1, 10)), 0.99, 1)},
    **{f"zeros from {a} to {b}": lambda content, a=a, b=b: zeroed(content, a, b) for a, b in ((0, 1), (0, 0.1), (0.4, 0.6), (0.9, 1))},
    "something else": lambda content: b"\x80\x04\x95 no such thing" + content[16:],
}
"""What becomes of the content of a file, by what has happened to it."""


def folder(path):
    """Put a folder in the place of a file."""
    path.unlink()
    path.mkdir()
    (path / "something").write_text("in it")


def swapped(path, others):
    """Put another file of the same kind in the place of a file."""
    other = next(each for each in sorted(others) if each != path and each.suffix == path.suffix)
    shutil.copyfile(other, path)

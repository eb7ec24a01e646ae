"""What MSVC refuses in C and C++, and whether generated code has it."""

import re

REFUSED = {
    "extensions": r"__attribute__|__builtin|__restrict|\brestrict\b|\btypeof\b|\balloca\b|\(\{|\?:|_Pragma|#\s*pragma|#\s*warning",
    "constants of POSIX": r"\bM_[A-Z]",
    "designated initialisers": r"[{,]\s*\.\w+\s*=|\{\s*\[\d+\]\s*=",
    "lengths that are not constant": r"\b(?:double|float|int64_t|int) \w+\[(?!\d+\]|\]|[A-Z_]+\])",
    "arrays without entries": r"\b(?:double|float|int64_t|int) \w+\[0\]",
    "numbers of other types": r"\blong double\b|\b_Complex\b|\b__int128\b|\blong long\b",
}
BLOCKS, PARENTHESES, LETTERS, STRING = 100, 100, 16000, 4000
"""Blocks and parentheses within each other, letters of a line and of a string; MSVC takes 128, 256, 65535 and 16380."""


def depth(text, opening, closing):
    """Return how many brackets are within each other."""
    deepest = level = 0
    for letter in text:
        level += (letter == opening) - (letter == closing)
        deepest = max(deepest, level)
    return deepest


def require_portable(folder):
    """Require that the files of C and C++ of a folder have nothing that MSVC refuses."""
    files = sorted(folder.glob("*.[ch]*"))
    assert files
    for file in files:
        text = re.sub(r"/\*.*?\*/|//[^\n]*", "", file.read_text(), flags=re.S)
        for what, pattern in REFUSED.items():
            assert not (found := re.search(pattern, text)), f"{what} in {file.name}: {found and found[0]}"
        assert depth(text, "{", "}") < BLOCKS, file.name
        assert depth(text, "(", ")") < PARENTHESES, file.name
        assert max(map(len, text.splitlines())) < LETTERS, file.name
        assert max(map(len, re.findall(r'"[^"\n]*"', text)), default=0) < STRING, file.name

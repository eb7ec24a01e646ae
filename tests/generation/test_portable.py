"""What is printed in C and C++ has nothing that MSVC refuses: it is read for that, and by clang as MSVC where clang is there."""

import re
import shutil
import subprocess

import pytest

import daebench

PAIRS = [
    ("spherical_pendulum", "rattle", 0.01),
    ("spherical_pendulum", "shake", 0.01),
    ("slider_crank", "lobatto3", 0.001),
    ("double_wishbone", "rattle/kahan_li8", 0.001),
    ("fekete", "rattle", 1e-3),
    ("lotka_volterra", "darboux:midpoint", 0.01),
]
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

STUBS = {
    "math.h": """#pragma once
#define INFINITY (__builtin_inff())
#define HUGE_VAL (__builtin_inf())
double acos(double), asin(double), atan(double), atan2(double, double), cos(double), exp(double), fabs(double), fmax(double, double),
    fmod(double, double), log(double), pow(double, double), sin(double), sqrt(double), tan(double);
float acosf(float), asinf(float), atanf(float), atan2f(float, float), cosf(float), expf(float), fabsf(float), fmodf(float, float),
    logf(float), powf(float, float), sinf(float), sqrtf(float), tanf(float);
""",
    "stdint.h": "#pragma once\ntypedef long long int64_t;\n",
    "string.h": "#pragma once\nvoid *memcpy(void *, const void *, __SIZE_TYPE__);\nvoid *memmove(void *, const void *, __SIZE_TYPE__);\n"
    "void *memset(void *, int, __SIZE_TYPE__);\n",
    "stdio.h": """#pragma once
typedef struct FILE FILE;
extern FILE *stderr;
int printf(const char *, ...);
int fprintf(FILE *, const char *, ...);
""",
}
"""Declarations of the platform, as far as generated code reads them."""


def depth(text, opening, closing):
    """Return how many brackets are within each other."""
    deepest = level = 0
    for letter in text:
        level += (letter == opening) - (letter == closing)
        deepest = max(deepest, level)
    return deepest


@pytest.mark.sampled(
    by=lambda case: case in ("spherical_pendulum-shake-float32", "slider_crank-lobatto3-float64", "lotka_volterra-darboux:midpoint-float64")
)
@pytest.mark.parametrize("precision", ["float64", "float32"])
@pytest.mark.parametrize(("problem", "method", "h"), PAIRS, ids=[f"{problem}-{method}" for problem, method, _ in PAIRS])
def test_nothing_is_printed_that_msvc_refuses(problem, method, h, precision, tmp_path):
    for language in ("c", "cpp"):
        daebench.generate(problem, method, tmp_path / language, h=h, language=language, name="own", precision=precision)
        for file in tmp_path.glob(f"{language}/*.[ch]*"):
            text = re.sub(r"/\*.*?\*/|//[^\n]*", "", file.read_text(), flags=re.S)
            for what, pattern in REFUSED.items():
                assert not (found := re.search(pattern, text)), f"{what} in {file.name}: {found and found[0]}"
            assert depth(text, "{", "}") < BLOCKS, file.name
            assert depth(text, "(", ")") < PARENTHESES, file.name
            assert max(map(len, text.splitlines())) < LETTERS, file.name
            assert max(map(len, re.findall(r'"[^"\n]*"', text)), default=0) < STRING, file.name
    if clang := shutil.which("clang"):
        for name, stub in STUBS.items():
            (tmp_path / "stubs" / name).parent.mkdir(exist_ok=True)
            (tmp_path / "stubs" / name).write_text(stub)
        as_msvc = ["--target=x86_64-pc-windows-msvc", "-fms-compatibility", "-fms-compatibility-version=19", "-fsyntax-only", "-nostdinc"]
        for file in ("own.c", "example.c", "check.c"):
            command = [clang, *as_msvc, "-std=c99", "-isystem", str(tmp_path / "stubs"), "-Wall", "-Werror", str(tmp_path / "c" / file)]
            told = subprocess.run(command, capture_output=True, text=True, check=False)
            assert told.returncode == 0, told.stderr[:2000]


PLANTED = {
    "double x[n];": "lengths that are not constant",
    "struct s a = { .x = 1 };": "designated initialisers",
    "const double *restrict p;": "extensions",
    "x = 2*M_PI;": "constants of POSIX",
    "float L[0];": "arrays without entries",
}


def test_planted_text_is_found():
    assert [text for text, what in PLANTED.items() if not re.search(REFUSED[what], text)] == []

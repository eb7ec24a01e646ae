"""What is printed in C and C++ has nothing that MSVC refuses, and is read by clang as MSVC where clang is there.

The gate reads the code of ``test_generate.py`` for it.
"""

import re
import shutil
import subprocess

import pytest
from portable import REFUSED, require_portable

import daebench

PAIRS = [
    ("spherical_pendulum", "rattle", 0.01),
    ("spherical_pendulum", "shake", 0.01),
    ("slider_crank", "lobatto3", 0.001),
    ("double_wishbone", "rattle/kahan_li8", 0.001),
    ("fekete", "rattle", 1e-3),
    ("lotka_volterra", "darboux:midpoint", 0.01),
]
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


@pytest.mark.exhaustive
@pytest.mark.parametrize("precision", ["float64", "float32"])
@pytest.mark.parametrize(("problem", "method", "h"), PAIRS, ids=[f"{problem}-{method}" for problem, method, _ in PAIRS])
def test_nothing_is_printed_that_msvc_refuses(problem, method, h, precision, tmp_path):
    for language in ("c", "cpp"):
        daebench.generate(problem, method, tmp_path / language, h=h, language=language, name="own", precision=precision)
        require_portable(tmp_path / language)
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

"""The program in C that ``daebench.testing`` has for those of other languages: it compiles, passes RATTLE and fails what drifts."""

import re
import shutil
import subprocess
import textwrap

import pytest

from daebench import testing
from daebench.reference.keep.form import DATA

RATTLE = """
void step(double *p, double *q, double h) {
    double x[2], b, c, mu;
    p[1] -= h / 2;
    x[0] = q[0] + h * p[0];
    x[1] = q[1] + h * p[1];
    b = x[0] * q[0] + x[1] * q[1];
    c = x[0] * x[0] + x[1] * x[1] - 1;
    mu = c / (b + sqrt(b * b - c));
    for (int i = 0; i < 2; i++) {
        x[i] -= mu * q[i];
        p[i] = (x[i] - q[i]) / h;
        q[i] = x[i];
    }
    p[1] -= h / 2;
    b = p[0] * q[0] + p[1] * q[1];
    p[0] -= b * q[0];
    p[1] -= b * q[1];
}
"""

EULER = """
void step(double *p, double *q, double h) {
    double lam = p[0] * p[0] + p[1] * p[1] - q[1];
    for (int i = 0; i < 2; i++) {
        double old = p[i];
        p[i] -= h * (lam * q[i] + i);
        q[i] += h * old;
    }
}
"""


@pytest.mark.parametrize(("step", "passes"), [(RATTLE, True), (EULER, False)], ids=["rattle", "euler"])
def test_the_program_passes_a_good_step_and_fails_a_bad_one(tmp_path, step, passes):
    compiler = next((found for name in ("cc", "gcc", "clang") if (found := shutil.which(name))), None)
    if compiler is None:
        pytest.skip("there is no C compiler")
    program = textwrap.dedent(re.search(r"^    #include.*^    }$", testing.__doc__, re.DOTALL | re.MULTILINE)[0])
    (tmp_path / "hold.c").write_text(program + step)
    subprocess.run([compiler, "-O1", "-o", "hold", "hold.c", "-lm"], cwd=tmp_path, check=True)
    (data,) = (DATA / "planar_pendulum-horizontal").glob("*.csv")
    shutil.copy(data, tmp_path / "planar_pendulum-horizontal.csv")
    told = subprocess.run([tmp_path / "hold"], cwd=tmp_path, capture_output=True, text=True)
    assert (told.returncode == 0) is passes, told.stdout
    assert "up to t = 10" in told.stdout

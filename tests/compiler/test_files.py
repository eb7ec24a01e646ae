"""The files of schemes, executed by Python on numbers of other kinds than machine code has."""

import mpmath
import numpy as np
import pytest
import uncompiled

import daebench
from daebench.methods.names import method_of

ONE_STEP = ("daebench.schemes.kernels.constrained", "one_step")
STEPS = 10


def exact(x):
    """Return nested tuples of numbers of 40 digits."""
    return tuple(map(exact, x)) if isinstance(x, tuple | np.ndarray) else mpmath.mpf(float(x))


@pytest.mark.parametrize("name", ["rattle", "gauss2"])
def test_machine_code_has_the_digits_of_the_same_file_on_numbers_of_forty_digits(name):
    ivp = daebench.initial_value_problem("spherical_pendulum")
    method = method_of(ivp, name)
    kernel = uncompiled.kernel(method, ivp, "float64", (), count=False)
    linked, one_step = method.linked(ivp, kernel, 0.01), kernel.FILES.root(*ONE_STEP)
    with mpmath.workdps(40):
        x, h, par = exact(linked.enter(ivp.start)), mpmath.mpf(1) / 100, exact(linked.par)
        for _ in range(STEPS):
            x, _, _, report = one_step(x, (), h, par)
            assert report[0] == 0
        run = daebench.run(ivp, method=name, h=0.01, steps=STEPS)
        of_p, of_q = (
            max(abs(a - mpmath.mpf(float(b))) for a, b in zip(one, other, strict=True))
            for one, other in zip(x, (run.p[-1], run.q[-1]), strict=True)
        )
    rounding = np.finfo(float).eps * max(map(abs, (*x[0], *x[1])))
    assert 0 < of_q < 10 * rounding
    assert 0 < of_p < 10 * rounding / 0.01  # where momenta follow from g = 0, they are uncertain by eps |q| / h

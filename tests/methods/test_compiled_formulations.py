"""Formulations as machine code: the same functions as uncompiled, and what tight tolerances deliver on the fast pendulum."""

import dataclasses

import numpy as np
import pytest
import uncompiled
from ivps import ivp
from measures import residual, somewhere

from daebench.compiler.callbacks import SINGULAR
from daebench.methods.formulations.constrained import FORMULATIONS, pose


@pytest.mark.parametrize("formulation", FORMULATIONS, ids=FORMULATIONS)
def test_compiled_functions_give_what_the_uncompiled_give(formulation):
    fast = ivp("spherical-fast")
    dae = pose(fast, formulation)
    plain = dataclasses.replace(dae, module=uncompiled.kept_module(fast, formulation, "plain"))
    y, yp = somewhere(dae)
    assert np.allclose(residual(dae, y, yp), residual(plain, y, yp), rtol=0, atol=1e-13 * np.abs(y).max() ** 2)
    J, K = (np.full((dae.n, dae.n), np.nan) for _ in range(2))
    for each, JJ in ((dae, J), (plain, K)):
        assert each.jacobian(0.0, y, yp, np.empty(dae.n), 2.5, JJ, each.par) > SINGULAR
    assert np.allclose(J, K, rtol=0, atol=1e-13 * np.abs(K).max())

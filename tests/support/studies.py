"""What tests of the study of orders share."""

from functools import cache, partial

import pytest
import uncompiled
from ivps import ivp

from daebench.methods.fixed_step.constrained import FixedStep
from daebench.studies.orders.study import study

plain = partial(FixedStep, compiled=False)


@cache
def rattle_on_planar():
    """Three series and those of stage multipliers on a problem with a closed form: h = 1/32 ... 1/512."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("daebench.methods.formulations.constrained._module", uncompiled.kept_module)
        return study(ivp("planar"), [plain("rattle")], t_end=1.0, h=1 / 32, halvings=4)

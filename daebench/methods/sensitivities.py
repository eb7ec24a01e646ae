"""The derivatives of a run that are available: names, and methods."""

import os
from collections.abc import Sequence
from typing import Any

from daebench.errors import BadInput
from daebench.methods.catalogue import find_problem
from daebench.runs.directions import require_names
from daebench.runs.ivp import Ivp
from daebench.runs.request import Method


def require_differentiable(method: Method[Any, Any], ivp: Ivp, names: Sequence[str], problem: Any) -> None:
    """Accept the quantities to differentiate a run by."""
    if not names:
        return
    structure = find_problem(os.fspath(problem)).structure if isinstance(problem, str | os.PathLike) else {}
    for name in names:
        if name in structure:
            raise BadInput(f"{name} of {ivp.problem} is a whole number, so there is no derivative with respect to it; leave it out.")
    require_names(ivp, names)
    if not getattr(method, "differentiable", False):
        raise BadInput(
            f"{method.name} has no sensitivities; schemes of daebench such as rattle differentiate their steps, and ida:index2 solves "
            "variational equations."
        )

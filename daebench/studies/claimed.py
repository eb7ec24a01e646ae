"""What a method claims to conserve on a problem: without a claim no run is taken to conserve a thing, however it was measured."""

from typing import TYPE_CHECKING, Any

import numpy as np

from daebench.api import setting_of
from daebench.errors import BadInput
from daebench.fixed_step_constrained import FixedStep
from daebench.names import methods_of
from daebench.scene import PoissonScene, Scene

if TYPE_CHECKING:
    import pandas as pd

THINGS = ("energy", "constraints", "casimirs", "two_form")
"""What may be claimed: energy without drift, g = 0 and G H_p = 0, Casimir functions, the two-form or the structure matrix."""


def claimed(scene: Scene | PoissonScene, method: Any) -> frozenset[str]:
    """Return which of :data:`THINGS` a method claims to conserve on a scene.

    Energy without drift is claimed by a method that is symplectic on the manifold, or a Poisson integrator, or that conserves H. A method
    that is symmetric alone and stays on the manifold claims it on a motion that is its own reverse: that begins at rest, so that
    x(-t) is x(t) with p reversed. Methods that choose their own steps claim nothing.

    Parameters
    ----------
    scene : Scene or PoissonScene
        The problem with the numbers of a case.
    method : Method
        The method.
    """
    if method.knob != "h":
        return frozenset()
    if isinstance(scene, PoissonScene):
        return _on_poisson(scene, method)
    assert isinstance(method, FixedStep)
    claims = method.claims
    symplectic = claims.symplectic and claims.on_manifold
    reversed_too = claims.symmetric and claims.on_manifold and own_reverse(scene)
    claim = {
        "energy": symplectic or claims.conserves_energy or reversed_too,
        "constraints": claims.on_manifold,
        "two_form": claims.symplectic,
    }
    return frozenset(name for name, made in claim.items() if made)


def _on_poisson(scene: PoissonScene, method: Any) -> frozenset[str]:
    kept = method.keeps(scene)
    claim = {
        "energy": method.is_poisson(scene) or "energy" in kept,
        "casimirs": bool(scene.casimirs) and set(scene.casimirs) <= set(kept),
        "two_form": method.is_poisson(scene),
    }
    return frozenset(name for name, made in claim.items() if made)


def own_reverse(scene: Scene) -> bool:
    """Return whether a motion begins at rest, and so is its own reverse."""
    return not np.any(scene.p0)


def claims_of(table: "pd.DataFrame") -> dict[str, frozenset[str]]:
    """Return what the methods of a study's table claim on all of its cases, by name; one that daebench does not know claims nothing.

    Parameters
    ----------
    table : DataFrame
        With columns problem, case and method; the claims do not depend on values of parameters.
    """
    found: dict[str, frozenset[str]] = {}
    for (problem, case), rows in table.groupby(["problem", "case"], sort=False):
        scene = setting_of(str(problem), str(case))
        for name in dict.fromkeys(map(str, rows["method"])):
            own = _claimed(scene, name)
            found[name] = found[name] & own if name in found else own
    return found


def _claimed(scene: Scene | PoissonScene, name: str) -> frozenset[str]:
    try:
        (method,) = methods_of(scene, [name], anyway=isinstance(scene, PoissonScene))
    except BadInput:
        return frozenset()
    return claimed(scene, method)

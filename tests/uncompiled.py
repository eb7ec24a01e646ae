"""Formulations without numba: the generated source run as it stands, so that sweeps need not compile every pair."""

import types

from daebench import residuals

_kept = {}


def module(scene, formulation, multipliers):
    """Return the generated module of a formulation with ``njit`` standing for nothing; in place of ``daebench.pose._module``."""
    text = residuals.source("Uncompiled.", scene.source.derivation, formulation, multipliers, cached=False)
    found = types.ModuleType(f"{scene.problem}_{formulation}_{multipliers}")
    exec(text.replace("from numba import njit", "def njit(**_):\n    return lambda function: function"), found.__dict__)
    return found


def kept_module(scene, formulation, multipliers):
    """As ``module``, made once for each source."""
    key = (scene.source, formulation, multipliers)
    if key not in _kept:
        _kept[key] = module(scene, formulation, multipliers)
    return _kept[key]

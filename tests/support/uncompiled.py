"""Formulations and fixed steps without machine code: generated source run by Python, so that sweeps need not compile every pair."""

import types
from functools import cache

from daebench.methods.fixed_step.constrained import FixedStep
from daebench.methods.formulations import chain_residuals, residuals
from daebench.methods.formulations.residuals import NAMES

_kept = {}


class Uncompiled(FixedStep):
    """Fixed steps run as Python."""

    def __init__(self, *settings, **more):
        super().__init__(*settings, **more | {"compiled": False})


def run(text, name):
    """Return a module of generated source whose functions Python executes, those of which machine code is made too."""
    found = types.ModuleType(name)
    exec(f"import numpy\n{NAMES}", found.__dict__)
    exec(text, found.__dict__)
    return found


def module(ivp, formulation, multipliers):
    """Return the generated module of a formulation executed by Python; in place of ``formulations.constrained._module``."""
    text = residuals.source("Uncompiled.", ivp.source.derivation, formulation, multipliers)
    return run(text, f"{ivp.problem}_{formulation}_{multipliers}")


def kept_module(ivp, formulation, multipliers):
    """As ``module``, made once for each source."""
    key = (ivp.source, formulation, multipliers)
    if key not in _kept:
        _kept[key] = module(ivp, formulation, multipliers)
    return _kept[key]


@cache
def chain_module(source, formulation, multipliers):
    """Return the generated module of a formulation of a chain, in loops over nodes, without machine code."""
    text = chain_residuals.source("Uncompiled.", source.derivation.chain, formulation, multipliers)
    return run(text, f"{source.problem}_{formulation}")


def kept_chain_module(ivp, formulation, multipliers):
    """As ``chain_module``; in place of ``formulations.chain._module``."""
    return chain_module(ivp.source, formulation, multipliers)


def kernel(method, ivp, precision, watch, *, count, stage_multipliers=False, singular="stop"):
    """Return the generated module of a scheme on a problem executed by Python; in place of ``FixedStep.kernel``."""
    options = method._options(ivp, precision, watch, count=count, stage_multipliers=stage_multipliers, singular=singular)
    key = ivp.source, method._key(ivp, options)
    if key not in _kept:
        _kept[key] = run(method._module(ivp, options), method.scheme_module)
    return _kept[key]


def named(module, name):
    """Return a function of a module without machine code by its name in the scheme language: from its text, or from a file."""
    files = vars(module).get("FILES")
    return files.root(*files.plan["homes"][name]) if files and name in files.plan["homes"] else getattr(module, name)

"""Formulations without machine code: the generated source run by Python as it stands, so that sweeps need not compile every pair."""

import types
from functools import cache

from daebench.compiler.link import Linker, Options
from daebench.compiler.syntax import LANGUAGE
from daebench.methods.formulations import chain_residuals, residuals
from daebench.methods.formulations.residuals import NAMES

_kept = {}


def run(text, name):
    """Return a module of generated source whose functions Python executes, those of which machine code is made too."""
    found = types.ModuleType(name)
    exec(NAMES, found.__dict__)
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


def kept_functions(ivp, *names):
    """Return a module of a problem's functions without machine code, made once; in place of ``InitialValueProblem.functions``."""
    key = (ivp.source, names)
    if key not in _kept:
        text = Linker(ivp.source.derivation, Options(compiled=False)).module("Uncompiled.", [(LANGUAGE, name) for name in names])
        _kept[key] = run(text, "_".join(names))
    return _kept[key]

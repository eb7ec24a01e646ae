"""The sheet of a chain whose functions are loops, with the names of :mod:`daebench.sheet`."""

from collections.abc import Sequence

import sympy as sp

from daebench import codegen
from daebench.chains.derivation import ChainDerivation
from daebench.problem import Case, Exact
from daebench.sheet import common_facts


def source(problem: str, derivation: ChainDerivation) -> str:
    """Return the source of a chain's sheet; NODES is its number of nodes, and a chart or a closed form only a short chain has."""
    chain = derivation.chain
    facts = common_facts(chain, chain.d, chain.m) | {
        "NODES": chain.nodes,
        "INTEGRALS": (),
        "SEPARABLE": True,
        "QUADRATIC": True,
        "EXPLICIT": chain.diagonal,
        "CLOSED_FORM": False,
        "KINETIC_FLOW": False,
        "CHART": False,
    }
    lines = [f'"""Facts about {problem}."""', "import numpy", "from numpy import *"]
    lines += [f"{name} = {value!r}" for name, value in facts.items()]
    for number, case in enumerate(chain.cases.values()):
        lines += _initial(f"initial_{number}", derivation, case)
    pairs = ", ".join(f"{name!r}: initial_{k}" for k, name in enumerate(chain.cases))
    return "\n".join([*lines, f"INITIAL = {{{pairs}}}", ""])


def _initial(name: str, derivation: ChainDerivation, case: Case) -> list[str]:
    """Source of a function of ``par`` that returns initial p and q, each shape(d,)."""
    chain = derivation.chain
    functions = _of_node(f"{name}_q", derivation, case.q)
    functions += _of_speeds(f"{name}_p", derivation, case) if chain.speeds else _of_node(f"{name}_p", derivation, case.p)
    rows = [f"numpy.array([{name}_{each}((float(k),), par) for k in range({chain.nodes})], dtype=float).ravel()" for each in ("p", "q")]
    return [*functions, codegen.function(f"{name}(par)", f"return {', '.join(rows)}")]


def _of_node(name: str, derivation: ChainDerivation, values: Sequence[Exact]) -> list[str]:
    node = {"k": [derivation.chain.node]}
    return [codegen.expressions(name, node, [sp.sympify(x) for x in values], (derivation.chain.b,), derivation.parameters)]


def _of_speeds(name: str, derivation: ChainDerivation, case: Case) -> list[str]:
    """Source of the momenta of a node, M times the velocities, at the two ends of the chain and within."""
    chain = derivation.chain
    n, k = chain.nodes, chain.node
    speed = sp.Matrix([sp.sympify(x) for x in case.p])
    lines, functions = [], []
    for number, end in enumerate(sorted({0, min(1, n - 1), n - 1})):
        blocks = chain.inertia(end, k)
        total = sum((block * speed.subs(k, k + side - 1) for side, block in enumerate(blocks)), sp.zeros(chain.b, 1))
        functions.append(codegen.expressions(f"{name}_{number}", {"k": [k]}, list(total), (chain.b,), derivation.parameters))
        lines.append(f"return {name}_{number}(k, par)" if end == 1 and n > 2 else f"if k[0] == {end}: return {name}_{number}(k, par)")
    lines.sort(key=lambda line: line.startswith("return"))
    return [*functions, codegen.function(f"{name}(k, par)", *lines)]

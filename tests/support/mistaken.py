"""Problem files with mistakes: a constrained problem, a Poisson system and a chain, of each of which any part may be written wrongly."""

BEAD = '''"""Bead."""
import sympy as sp
from daebench import Case, ConstrainedHamiltonian

def problem(*, {parameter}: float = 2.0) -> ConstrainedHamiltonian:
    m = sp.Symbol("{parameter}", positive=True)
    q, p = sp.symbols("q1:3", real=True), sp.symbols("p1:3", real=True)
    {lines}
    return ConstrainedHamiltonian(
        q={q}, p={p}, {H}, g={g},
        parameters={parameters},
        cases={cases},{more}
    )
'''
BEAD_PARTS = {
    "parameter": "mass",
    "lines": "pass",
    "q": "q",
    "p": "p",
    "H": "M=sp.eye(2) * m, U=q[1]",
    "g": "[q[0] ** 2 + q[1] ** 2 - 1]",
    "parameters": "{m: mass}",
    "cases": '{"a": Case(q=(0, -1), p=(1, 0))}',
    "more": "",
}

SPECIES = '''"""Two species."""
import sympy as sp
from daebench import PoissonCase, PoissonSystem

def problem(*, {parameter}: float = 2.0) -> PoissonSystem:
    u, v = sp.symbols("u v", positive=True)
    a = sp.Symbol("{parameter}", positive=True)
    {lines}
    return PoissonSystem(y={y}, B={B}, H={H}, domain={domain}, parameters={parameters}, cases={cases},{more})
'''
SPECIES_PARTS = {
    "parameter": "rate",
    "lines": "pass",
    "y": "(u, v)",
    "B": "sp.Matrix([[0, u * v], [-u * v, 0]])",
    "H": "u - sp.log(u) + v - a * sp.log(v)",
    "domain": "[u, v]",
    "parameters": "{a: rate}",
    "cases": '{"even": PoissonCase(y=(1, 3))}',
    "more": "",
}

LINKS = '''"""Links."""
import sympy as sp
from daebench import Case, ConstrainedChain

def problem(*, {parameter}: float = 2.0, n: int = 3) -> ConstrainedChain:
    m, k = sp.Symbol("{parameter}", positive=True), sp.Symbol("k")
    x, b = sp.symbols("x1:3", real=True), sp.symbols("b1:3", real=True)
    {lines}
    return ConstrainedChain(
        nodes=n, here={here}, before=b, node=k, joints={joints}, anchor=(0, 0), mass={mass}, U={U}, parameters={parameters}, cases={cases},
    )
'''
LINKS_PARTS = {
    "parameter": "length",
    "lines": "pass",
    "here": "x",
    "joints": "[(x[0] - b[0]) ** 2 + (x[1] - b[1]) ** 2 - m**2]",
    "mass": "sp.eye(2) * m",
    "U": "m * x[1]",
    "parameters": "{m: length}",
    "cases": '{"a": Case(q=(m * (k + 1), 0), p=(0, 0))}',
}

KINDS = {"bead": (BEAD, BEAD_PARTS), "species": (SPECIES, SPECIES_PARTS), "links": (LINKS, LINKS_PARTS)}


def written(kind, **parts):
    """Return the text of a problem file of a kind, with parts replaced."""
    text, own = KINDS[kind]
    assert set(parts) <= set(own)
    for name, part in {**own, **parts}.items():
        text = text.replace(f"{{{name}}}", part)
    return text

"""Files with the same mathematics have one key, however they are written; every number and expression of it has a part in the key."""

import re
import subprocess
import sys

import pytest
from own_files import ORBIT, RING

from daebench.cli.grids import shared
from daebench.compiler.definition import source_in
from daebench.methods.catalogue import find_problem
from daebench.records.store import opened
from daebench.runs.make_ivp import make_ivp
from daebench.studies.grid.run_specification import defined_by
from daebench.studies.grid.study import Study

CHAIN = '''"""A row of beads."""

import sympy as sp

from daebench import Case, ConstrainedChain


def problem(*, length: float = 2.0, nodes: int = 30) -> ConstrainedChain:
    x, y, a, b, k = sp.symbols("x y a b k", real=True)
    L = sp.Symbol("length", positive=True)
    return ConstrainedChain(
        nodes=nodes, here=(x, y), before=(a, b), node=k, joints=[(x - a) ** 2 + (y - b) ** 2 - L**2], anchor=(0, 0),
        mass=3 * sp.eye(2), U=y, pull=5, parameters={L: length},
        cases={"hanging": Case(q=(0, -k * L), p=(0, 0))},
    )
'''

LATTICE = '''"""A row of sites."""

import sympy as sp

from daebench import PoissonCase, PoissonLattice


def problem(*, strength: float = 2.0, sites: int = 8) -> PoissonLattice:
    u, v, ul, vl, ur, vr = sp.symbols("u v ul vl ur vr", real=True)
    k, c = sp.Symbol("k", real=True), sp.Symbol("strength", positive=True)
    return PoissonLattice(
        sites=sites, here=(u, v), left=(ul, vl), right=(ur, vr), b=sp.Matrix([[0, 1], [-1, 0]]), h=v**2 / 2 + c * (u - ul) ** 2 / 2,
        parameters={c: strength}, site=k, cases={"bump": PoissonCase(y=(sp.Piecewise((3, sp.Eq(k, 5)), (0, True)), 0))},
    )
'''

FILES = {"constrained": RING, "poisson": ORBIT, "chain": CHAIN, "lattice": LATTICE}


def first_line(text):
    return text[text.index('"""') :].split("\n")[0]


EQUAL = {
    "a comment": lambda text: text + "\n# checked by hand\n",
    "its docstring": lambda text: text.replace(first_line(text), '"""Something else."""'),
    "blank lines": lambda text: text.replace("\n    return ", "\n\n    return "),
    "another layout": lambda text: text.replace("parameters={", "parameters  =  {  "),
    "a renamed variable": lambda text: text.replace("sp.", "algebra.").replace("as sp", "as algebra"),
    "an unused name": lambda text: text.replace("import sympy as sp\n", "import sympy as sp\n\nUNUSED = 5\n"),
}

EQUAL_RINGS = {
    "lists for tuples": lambda text: text.replace("q=(0, -r), p=(3 * m, 0)", "q=[0, -r], p=[3 * m, 0]"),
    "renamed symbols of Python": lambda text: re.sub(r"\bm\b", "weight", text),
    "other words about a case": lambda text: text.replace("p=(3 * m, 0)", 'p=(3 * m, 0), about="fast"'),
    "a picture": lambda text: text.replace("closed_form=", "picture=daebench.Picture(masses=[q]), closed_form=").replace(
        "import mpmath", "import daebench, mpmath"
    ),
    "terms in another order": lambda text: text.replace("q[0] ** 2 + q[1] ** 2 - r**2", "-(r**2) + q[1] ** 2 + q[0] ** 2"),
}  # fmt: skip

OTHERS = {
    "constrained": {
        "a default": ("mass: float = 2.0", "mass: float = 2.5"),
        "another default": ("radius: float = 1.5", "radius: float = 1.5000000000000002"),
        "the mass matrix": ("M=m *", "M=2 * m *"),
        "the potential": ("U=sp.S.Zero", "U=m * q[1]"),
        "a constraint": ("q[1] ** 2 - r**2]", "2 * q[1] ** 2 - r**2]"),
        "a start": ("p=(3 * m, 0)", "p=(4 * m, 0)"),
        "the start of another case": ("q=(r, 0)", "q=(-r, 0)"),
        "the name of a case": ('"resting"', '"asleep"'),
        "what a case sets": ("p=(3 * m, 0)", 'p=(3 * m, 0), parameters={"mass": 4.0}'),
        "what a case does": ("p=(3 * m, 0)", 'p=(3 * m, 0), on_singular="continue"'),
        "an integral": ('{"L": turn}', '{"L": 2 * turn}'),
        "the name of an integral": ('{"L": turn}', '{"spin": turn}'),
        "the flow": ("mass=m, length=r", "mass=2 * m, length=r"),
        "the chart": ("p=list(m * r * eta * n)", "p=list(2 * m * r * eta * n)"),
        "the inverse of the chart": ("turn / (m * r**2)", "2 * turn / (m * r**2)"),
        "an assumption": ('"mass radius", positive=True', '"mass radius", real=True'),
    },
    "poisson": {
        "a default": ("rate: float = 2.0", "rate: float = 2.5"),
        "the structure matrix": ("[[0, u * v], [-u * v, 0]]", "[[0, u], [-u, 0]]"),
        "the Hamiltonian": ("H=u -", "H=2 * u -"),
        "the domain": ("domain=[u, v]", "domain=[u, v, 9 - u]"),
        "a start": ("y=(1, 3)", "y=(1, 2)"),
    },
    "chain": {
        "a default": ("length: float = 2.0", "length: float = 3.0"),
        "the number of nodes": ("nodes: int = 30", "nodes: int = 31"),
        "the mass": ("3 * sp.eye", "4 * sp.eye"),
        "the pull": ("pull=5", "pull=6"),
        "the potential": ("U=y", "U=y + x"),
        "the joints": ("(y - b) ** 2 -", "2 * (y - b) ** 2 -"),
        "the anchor": ("anchor=(0, 0)", "anchor=(0, 1)"),
        "a start": ("q=(0, -k * L)", "q=(-k * L, 0)"),
    },
    "lattice": {
        "a default": ("strength: float = 2.0", "strength: float = 3.0"),
        "the number of sites": ("sites: int = 8", "sites: int = 9"),
        "the bracket": ("[[0, 1], [-1, 0]]", "[[0, 2], [-2, 0]]"),
        "the energy": ("h=v**2 / 2", "h=v**2"),
        "the start of a site that is far": ("(3, sp.Eq(k, 5))", "(3, sp.Eq(k, 6))"),
    },
}


@pytest.fixture
def key(tmp_path):
    def of(text, name="own"):
        path = tmp_path / f"{name}.py"
        path.write_text(text)
        source = source_in(find_problem(str(path)), {})
        return defined_by(make_ivp(source, next(iter(source.facts.CASES))))

    return of


def test_a_file_that_is_written_otherwise_has_the_same_key(key):
    for text in FILES.values():
        own, changes = key(text), EQUAL | EQUAL_RINGS if text == RING else dict([*EQUAL.items()][:2])
        for what, change in changes.items():
            assert change(text) != text
            assert key(change(text), "other") == own, what


@pytest.mark.parametrize("kind", FILES)
def test_every_change_of_the_mathematics_gives_another_key(key, kind):
    changed = {"": FILES[kind]} | {what: FILES[kind].replace(*change) for what, change in OTHERS[kind].items()}
    assert len(set(changed.values())) == len(changed)
    keys = {what: key(text) for what, text in changed.items()}
    assert len(set(keys.values())) == len(keys), keys


def test_two_files_with_the_same_problem_share_runs_and_the_table_says_so(tmp_path, monkeypatch):
    paths = [tmp_path / f"{name}.py" for name in "ab"]
    for path in paths:
        path.write_text(f"{RING}\n# in {path.name}\n")
    one, other = (Study(problem=str(path), methods=["rattle"], values={"h": [0.1]}, t_end=1.0) for path in paths)
    monkeypatch.setattr("daebench.methods.fixed_step.constrained.FixedStep.compiled", False)
    with opened(tmp_path / "rows.db") as store:
        first = one.table(store)
        assert "made_for" not in first
        assert shared(one.specifications(), store) == ""
        monkeypatch.setattr("daebench.studies.grid.measure.row_of", lambda _: pytest.fail("computed again"))
        again = other.table(store)
        assert shared(other.specifications(), store) == f"1 stored run was made for {paths[0]}, with the same equations, numbers and cases."
    assert (set(again["problem"]), set(again["made_for"])) == ({str(paths[1])}, {str(paths[0])})
    assert again.drop(columns=["problem", "made_for"]).equals(first.drop(columns="problem"))


def test_the_key_of_a_text_that_was_read_before_needs_no_sympy(key, tmp_path):
    key(RING)
    program = f"""
import sys
from daebench.compiler.definition import source_in
from daebench.methods.catalogue import find_problem
from daebench.runs.make_ivp import make_ivp
from daebench.studies.grid.run_specification import defined_by
print(defined_by(make_ivp(source_in(find_problem({str(tmp_path / "own.py")!r}), {{}}), "turning"))[0])
assert "sympy" not in sys.modules
"""
    found = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True)
    assert (found.stdout.strip(), found.returncode) == (key(RING)[0].strip(), 0), found.stderr

"""A problem of the user's own: a file outside of the package, or one that another package brings; mistakes in it are named."""

import importlib.metadata
import json
import os
import re
import sys
from pathlib import Path

import numpy as np
import pytest

import daebench as package
from daebench import cache, catalogue, problem_check
from daebench.catalogue import find_problem, find_setting
from daebench.errors import InvalidProblem
from daebench.neighbours import TAKEN
from daebench.problem_check import held
from daebench.problem_plugins import plugins

RING = '''"""A bead on a ring, free to slide."""

import mpmath as mp
import sympy as sp

from daebench import Case, Chart, ConstrainedHamiltonian, KineticFlow
from daebench.kinetic_flows import sphere


def problem(*, mass: float = 2.0, radius: float = 1.5) -> ConstrainedHamiltonian:
    m, r = sp.symbols("mass radius", positive=True)
    q, p = sp.symbols("q1:3", real=True), sp.symbols("p1:3", real=True)
    eta, xi = sp.symbols("rate angle", real=True)
    turn = q[0] * p[1] - q[1] * p[0]
    e, n = sp.Matrix([sp.cos(xi), sp.sin(xi)]), sp.Matrix([-sp.sin(xi), sp.cos(xi)])
    flow = sphere(q, p, mass=m, length=r)
    return ConstrainedHamiltonian(
        q=q,
        p=p,
        M=m * sp.eye(2),
        U=sp.S.Zero,
        g=[q[0] ** 2 + q[1] ** 2 - r**2],
        parameters={m: mass, r: radius},
        cases={"turning": Case(q=(0, -r), p=(3 * m, 0)), "resting": Case(q=(r, 0), p=(0, 0))},
        integrals={"L": turn},
        closed_form=closed_form,
        kinetic_flow=flow,
        chart=Chart(
            eta=[eta], xi=[xi], p=list(m * r * eta * n), q=list(r * e), inverse_eta=[turn / (m * r**2)], inverse_xi=[sp.atan2(q[1], q[0])]
        ),
    )


def closed_form(t, q0, p0, parameters):
    angle = (q0[0] * p0[1] - q0[1] * p0[0]) / (parameters["mass"] * parameters["radius"] ** 2) * t
    c, s = mp.cos(angle), mp.sin(angle)
    return [c * q0[0] - s * q0[1], s * q0[0] + c * q0[1]], [c * p0[0] - s * p0[1], s * p0[0] + c * p0[1]]
'''

ORBIT = '''"""Two species."""

import sympy as sp

from daebench import PoissonCase, PoissonSystem


def problem(*, rate: float = 2.0) -> PoissonSystem:
    u, v, a = sp.symbols("u v rate", positive=True)
    return PoissonSystem(
        y=(u, v),
        B=sp.Matrix([[0, u * v], [-u * v, 0]]),
        H=u - sp.log(u) + v - a * sp.log(v),
        domain=[u, v],
        parameters={a: rate},
        cases={"even": PoissonCase(y=(1, 3))},
    )
'''


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """A folder to work in, with a problem of either kind."""
    (tmp_path / "ring.py").write_text(RING)
    (tmp_path / "orbit.py").write_text(ORBIT)
    monkeypatch.chdir(tmp_path)
    return tmp_path


# ---- a file is used like a name --------------------------------------------------------------------------------------------


def test_a_file_is_run_by_its_path_and_follows_its_closed_form(daebench, folder, plain_functions):
    words = ("./ring.py", "--case", "turning", "--method", "scipy:DOP853", "--tol", 1e-10, "--t-end", 0.2, "--json")
    status, out, err = daebench("run", *words)
    found = json.loads(out)
    assert (status, err) == (0, "")
    assert (found["problem"], found["case"]) == ("./ring.py", "turning")
    assert np.allclose(found["q"], (1.5 * np.sin(0.4), -1.5 * np.cos(0.4)), rtol=0, atol=1e-8)


COMMANDS = {
    "run": ("run", "./ring.py", "--method", "rattle", "--h", 0.01, "--steps", 100),
    "compare": ("compare", "./ring.py", "--methods", "rattle,strang", "--h", 0.01, "--t-end", 1),
    "order": ("order", "./ring.py", "--methods", "rattle", "--halvings", 2),
    "check": ("check", "./ring.py", "--method", "rattle"),
    "bench": ("bench", "--problem", "./ring.py", "--methods", "rattle", "--steps", 1000, "--repeat", 1),
    "poisson": ("run", "./orbit.py", "--method", "midpoint", "--anyway", "--h", 0.01, "--steps", 100),
}


@pytest.mark.slow
@pytest.mark.parametrize("words", COMMANDS.values(), ids=COMMANDS)
def test_every_command_that_takes_a_problem_takes_a_file(daebench, folder, words, monkeypatch):
    monkeypatch.setattr(importlib.import_module("daebench.cli.bench"), "STARTS", 1)  # daebench.cli.bench is the command
    status, out, err = daebench(*words)
    assert (status, err) == (0, "")
    assert out


@pytest.mark.parametrize(
    "words", [("ring.py",), ("./ring.py",), ("{folder}/ring.py",), ("sub/../ring.py",)], ids=["bare", "dot", "whole", "way"]
)
def test_a_path_ends_in_py_or_has_a_separator(daebench, folder, words):
    (folder / "sub").mkdir()
    path = words[0].format(folder=folder)
    status, out, _ = daebench("show", path, "--json")
    assert status == 0
    assert json.loads(out)["problem"] == path
    assert json.loads(out)["parameters"] == {"mass": 2.0, "radius": 1.5}


def test_a_file_of_a_poisson_system_is_checked_by_its_path(daebench, folder):
    status, out, _ = daebench("check", "./orbit.py", "--json")
    assert (status, json.loads(out)["checks"]) == (0, [{"case": "even", "what": "twice differentiable at the start", "fault": ""}])


def test_the_library_takes_paths_too(folder):
    scene = package.scene_of(folder / "ring.py", case="resting", parameters={"radius": 2.0})
    assert scene.q0.tolist() == [2.0, 0.0]
    assert find_setting("ring.py", "turning").p0.tolist() == [6.0, 0.0]
    assert package.setting_of("./orbit.py").y0.tolist() == [1.0, 3.0]


@pytest.mark.parametrize("path", ["~nobody_of_this_name/ring.py", "r" * 300 + ".py"], ids=["no such user", "too long"])
def test_a_path_that_cannot_be_is_no_file(daebench, path):
    status, _, err = daebench("show", path)
    assert (status, err.count("\n")) == (2, 1)
    assert f"{path}: there is no such file" in err


def test_what_a_problem_file_writes_is_had_from_daebench():
    for name in ("Case", "Chart", "ConstrainedChain", "ConstrainedHamiltonian", "InvalidProblem", "KineticFlow", "Picture"):
        assert getattr(package, name).__name__ == name
        assert name in package.__all__


IDLE = {"param": ("--param", "mass=3"), "h": ("--h", 0), "steps": ("--steps", 200), "option": ("--option", "a=1"), "anyway": ("--anyway",)}


@pytest.mark.parametrize("words", IDLE.values(), ids=IDLE)
def test_what_only_a_method_is_checked_with_is_refused_without_one(daebench, folder, words):
    status, out, err = daebench("check", "./ring.py", *words)
    assert (status, out) == (2, "")
    assert err == f"daebench: {words[0]} is for the check of a method; add --method, or leave it out.\n"


def test_a_file_without_cases_starts_from_what_is_given(daebench, folder):
    (folder / "ring.py").write_text(RING[: RING.index("        cases=")] + RING[RING.index("        integrals=") :])
    status, _, err = daebench("show", "./ring.py")
    assert (status, "declares no cases; declare one" in err) == (2, True)
    assert package.scene_of("./ring.py", q0=(0, 1.5), p0=(1, 0)).case == ""


# ---- files beside it, and the cache ----------------------------------------------------------------------------------------

HELPED = RING.replace("import sympy as sp\n", "import sympy as sp\n\nimport helper_of_ring\n", 1).replace(
    "(3 * m, 0)", "(helper_of_ring.SPEED * m, 0)"
)


def momentum(path):
    return find_setting(str(path), "turning").p0[0]


def test_files_of_one_name_in_two_folders_are_not_mixed_up(tmp_path):
    for name, speed in (("a", 3), ("b", 4)):
        (tmp_path / name).mkdir()
        (tmp_path / name / "ring.py").write_text(HELPED)
        (tmp_path / name / "helper_of_ring.py").write_text(f"SPEED = {speed}\n")
    before = list(sys.path), set(sys.modules)
    assert [momentum(tmp_path / name / "ring.py") for name in "abab"] == [6, 8, 6, 8]
    assert sys.path == before[0]
    assert "helper_of_ring" not in sys.modules


def test_what_a_name_meant_before_is_put_back(tmp_path, monkeypatch):
    mine = type(sys)("helper_of_ring")
    monkeypatch.setitem(sys.modules, "helper_of_ring", mine)
    (tmp_path / "ring.py").write_text(HELPED)
    (tmp_path / "helper_of_ring.py").write_text("SPEED = 5\n")
    assert momentum(tmp_path / "ring.py") == 10
    assert sys.modules["helper_of_ring"] is mine


EDITS = {
    "the file": ("ring.py", HELPED.replace("(3", "(4").replace("SPEED * m", "SPEED * m * 2"), 12),
    "a helper": ("helper_of_ring.py", "SPEED = 7\n", 14),
    "a helper of a helper": ("deep_of_ring/inner.py", "SPEED = 8\n", 16),
}


@pytest.mark.parametrize(("file", "text", "expected"), EDITS.values(), ids=EDITS)
def test_an_edited_file_is_never_served_from_the_cache_of_the_old_one(tmp_path, monkeypatch, file, text, expected):
    monkeypatch.setattr(sys, "dont_write_bytecode", False)
    (tmp_path / "ring.py").write_text(HELPED)
    (tmp_path / "deep_of_ring").mkdir()
    (tmp_path / "deep_of_ring" / "__init__.py").write_text("")
    (tmp_path / "deep_of_ring" / "inner.py").write_text("SPEED = 3\n")
    (tmp_path / "helper_of_ring.py").write_text("from deep_of_ring.inner import SPEED\n")
    stamp = (tmp_path / file).stat()
    assert momentum(tmp_path / "ring.py") == 6
    (tmp_path / file).write_text(text)
    os.utime(tmp_path / file, ns=(stamp.st_atime_ns, stamp.st_mtime_ns))  # as within one tick of the clock
    assert momentum(tmp_path / "ring.py") == expected


def test_equal_files_in_two_folders_may_read_what_is_beside_them(tmp_path):
    text = RING.replace("(3 * m, 0)", "(int((Path(__file__).parent / 'speed.txt').read_text()) * m, 0)").replace(
        "import mpmath", "from pathlib import Path\n\nimport mpmath", 1
    )
    for name, speed in (("a", 3), ("b", 4)):
        (tmp_path / name).mkdir()
        (tmp_path / name / "ring.py").write_text(text)
        (tmp_path / name / "speed.txt").write_text(str(speed))
    assert [momentum(tmp_path / name / "ring.py") for name in "ab"] == [6, 8]


def test_an_import_that_cannot_be_seen_is_refused(tmp_path):
    text = HELPED.replace("import helper_of_ring", 'helper_of_ring = __import__("importlib").import_module("helper_of_ring")')
    (tmp_path / "ring.py").write_text(text)
    (tmp_path / "helper_of_ring.py").write_text("SPEED = 3\n")
    for _ in range(2):
        with pytest.raises(InvalidProblem, match=r"imports helper_of_ring.py in a way that cannot be seen in its text"):
            find_setting(str(tmp_path / "ring.py"))


def test_names_of_what_daebench_stands_on_are_taken():
    providers = importlib.metadata.packages_distributions()
    lines = [line for line in importlib.metadata.requires("daebench") or () if "extra" not in line or re.search("certify|scale", line)]
    needed = {re.match(r"[\w-]+", line)[0].lower() for line in lines} - {"daebench"}
    brought = {name for name, by in providers.items() if needed & {each.lower() for each in by} and name.isidentifier()}
    assert {name for name in brought if not name.startswith("_")} <= TAKEN
    assert len(brought) >= len(needed)


LONG = {"folders": ("d" * 100, "e" * 100, "ring.py"), "file": ("ring" * 50 + ".py",)}


@pytest.mark.parametrize("parts", LONG.values(), ids=LONG)
def test_a_path_of_any_length_has_its_files_in_the_cache(tmp_path, monkeypatch, parts):
    monkeypatch.setenv("DAEBENCH_CACHE", str(tmp_path / "kept"))
    path = tmp_path.joinpath(*parts)
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(RING)
    scene = find_setting(str(path), "turning")
    assert scene.value("g", scene.q0).tolist() == [0.0]
    kept = [each.stem for each in (tmp_path / "kept").glob("*.py")]
    assert len(kept) >= 3
    assert max(map(len, kept)) <= 120  # numba adds as much again for its own files beside these, and 255 is the limit


def test_a_file_beside_it_takes_no_name_that_daebench_stands_on(tmp_path, monkeypatch):
    (tmp_path / "ring.py").write_text(RING.replace("import sympy as sp\n", "import colorsys\nimport random\n\nimport sympy as sp\n", 1))
    monkeypatch.delitem(sys.modules, "colorsys", raising=False)
    for name in ("sympy", "random", "colorsys"):
        (tmp_path / f"{name}.py").write_text("raise RuntimeError('hijacked')\n")
    assert momentum(tmp_path / "ring.py") == 6


def test_what_a_file_prints_does_not_spoil_json(daebench, folder):
    (folder / "ring.py").write_text(RING.replace("    m, r", '    print("made")\n    m, r', 1))
    status, out, err = daebench("check", "./ring.py", "--case", "resting", "--json")
    assert (status, json.loads(out)["ok"], err) == (0, True, "made\n")


# ---- mistakes --------------------------------------------------------------------------------------------------------------

TEXT = {
    "no such file": (None, None, "nowhere.py: there is no such file"),
    "no function problem": ("def problem", "def problems", "ring.py defines no function problem"),
    "wrong annotation": ("-> ConstrainedHamiltonian:", "-> float:", "line 10: problem() must be annotated to return one of"),
    "no annotation": (" -> ConstrainedHamiltonian:", ":", "line 10: problem() must be annotated to return one of"),
    "syntax": ("    m, r = sp", "    m, r = = sp", "ring.py, line 11: this is not Python: invalid syntax"),
    "positional arguments": ("problem(*, mass", "problem(mass", "line 10: problem() takes mass, radius; write problem(*, ...)"),
    "argument of no number type": ("mass: float", "mass: complex", "argument mass of problem() must be annotated float or int"),
    "argument without default": (
        "mass: float = 2.0",
        "mass: float",
        "argument mass of problem() must be annotated float or int and have a default",
    ),
    "default that is computed": (
        "mass: float = 2.0",
        "mass: float = 2 * 3.1",
        "has the default 2 * 3.1, and must have a number that is written out",
    ),
    "default that is no whole number": ("mass: float = 2.0", "mass: int = 2.5", "its default 2.5 is no whole number of at least 1"),
}

RAISED = {
    "exception": ("    turn = ", "    1 / 0\n    turn = ", "ring.py, line 14: ZeroDivisionError: division by zero"),
    "exception at the top": ("from daebench.kin", "from daebench.no_such.kin", "line 7: ModuleNotFoundError: No module named"),
    "exit": ("    turn = ", "    raise SystemExit(3)\n    turn = ", "ring.py, line 14: SystemExit: 3"),
    "nothing returned": ("    return Constr", "    Constr", "problem() returns nothing, which is not what it is annotated to return"),
    "other kind": (
        "-> ConstrainedHamiltonian",
        '-> "daebench.PoissonSystem"',
        "problem() returns a ConstrainedHamiltonian, which is not what",
    ),
    "other parameters": (
        'sp.symbols("mass radius"',
        'sp.symbols("mass length"',
        "are mass, radius, and the parameters of its definition length, mass",
    ),
    "a case's parameter": ("p=(0, 0))", 'p=(0, 0), parameters={"raduis": 2})', "case 'resting' sets raduis, which is no parameter"),
}

DEFINED = {
    "wrong p": ("        p=p,", "        p=p[:1],", "2 positions but 1 momenta"),
    "wrong M": ("M=m * sp.eye(2)", "M=m * sp.eye(3)", "the mass matrix M has shape (3, 3), but there are 2 positions"),
    "M that is a list": ("M=m * sp.eye(2)", "M=[[m, 0], [0, m]]", "the mass matrix M must be a SymPy Matrix, and is a list"),
    "M that is not symmetric": ("M=m * sp.eye(2)", "M=sp.Matrix([[m, 1], [0, m]])", "the mass matrix M is not symmetric"),
    "g that is no sequence": (
        "g=[q[0] ** 2 + q[1] ** 2 - r**2]",
        "g=q[0] ** 2 + q[1] ** 2 - r**2",
        "g is q1**2 + q2**2 - radius**2, and must be a sequence",
    ),
    "g that is an equation": ("- r**2]", "- r**2, sp.Eq(q[0], 0)][1:]", "g is the equation Eq(q1, 0); give the difference of its sides"),
    "too many constraints": ("- r**2]", "- r**2, q[0]]", "2 constraints on 2 positions"),
    "wrong case": ("p=(0, 0))", "p=(0, 0, 0))", "case 'resting' has 2 positions and 3 momenta; both must be 2"),
    "case of another type": ("Case(q=(r, 0), p=(0, 0))", "((r, 0), (0, 0))", "case 'resting' is a tuple; it must be a Case(q=..., p=...)"),
    "q that is no symbol": ("        q=q,", "        q=('q1', 'q2'),", "q contains 'q1', which is no SymPy Symbol"),
    "undeclared symbol": ("U=sp.S.Zero", 'U=sp.Symbol("k") * q[0]', "U contains k, which it may not depend on; declare it"),
    "g of momenta": ("- r**2]", "- r**2 + p[0]]", "g contains p1, which it may not depend on"),
    "other assumptions": ("U=sp.S.Zero", 'U=sp.Symbol("q1") ** 2', "U contains q1 with other assumptions than those declared"),
    "symbol used twice": ("        p=p,", "        p=q,", "q1, q2 stands for more than one position, momentum or parameter"),
    "H and M": ("U=sp.S.Zero", "U=sp.S.Zero, H=p[0] ** 2", "gives either H(p, q), or M and U together"),
    "complex number": ("U=sp.S.Zero", "U=sp.sqrt(-2) * q[0]", "U is not a real number everywhere: it contains an imaginary unit"),
    "infinity": ("U=sp.S.Zero", "U=q[0] + sp.oo", "U is not a real number everywhere"),
    "complex start": ("p=(0, 0))", "p=(0, sp.I))", "p of case 'resting'[1] is not a real number everywhere"),
    "|q|": ("U=sp.S.Zero", "U=sp.Abs(q[0])", "U contains Abs(q1), which is not twice differentiable"),
    "sign": ("U=sp.S.Zero", "U=q[0] * sp.sign(q[0])", "U contains sign(q1), which is not twice differentiable"),
    "Max": ("- r**2]", "- r**2 + sp.Max(q[0], 0)]", "g[0] contains Max(0, q1), which is not twice differentiable"),
    "Piecewise": (
        "U=sp.S.Zero",
        "U=sp.Piecewise((q[0], q[0] > 0), (0, True))",
        "U contains Piecewise((q1, q1 > 0), (0, True)), which is not twice",
    ),
    "floor": ("U=sp.S.Zero", "U=sp.floor(q[0])", "U contains floor(q1), which is not twice differentiable"),
    "Heaviside in M": (
        "M=m * sp.eye(2)",
        "M=(m + sp.Heaviside(q[0])) * sp.eye(2)",
        "M contains Heaviside(q1), which is not twice differentiable",
    ),
    "undefined function": ("U=sp.S.Zero", 'U=sp.Function("V")(q[0])', "U contains V(q1), a function that is not defined"),
    "chart of positions": ("q=list(r * e)", "q=list(q)", "the chart contains q1, q2, which it may not depend on"),
    "open integral": ("U=sp.S.Zero", "U=sp.Integral(sp.exp(q[0] ** 2), q[0])", "which SymPy has not carried out; call doit()"),
}

DECLARED = {
    "function without numbers": ("U=sp.S.Zero", "U=sp.besselj(0, q[0])", "H cannot be written as a numerical function"),
    "H that is not finite": ("U=sp.S.Zero", "U=sp.log(q[0] - r)", "case 'resting': H is no finite number at the start"),
    "H that is complex": ("U=sp.S.Zero", "U=sp.sqrt(q[0] - 2 * r)", "case 'resting': H is no finite number at the start"),
    "kink at the start": (
        "U=sp.S.Zero",
        "U=((q[0] - r) ** 2 + q[1] ** 2) ** sp.Rational(2, 3)",
        "case 'resting': the derivative H_q is no finite number",
    ),
    "second derivative": (
        "U=sp.S.Zero",
        "U=(q[0] + q[1] - r) ** sp.Rational(3, 2)",
        "case 'resting': the derivative H_qq is no finite number",
    ),
    "singular M": (
        "M=m * sp.eye(2)",
        "M=sp.Matrix([[m, m], [m, m]])",
        "the mass matrix M is singular at q0: its eigenvalues are from 0 to 4",
    ),
    "indefinite M": (
        "M=m * sp.eye(2)",
        "M=sp.diag(m, -m)",
        "the mass matrix M is not positive definite at q0: its eigenvalues are from -2 to 2",
    ),
    "integral": ("turn}", "p[0]}", "L is no first integral: its derivative along the motion is"),
    "integral that is no number": (
        "turn}",
        "turn + sp.sqrt(q[0] - 9)}",
        "its derivative along the motion is nan",
    ),
    "complex closed form": (
        "c, s = mp.cos(angle), mp.sin(angle)",
        "c, s = mp.mpc(mp.cos(angle), 1), mp.sin(angle)",
        "closed_form raises TypeError: cannot create mpf from",
    ),
    "kinetic flow of an H": (
        "M=m * sp.eye(2),\n        U=sp.S.Zero,",
        "H=(p[0] ** 2 + p[1] ** 2) / (2 * m),",
        "a kinetic flow needs M and U in place of H",
    ),
    "closed form elsewhere": ("** 2) * t", "** 2) * (t + 1)", "closed_form is off the initial values at t = 0 by"),
    "closed form too fast": ("** 2) * t", "** 2) * t * 2", "closed_form misses the equations of motion by 1 of their size at t = 0 s"),
    "closed form that raises": ('parameters["mass"]', 'parameters["m"]', "closed_form raises KeyError: 'm'"),
    "closed form of wrong size": ("return [c * q0[0] - s * q0[1], s", "return [s", "closed_form returns 3 numbers, and a state has 4"),
    "kinetic flow that moves at once": (
        "kinetic_flow=flow",
        "kinetic_flow=KineticFlow(t=flow.t, p=flow.p, q=[2 * x for x in flow.q])",
        "the kinetic flow over time 0 moves the state by",
    ),
    "kinetic flow too fast": (
        "kinetic_flow=flow",
        "kinetic_flow=sphere(q, p, mass=m / 2, length=r)",
        "the kinetic flow misses p' = -T_q - G^T lam, q' = H_p by",
    ),
    "kinetic flow off the manifold": (
        "kinetic_flow=flow",
        "kinetic_flow=KineticFlow(t=flow.t, p=p, q=[x + flow.t * y / m for x, y in zip(q, p)])",
        "the kinetic flow leaves the manifold",
    ),
    "kinetic flow in another time": (
        "kinetic_flow=flow",
        "kinetic_flow=KineticFlow(t=flow.t, **{x: [y.subs(flow.t, flow.t + flow.t**3) for y in getattr(flow, x)] for x in 'pq'})",
        "the kinetic flow over a time twice is not that over twice the time, by",
    ),
    "chart without values": (
        "sp.atan2(q[1], q[0])",
        "sp.atan2(q[1], q[0]) * sp.log(-r)",
        "the chart has no finite values around the start of case 'turning'",
    ),
    "inverse of the chart": ("inverse_eta=[turn / (m", "inverse_eta=[2 * turn / (m", "the chart and its inverse do not undo each other"),
}


def edited(folder, old, new):
    assert RING.count(old) >= 1
    (folder / "ring.py").write_text(RING.replace(old, new, 1))


@pytest.mark.parametrize(("old", "new", "sentence"), TEXT.values(), ids=TEXT)
def test_a_mistake_in_the_form_of_the_file_is_named(daebench, folder, old, new, sentence):
    if old is not None:
        edited(folder, old, new)
    status, out, err = daebench("show", "./ring.py" if old else "./nowhere.py")
    assert (status, out) == (2, "")
    assert sentence in err
    assert err.count("\n") == 1


@pytest.mark.parametrize(("old", "new", "sentence"), [*RAISED.values(), *DEFINED.values()], ids=[*RAISED, *DEFINED])
def test_a_mistake_in_the_definition_is_named_with_the_file_and_the_line(daebench, folder, old, new, sentence):
    edited(folder, old, new)
    status, out, err = daebench("run", "./ring.py", "--method", "rattle", "--h", 0.1, "--steps", 1)
    assert (status, out) == (2, "")
    assert err.startswith("daebench: ./ring.py")
    assert sentence in err
    assert err.count("\n") == 1


@pytest.mark.parametrize(("old", "new", "sentence"), DECLARED.values(), ids=DECLARED)
def test_what_is_declared_and_not_so_is_named(daebench, folder, old, new, sentence):
    edited(folder, old, new)
    case = "resting" if "resting" in sentence else "turning"
    status, out, err = daebench("run", "./ring.py", "--case", case, "--method", "rattle", "--h", 0.1, "--steps", 1)
    assert (status, out) == (2, "")
    assert err.startswith("daebench: ./ring.py")
    assert sentence in err
    assert err.count("\n") == 1


LATER = {
    "a call": ("    turn = ", "    fragile.break_down()\n    turn = ", 15),
    "the top": ("\n\ndef problem", "\nfragile.break_down()\n\n\ndef problem", 10),
}


@pytest.mark.parametrize(("old", "new", "line"), LATER.values(), ids=LATER)
def test_the_place_is_in_the_users_file_where_another_package_in_its_folder_raises(tmp_path, monkeypatch, old, new, line):
    library = tmp_path / ".venv" / "lib"
    library.mkdir(parents=True)
    (library / "fragile.py").write_text("def break_down():\n    raise ValueError('too much')\n")
    monkeypatch.syspath_prepend(str(library))
    (tmp_path / "ring.py").write_text(RING.replace(old, new, 1).replace("import sympy", "import fragile\nimport sympy", 1))
    try:
        with pytest.raises(InvalidProblem, match=rf"ring.py, line {line}: ValueError: too much; correct the file"):
            find_setting(str(tmp_path / "ring.py"))
    finally:
        sys.modules.pop("fragile", None)


@pytest.mark.parametrize("what", ["integrals", "kinetic_flow"])
def test_a_declaration_that_is_checked_nowhere_is_not_found_sound(folder, monkeypatch, what):
    scene = find_setting("./ring.py", "turning")
    monkeypatch.setattr("daebench.declared_checks.points", lambda scene: iter(()))
    fault = getattr(problem_check.declared_checks, what)(scene)
    assert re.fullmatch(r"\./ring\.py: .* cannot be checked around the start of case 'turning'.*; correct .*\.", fault)


OFF = {
    "g": ("Case(q=(r, 0), p=(0, 0))", "Case(q=(r + 1, 0), p=(0, 0))", "g[0] = q1**2 + q2**2 - radius**2, is 4 at q0 and not 0"),
    "G H_p": ("Case(q=(r, 0), p=(0, 0))", "Case(q=(r, 0), p=(4, 0))", "G H_p[0], is 6 at q0, p0 and not 0"),
}


@pytest.mark.parametrize(("old", "new", "sentence"), OFF.values(), ids=OFF)
def test_initial_values_off_the_manifold_are_named_with_the_constraint(daebench, folder, old, new, sentence):
    edited(folder, old, new)
    status, out, _ = daebench("check", "./ring.py")
    assert status == 1
    assert f"./ring.py, case 'resting': constraint 1 of 1, {sentence}; correct the case, or add --project" in " ".join(out.split())
    assert daebench("check", "./ring.py", "--case", "turning")[0] == 0
    assert np.allclose(package.setting_of("./ring.py", "resting", project=True).q0, [1.5, 0.0], rtol=0, atol=1e-15)


def test_what_was_found_sound_is_not_looked_at_again_until_the_file_changes(folder, monkeypatch):
    find_setting("./ring.py", "turning")
    monkeypatch.setattr("daebench.problem_check.held", lambda setting: pytest.fail("checked again"))
    find_setting("./ring.py", "turning", {"mass": 3.0})
    (folder / "ring.py").write_text(RING + "\n")
    with pytest.raises(pytest.fail.Exception, match="checked again"):
        find_setting("./ring.py", "turning")


DECIDE = ["problem_check", "declared_checks", "definition_checks", "nearby", "consistency", "manifold", "metric", "rank"]


@pytest.mark.parametrize("name", DECIDE)
def test_what_was_found_sound_is_looked_at_again_where_the_check_itself_changed(monkeypatch, name):
    before, read = problem_check._code.__wrapped__(), Path.read_bytes
    monkeypatch.setattr(Path, "read_bytes", lambda path: read(path) + (b"#" if path.stem == name else b""))
    assert problem_check._code.__wrapped__() != before


def test_what_refuses_a_definition_is_a_part_of_the_toolchain(monkeypatch):
    before, read = cache.toolchain.__wrapped__(), Path.read_bytes
    monkeypatch.setattr(Path, "read_bytes", lambda path: read(path) + (b"#" if path.name == "definition_checks.py" else b""))
    assert cache.toolchain.__wrapped__() != before


NOT_SMOOTH = {
    "B": ("[[0, u * v], [-u * v, 0]]", "[[0, sp.Max(u, v)], [-sp.Max(u, v), 0]]"),
    "H": ("H=u - ", "H=sp.Max(u, v) - "),
}


@pytest.mark.parametrize(("old", "new"), NOT_SMOOTH.values(), ids=NOT_SMOOTH)
def test_a_poisson_system_that_is_not_smooth_is_named(daebench, folder, old, new):
    (folder / "orbit.py").write_text(ORBIT.replace(old, new))
    status, _, err = daebench("run", "./orbit.py", "--method", "midpoint", "--anyway", "--h", 0.1, "--steps", 1)
    assert status == 2
    assert "contains Max(u, v), which is not twice differentiable" in err


@pytest.mark.slow
@pytest.mark.parametrize("name", catalogue.problems())
def test_what_the_problems_of_the_catalogue_declare_is_so(name):
    found = [each for setting in catalogue.declared_settings(name) for each in held(setting)]
    assert found
    assert [each for each in found if each.fault] == []


# ---- problems of other packages --------------------------------------------------------------------------------------------


@pytest.fixture
def install(tmp_path, monkeypatch):
    """Return a function that puts a package with a problem where Python finds it, as an installer does."""
    monkeypatch.syspath_prepend(str(tmp_path))

    def installed(package_name, entry_points, **files):
        (tmp_path / package_name).mkdir(exist_ok=True)
        for name, text in {"__init__": "raise RuntimeError('imported too early')\n", **files}.items():
            (tmp_path / package_name / f"{name}.py").write_text(text)
        info = tmp_path / f"{package_name}-1.2.dist-info"
        info.mkdir()
        (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {package_name}\nVersion: 1.2\n")
        lines = "\n".join(f"{name} = {value}" for name, value in entry_points.items())
        (info / "entry_points.txt").write_text(f"[daebench.problems]\n{lines}\n")
        plugins.cache_clear()

    yield installed
    plugins.cache_clear()
    for name in list(sys.modules):
        if name.partition(".")[0].startswith("plugged"):
            del sys.modules[name]


def test_a_problem_of_another_package_is_listed_without_importing_it_and_used_by_name(daebench, install, monkeypatch):
    install("plugged", {"plugged_ring": "plugged.ring"}, ring=RING)
    status, out, err = daebench("list", "problems", "--json")
    rows = {row["name"]: row for row in json.loads(out)["problems"]}
    assert (status, err) == (0, "")
    assert rows["plugged_ring"]["about"] == "A bead on a ring, free to slide."
    assert (rows["plugged_ring"]["package"], rows["planar_pendulum"]["package"]) == ("plugged 1.2", "daebench")
    (find_problem("plugged_ring").path.parent / "__init__.py").write_text("")
    assert find_setting("plugged_ring", "turning").p0.tolist() == [6.0, 0.0]
    monkeypatch.setattr("daebench.catalogue.problems", dict)
    assert package.problems().to_dict("list") == {
        "problem": ["plugged_ring"],
        "kind": ["constrained"],
        "summary": ["A bead on a ring, free to slide."],
        "parameters": [{"mass": 2.0, "radius": 1.5}],
        "cases": [["turning", "resting"]],
    }


def test_a_mistake_in_a_problem_of_another_package_is_named(daebench, install, monkeypatch):
    install("plugged2", {"plugged_wrong": "plugged2.ring:problem"}, ring=RING.replace("    turn =", "    1 / 0\n    turn ="), __init__="")
    status, _, err = daebench("show", "plugged_wrong")
    assert (status, err) == (2, "daebench: plugged_wrong, in ring.py, line 14: ZeroDivisionError: division by zero; correct the file.\n")
    monkeypatch.setattr("daebench.catalogue.problems", dict)
    with pytest.warns(UserWarning, match="problem plugged_wrong of plugged2 1.2 cannot be used: plugged_wrong, in ring.py, line 14"):
        assert package.problems().empty


@pytest.fixture
def install_module(install, tmp_path):
    """Return a function that installs a problem as a module that is in no package, with modules beside it."""

    def installed(name, **files):
        install(f"{name}_dist", {f"{name}_problem": name})
        for each, text in files.items():
            (tmp_path / f"{each}.py").write_text(text)

    return installed


def test_a_problem_in_a_module_of_its_own_depends_on_the_modules_that_it_imports(install_module, tmp_path):
    install_module("plugged7", plugged7=HELPED.replace("helper_of_ring", "plugged7_helper"), plugged7_helper="SPEED = 3\n")
    before = find_problem("plugged7_problem").digest
    plugins.cache_clear()
    assert find_problem("plugged7_problem").digest == before
    (tmp_path / "plugged7_helper.py").write_text("SPEED = 4\n")
    plugins.cache_clear()
    assert find_problem("plugged7_problem").digest != before


def test_the_place_of_a_mistake_in_a_module_of_its_own_is_in_no_other_package(install_module):
    hidden = '__import__("importlib").import_module("plugged8_other")'
    text = RING.replace("    turn =", f"    {hidden}.break_down()\n    turn =", 1)
    install_module("plugged8", plugged8=text, plugged8_other="def break_down():\n    raise ValueError('too much')\n")
    with pytest.raises(InvalidProblem, match=r"^plugged8_problem, in plugged8.py, line 14: ValueError: too much"):
        find_setting("plugged8_problem")


BROKEN = {
    "no module": (
        {"plugged_b": "plugged3.nothing"},
        "problem plugged_b of plugged3 1.2 cannot be used: there is no Python file of the module plugged3.nothing",
    ),
    "no package": ({"plugged_b": "plugged_nowhere"}, "cannot be used: there is no Python file of the module plugged_nowhere"),
    "no problem": ({"plugged_b": "plugged3.empty"}, "cannot be used: empty.py defines no function problem"),
    "not Python": ({"plugged_b": "plugged3.bad"}, "line 1: this is not Python"),
    "other attribute": (
        {"plugged_b": "plugged3.ring:scene"},
        "its entry point 'plugged3.ring:scene' must be the name of a module that has a function problem",
    ),
    "name of daebench's own": (
        {"planar_pendulum": "plugged3.ring"},
        "problem planar_pendulum of plugged3 1.2 has the name of one of daebench's own, which is used",
    ),
    "name of a file": ({"a/b": "plugged3.ring"}, "problem 'a/b' of plugged3 1.2 has the name of a file"),
}


@pytest.mark.parametrize(("entry_points", "sentence"), BROKEN.values(), ids=BROKEN)
def test_a_broken_entry_point_is_named_and_does_not_spoil_the_list(daebench, install, entry_points, sentence):
    install("plugged3", entry_points, ring=RING, empty="", bad="def (")
    status, out, err = daebench("list", "problems", "--json")
    assert status == 0
    assert "planar_pendulum" in [row["name"] for row in json.loads(out)["problems"]]
    assert sentence in err
    assert err.count("\n") == 1
    if "plugged_b" in entry_points:
        assert sentence in daebench("show", "plugged_b")[2]


def test_a_name_that_two_packages_bring_is_refused(daebench, install):
    for name in ("plugged4", "plugged5"):
        install(name, {"plugged_twice": f"{name}.ring"}, ring=RING)
    sentence = "problem plugged_twice is brought by plugged4 1.2 and plugged5 1.2, so that the name could mean either"
    assert sentence in daebench("list", "problems")[2]
    status, _, err = daebench("show", "plugged_twice")
    assert (status, sentence in err) == (2, True)


def test_an_unknown_name_has_those_of_other_packages_near(daebench, install):
    install("plugged6", {"plugged_ring": "plugged6.ring"}, ring=RING)
    assert "did you mean plugged_ring?" in daebench("show", "pluged_ring")[2]

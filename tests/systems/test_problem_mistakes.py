"""Mistakes in a problem file: each is named with the file, the line or the case, and what is found sound is not looked at again."""

import sys
from pathlib import Path

import numpy as np
import pytest
from own_files import ORBIT, RING
from refusals import refused, unsaid

import daebench as package
from daebench.diagnostics import consistency, manifold, metric, nearby, rank
from daebench.diagnostics.problem import check
from daebench.errors import InvalidProblem
from daebench.methods.initial_value_problem import initial_value_problem
from daebench.systems import constrained_checks
from daebench.systems.files.package import digest_of_packages

TEXT = {
    "no such file": (None, None, "no-such-file-or-name", ["nowhere.py"]),
    "no function problem": ("def problem", "def problems", "file-without-problem", ["ring.py"]),
    "wrong annotation": ("-> ConstrainedHamiltonian:", "-> float:", "problem-file-faulty", ["line 10", "ConstrainedHamiltonian"]),
    "no annotation": (" -> ConstrainedHamiltonian:", ":", "problem-file-faulty", ["line 10", "ConstrainedHamiltonian"]),
    "syntax": ("    m, r = sp", "    m, r = = sp", "problem-file-not-python", ["ring.py, line 11", "invalid syntax"]),
    "positional arguments": ("problem(*, mass", "problem(mass", "problem-file-faulty", ["line 10", "mass, radius", "keyword-only"]),
    "argument of no number type": ("mass: float", "mass: complex", "problem-file-faulty", ["argument mass", "annotated float or int"]),
    "default that is computed": ("mass: float = 2.0", "mass: float = 2 * 3.1", "problem-file-faulty", ["argument mass", "2 * 3.1"]),
    "several at once": (
        "problem(*, mass: float = 2.0",
        "problem(length, *, mass: float, scale: float = 1 + 1",
        "problem-file-faulty",
        ["takes length", "line 10: argument mass", "line 10: argument scale", "1 + 1"],
    ),
    "default that is not a whole number": ("mass: float = 2.0", "mass: int = 2.5", "problem-file-faulty", ["argument mass", "2.5"]),
}

RAISED = {
    "exception": ("    turn = ", "    1 / 0\n    turn = ", "user-file-raises", ["line 14", "ZeroDivisionError: division by zero"]),
    "exception at the top": (
        "from daebench.systems.kin",
        "from daebench.no_such.kin",
        "user-file-raises",
        ["line 7", "ModuleNotFoundError"],
    ),
    "exit": ("    turn = ", "    raise SystemExit(3)\n    turn = ", "user-file-raises", ["line 14", "SystemExit: 3"]),
    "exit at the top": (
        "import sympy as sp",
        "import sys\n\nimport sympy as sp\n\nsys.exit(0)",
        "user-file-raises",
        ["line 8", "SystemExit: 0"],
    ),
    "exit past Python": (
        "    turn = ",
        "    __import__('os')._exit(0)\n    turn = ",
        "user-file-raises",
        ["line 14", "SystemExit: os._exit(0)"],
    ),
    "exit past Python at the top": (
        "import sympy as sp",
        "import sympy as sp\nfrom os import _exit\n_exit(3)",
        "user-file-raises",
        ["SystemExit: os._exit(3)"],
    ),
    "nothing returned": ("    return Constr", "    Constr", "problem-returns-other-type", ["nothing"]),
    "other kind": (
        "-> ConstrainedHamiltonian",
        '-> "daebench.PoissonSystem"',
        "problem-returns-other-type",
        ["a ConstrainedHamiltonian"],
    ),
    "other parameters": (
        'sp.symbols("mass radius"',
        'sp.symbols("mass length"',
        "problem-arguments-differ",
        ["mass, radius", "length, mass"],
    ),
    "a case's parameter": ("p=(0, 0))", 'p=(0, 0), parameters={"raduis": 2})', "case-sets-no-parameter", ["'resting'", "raduis"]),
}

MODEL_FILES = {"arm.mo": "Modelica", "arm.sdf": "SDF", "arm.xacro": "xacro", "arm.json": "Python", "arm.txt": "Python"}


@pytest.mark.parametrize("name", MODEL_FILES)
def test_a_file_that_cannot_be_read_is_refused_with_those_that_can(daebench, folder, name):
    (folder / name).write_text("<robot/>")
    for words in (["check", f"./{name}"], ["run", f"./{name}", "--method", "rattle", "--h", "0.1", "--t-end", "1"]):
        status, out, err = daebench(*words)
        assert (status, out, err.count("\n")) == (2, "", 1)
        assert daebench.error.code == ("not-a-problem-file" if MODEL_FILES[name] == "Python" else "model-format-unread")
        assert unsaid([MODEL_FILES[name], "MJCF (.xml) and URDF (.urdf)"], err) == []


DEFINED = {
    "wrong p": ("        p=p,", "        p=p[:1],", "momenta-not-per-position", ["2", "1"]),
    "wrong M": ("M=m * sp.eye(2)", "M=m * sp.eye(3)", "mass-matrix-shape", ["(3, 3)", "2"]),
    "M that is a list": ("M=m * sp.eye(2)", "M=[[m, 0], [0, m]]", "mass-matrix-type", ["list"]),
    "M that is not symmetric": ("M=m * sp.eye(2)", "M=sp.Matrix([[m, 1], [0, m]])", "mass-matrix-not-symmetric", []),
    "g that is not a sequence": (
        "g=[q[0] ** 2 + q[1] ** 2 - r**2]",
        "g=q[0] ** 2 + q[1] ** 2 - r**2",
        "not-a-sequence",
        ["g", "q1**2 + q2**2 - radius**2"],
    ),
    "g that is an equation": ("- r**2]", "- r**2, sp.Eq(q[0], 0)][1:]", "equation-for-expression", ["g", "Eq(q1, 0)"]),
    "too many constraints": ("- r**2]", "- r**2, q[0]]", "chart-counts", ["0"]),
    "wrong case": ("p=(0, 0))", "p=(0, 0, 0))", "case-sizes", ["'resting'", "2", "3"]),
    "case of another type": (
        "Case(q=(r, 0), p=(0, 0))",
        "((r, 0), (0, 0))",
        "case-of-wrong-type",
        ["'resting'", "tuple", "Case", "q=..., p=..."],
    ),
    "q that is no symbol": ("        q=q,", "        q=('q1', 'q2'),", "not-a-symbol", ["q", "'q1'"]),
    "undeclared symbol": ("U=sp.S.Zero", 'U=sp.Symbol("k") * q[0]', "symbol-undeclared", ["U", "k"]),
    "g of momenta": (
        "- r**2]",
        "- r**2 + p[0]]",
        "velocity-in-constraint",
        ["p1"],
    ),
    "g of velocities": (
        "- r**2]",
        "- r**2, q[0] * sp.Symbol('w1', real=True)], v=sp.symbols('w1:3', real=True), force=[0, 0]",
        "velocity-in-constraint",
        ["w1"],
    ),
    "g of a derivative": ("- r**2]", "- r**2 + sp.Function('x')(r).diff(r)]", "velocity-in-constraint", ["Derivative(x(radius), radius)"]),
    "g of an undeclared velocity": (
        "- r**2]",
        "- r**2 + sp.Symbol('xdot')]",
        "symbol-undeclared",
        ["xdot", "v="],
    ),
    "other assumptions": ("U=sp.S.Zero", 'U=sp.Symbol("q1") ** 2', "symbol-assumptions-differ", ["U", "q1"]),
    "symbol used twice": ("        p=p,", "        p=q,", "name-stands-for-two", ["q1, q2"]),
    "H and M": ("U=sp.S.Zero", "U=sp.S.Zero, H=p[0] ** 2", "h-beside-mass-and-potential", []),
    "complex number": ("U=sp.S.Zero", "U=sp.sqrt(-2) * q[0]", "not-real-everywhere", ["U"]),
    "infinity": ("U=sp.S.Zero", "U=q[0] + sp.oo", "not-real-everywhere", ["U"]),
    "complex start": ("p=(0, 0))", "p=(0, sp.I))", "not-real-everywhere", ["p of case 'resting'[1]"]),
    "|q|": ("U=sp.S.Zero", "U=sp.Abs(q[0])", "function-not-differentiable", ["U", "Abs(q1)"]),
    "sign": ("U=sp.S.Zero", "U=q[0] * sp.sign(q[0])", "function-not-differentiable", ["U", "sign(q1)"]),
    "Piecewise": ("U=sp.S.Zero", "U=sp.Piecewise((q[0], q[0] > 0), (0, True))", "function-not-differentiable", ["U", "Piecewise"]),
    "floor": ("U=sp.S.Zero", "U=sp.floor(q[0])", "function-not-differentiable", ["U", "floor(q1)"]),
    "Max": ("- r**2]", "- r**2 + sp.Max(q[0], 0)]", "function-not-differentiable", ["g[0]", "Max(0, q1)"]),
    "Heaviside in M": (
        "M=m * sp.eye(2)",
        "M=(m + sp.Heaviside(q[0])) * sp.eye(2)",
        "function-not-differentiable",
        ["M", "Heaviside(q1)"],
    ),
    "undefined function": ("U=sp.S.Zero", 'U=sp.Function("V")(q[0])', "function-undefined", ["U", "V(q1)"]),
    "chart of positions": ("q=list(r * e)", "q=list(q)", "chart-symbol-undeclared", ["the chart", "q1, q2"]),
    "open integral": ("U=sp.S.Zero", "U=sp.Integral(sp.exp(q[0] ** 2), q[0])", "function-unevaluated", ["U", "doit()"]),
}

DECLARED = {
    "function without numbers": ("U=sp.S.Zero", "U=sp.besselj(0, q[0])", "H cannot be written as a numerical function"),
    "H that is not finite": ("U=sp.S.Zero", "U=sp.log(q[0] - r)", "case 'resting': H is not finite at the start"),
    "H that is complex": ("U=sp.S.Zero", "U=sp.sqrt(q[0] - 2 * r)", "case 'resting': H is not finite at the start"),
    "kink at the start": (
        "U=sp.S.Zero",
        "U=((q[0] - r) ** 2 + q[1] ** 2) ** sp.Rational(2, 3)",
        "case 'resting': the derivative H_q is not finite",
    ),
    "second derivative": (
        "U=sp.S.Zero",
        "U=(q[0] + q[1] - r) ** sp.Rational(3, 2)",
        "case 'resting': the derivative H_qq is not finite",
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
    "integral": ("turn}", "p[0]}", "L is not a first integral: its derivative along the motion is"),
    "integral that is not a number": (
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
    "closed form that exits": ("    c, s =", "    raise SystemExit(0)\n    c, s =", "closed_form raises SystemExit: 0; correct it"),
    "closed form that exits past Python": (
        "    c, s =",
        "    __import__('os')._exit(0)\n    c, s =",
        "closed_form raises SystemExit: os._exit(0); correct it",
    ),
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


ALIKE = (
    "H that is complex",
    "complex closed form",
    "kinetic flow of an H",
    "chart without values",
    "second derivative",
    "indefinite M",
    "integral that is not a number",
    "closed form that raises",
    "closed form that exits",
    "closed form of wrong size",
    "kinetic flow too fast",
    "kinetic flow off the manifold",
)
"""Mistakes that are found in the same way as another."""


def edited(folder, old, new):
    assert RING.count(old) >= 1
    (folder / "ring.py").write_text(RING.replace(old, new, 1))


@pytest.mark.parametrize(("old", "new", "code", "names"), TEXT.values(), ids=TEXT)
def test_a_mistake_in_the_form_of_the_file_is_named(daebench, folder, old, new, code, names):
    if old is not None:
        edited(folder, old, new)
    status, out, err = daebench("show", "./ring.py" if old else "./nowhere.py")
    assert (status, out) == (2, "")
    assert (daebench.error.code, unsaid(names, err)) == (code, [])
    assert err.count("\n") == 1


@pytest.mark.parametrize(("old", "new", "code", "names"), [*RAISED.values(), *DEFINED.values()], ids=[*RAISED, *DEFINED])
def test_a_mistake_in_the_definition_is_named_with_the_file_and_the_line(daebench, folder, old, new, code, names):
    edited(folder, old, new)
    status, out, err = daebench("run", "./ring.py", "--method", "rattle", "--h", 0.1, "--steps", 1)
    assert (status, out) == (2, "")
    assert err.startswith("daebench: ./ring.py")
    assert (daebench.error.code, unsaid(names, err)) == (code, [])
    assert err.count("\n") == 1


@pytest.mark.sampled(left_out=ALIKE)
@pytest.mark.parametrize(("old", "new", "sentence"), DECLARED.values(), ids=DECLARED)
def test_what_is_declared_and_not_so_is_named(daebench, folder, old, new, sentence):
    edited(folder, old, new)
    case = "resting" if "resting" in sentence else "turning"
    status, out, err = daebench("run", "./ring.py", "--case", case, "--method", "rattle", "--h", 0.1, "--steps", 1)
    assert (status, out) == (2, "")
    assert err.startswith("daebench: ./ring.py")
    assert daebench.error.code == "problem-check-failed"
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
        with refused("user-file-raises", InvalidProblem, [f"ring.py, line {line}", "ValueError: too much"]):
            initial_value_problem(str(tmp_path / "ring.py"))
    finally:
        sys.modules.pop("fragile", None)


@pytest.mark.parametrize("what", ["integrals", "kinetic_flow"])
def test_a_declaration_that_is_checked_nowhere_is_not_found_sound(folder, monkeypatch, what):
    ivp = initial_value_problem("./ring.py", "turning")
    monkeypatch.setattr("daebench.diagnostics.problem.declared.points", lambda ivp: iter(()))
    assert "cannot be checked" in getattr(check.declared_checks, what)(ivp)


OFF = {
    "g": ("Case(q=(r, 0), p=(0, 0))", "Case(q=(r + 1, 0), p=(0, 0))", "q1**2 + q2**2 - radius**2, is 4"),
    "G H_p": ("Case(q=(r, 0), p=(0, 0))", "Case(q=(r, 0), p=(4, 0))", "G H_p[0], is 6"),
}


@pytest.mark.parametrize(("old", "new", "residual"), OFF.values(), ids=OFF)
def test_initial_values_off_the_manifold_are_named_with_the_constraint(daebench, folder, old, new, residual):
    edited(folder, old, new)
    status, out, _ = daebench("check", "./ring.py")
    assert (status, unsaid(["'resting'"], out), residual in " ".join(out.split())) == (1, [], True)
    assert np.allclose(package.initial_value_problem("./ring.py", "resting", project=True).q0, [1.5, 0.0], rtol=0, atol=1e-15)


def test_what_was_found_sound_is_not_looked_at_again_until_the_file_changes(folder, monkeypatch):
    initial_value_problem("./ring.py", "turning")
    monkeypatch.setattr("daebench.diagnostics.problem.check.held", lambda ivp, **_: pytest.fail("checked again"))
    initial_value_problem("./ring.py", "turning", {"mass": 3.0})
    (folder / "ring.py").write_text(RING + "\n")
    with pytest.raises(pytest.fail.Exception, match="checked again"):
        initial_value_problem("./ring.py", "turning")


def test_what_was_found_sound_is_looked_at_again_where_the_check_itself_changed(folder, monkeypatch):
    initial_value_problem("./ring.py", "turning")
    modules = [check, check.declared_checks, constrained_checks, consistency, manifold, metric, nearby, rank]
    edited, read = [Path(module.__file__).resolve() for module in modules], Path.read_bytes
    monkeypatch.setattr("daebench.diagnostics.problem.check.digest_of_packages", digest_of_packages.__wrapped__)
    initial_value_problem("./ring.py", "turning")
    monkeypatch.setattr("daebench.diagnostics.problem.check.held", lambda ivp, **_: pytest.fail("checked again"))
    for changed in edited:
        monkeypatch.setattr(Path, "read_bytes", lambda path, changed=changed: read(path) + (b"#" if path.resolve() == changed else b""))
        with pytest.raises(pytest.fail.Exception, match="checked again"):
            initial_value_problem("./ring.py", "turning")
    monkeypatch.setattr(Path, "read_bytes", read)
    initial_value_problem("./ring.py", "turning")


NOT_SMOOTH = {
    "B": ("[[0, u * v], [-u * v, 0]]", "[[0, sp.Max(u, v)], [-sp.Max(u, v), 0]]"),
    "H": ("H=u - ", "H=sp.Max(u, v) - "),
}


@pytest.mark.parametrize(("old", "new"), NOT_SMOOTH.values(), ids=NOT_SMOOTH)
def test_a_poisson_system_that_is_not_smooth_is_named(daebench, folder, old, new):
    (folder / "orbit.py").write_text(ORBIT.replace(old, new))
    status, _, err = daebench("run", "./orbit.py", "--method", "midpoint", "--anyway", "--h", 0.1, "--steps", 1)
    assert (status, daebench.error.fields["check"], unsaid(["Max(u, v)"], err)) == (2, check.SMOOTH, [])

"""Parts of a definition that are not what they must be: each is one sentence with the file and the part, whatever the kind of problem."""

from itertools import cycle

import pytest
import sympy as sp
from mistaken import KINDS, written
from refusals import refused

from daebench.compiler.codegen import expressions
from daebench.errors import InvalidProblem
from daebench.methods.initial_value_problem import initial_value_problem
from daebench.methods.run import run
from daebench.systems.definition_parts import DEEPEST, LARGEST, extent

VALUES = {
    "expression": "2.0 * sp.Symbol('z')",
    "itself": "{symbol}",
    "tuple": "(1, 2)",
    "text": "'two'",
    "nothing": "None",
    "complex number": "1j",
    "NaN": "float('nan')",
    "endless integer": "10**400",
    "truth value": "True",
}
NAMES = {"number": "1", "nothing": "None", "symbol": "sp.Symbol('a')", "empty": "''", "blank": "'  '", "two lines": "'a\\nb'"}
NAMES |= {"surrogate": "'\\ud800'", "endless": "'a' * 100000", "tuple": "('a', 'b')"}
SYMBOLS = {"bead": "m", "species": "a", "links": "m"}
CASES = {"bead": "Case(q=(0, -1), p=(1, 0){})", "species": "PoissonCase(y=(1, 3){})", "links": "Case(q=(m * (k + 1), 0), p=(0, 0){})"}
SCALARS = {"bead": ("H", "H={}"), "species": ("H", "{}"), "links": ("U", "{}")}
OPENED = {"bead": "q[0]", "species": "u", "links": "x[0]"}


def mistaken(folder, kind, code, *names, **parts):
    (folder / "mine.py").write_text(written(kind, **parts), encoding="utf-8")
    with refused(code, says=["mine.py", *names]) as stop:
        initial_value_problem("./mine.py")
    assert len(str(stop.value)) <= 2000
    return str(stop.value)


@pytest.mark.parametrize("kind", KINDS)
def test_the_files_as_they_are_are_sound(folder, kind):
    (folder / "mine.py").write_text(written(kind))
    assert initial_value_problem("./mine.py").problem == "./mine.py"


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("value", VALUES)
def test_a_parameter_whose_value_is_no_number_is_named(folder, kind, value):
    text = VALUES[value].replace("{symbol}", SYMBOLS[kind])
    mistaken(folder, kind, "value-not-finite", parameters=f"{{{SYMBOLS[kind]}: {text}}}")


@pytest.mark.parametrize("name", ["q", "p", "m"])
def test_a_parameter_with_the_name_of_something_else_in_the_file_is_named(folder, name):
    sentence = mistaken(
        folder,
        "bead",
        "value-not-finite",
        f"the parameter {name}",
        parameter=name,
        parameters=f"{{sp.Symbol('{name}', positive=True): {name}}}",
    )
    assert "use its name" in sentence


def test_a_parameter_may_have_any_name_that_nothing_else_has(folder):
    names = ["q", "p", "y", "t", "h", "v", "lam", "mu", "x", "d", "s", "par", "time", "H", "g", "G", "e", "pi", "sin", "self"]
    text = written(
        "bead",
        parameter=": float = 2.0, ".join(names),
        lines="q, p = sp.symbols('z1:3', real=True), sp.symbols('w1:3', real=True)",
        H="M=sp.eye(2) * sum(many), U=q[1]",
        parameters="dict(zip(many, values))",
    )
    first = f"    values, many = [{', '.join(names)}], sp.symbols({' '.join(names)!r}, positive=True)\n    m = sp"
    (folder / "mine.py").write_text(text.replace("    m = sp", first))
    assert initial_value_problem("./mine.py").parameters == dict.fromkeys(names, 2.0)


def test_a_structural_parameter_may_be_called_self(folder):
    (folder / "mine.py").write_text(written("links").replace("n: int", "self: int").replace("nodes=n", "nodes=self"))
    assert initial_value_problem("./mine.py", None, {"self": 4}).d == 8


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("name", NAMES)
def test_a_case_whose_name_is_no_text_is_named(folder, kind, name):
    mistaken(folder, kind, "name-not-printable", cases=f"{{{NAMES[name]}: {CASES[kind].format('')}}}")


SETTINGS = {
    "parameters that are a list": ("parameters=[2]", "case-settings-not-a-mapping"),
    "parameters by symbol": ("parameters={sp.Symbol('mass'): 2.0}", "case-parameter-not-text"),
    "value that is an expression": ("parameters={'mass': sp.Symbol('z')}", "value-not-finite"),
    "value that is text": ("parameters={'mass': 'x'}", "value-not-finite"),
    "value that is complex": ("parameters={'mass': 1j}", "value-not-finite"),
    "about that is a number": ("about=3", "case-about-not-text"),
}


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("what", SETTINGS)
def test_settings_of_a_case_that_are_not_what_they_must_be_are_named(folder, kind, what):
    text, code = SETTINGS[what]
    mistaken(folder, kind, code, "'a'", cases=f"{{'a': {CASES[kind].format(', ' + text)}}}")


@pytest.mark.parametrize("value", ["3", "'x'", "None"])
def test_what_a_case_does_where_g_loses_rank_is_one_of_three(folder, value):
    mistaken(folder, "bead", "case-on-singular-unknown", "'a'", cases=f"{{'a': Case(q=(0, -1), p=(1, 0), on_singular={value})}}")


MATRICES = {"one entry": "sp.Matrix([[{x}]])", "square": "sp.eye(2) * {x}", "product": "sp.Matrix([{x}, {x}]).T * sp.Matrix([{x}, {x}])"}


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("matrix", MATRICES)
def test_a_matrix_in_the_place_of_an_expression_is_named(folder, kind, matrix):
    part, text = SCALARS[kind]
    mistaken(folder, kind, "matrix-for-expression", part, **{part: text.format(MATRICES[matrix].format(x=OPENED[kind]))})


PARTS = {
    "g": "matrix-for-expression",
    "integrals": "functions-not-a-mapping",
    "cases": "cases-not-a-mapping",
    "q": "symbol-assumed-too-much",
}
PARTS |= {"closed_form": "closed-form-not-function"} | dict.fromkeys(("kinetic_flow", "chart", "picture"), "part-of-wrong-type")


@pytest.mark.parametrize("where", PARTS)
def test_a_part_of_another_type_is_named(folder, where):
    text = {"g": "[sp.Matrix([q[0], q[1]])]", "cases": "[1]", "q": "(q[0], sp.Symbol('z', imaginary=True))"}
    parts = {where: text[where]} if where in text else {"more": f"{where}=3,"}
    mistaken(folder, "bead", PARTS[where], "z" if where == "q" else where, **parts)


@pytest.mark.parametrize("M", ["sp.diag(1, 0)", "sp.diag(0, 1)", "sp.zeros(2, 2)", "sp.diag(m, m - m)", "sp.diag(0, q[0] + 2)"])
def test_a_mass_that_is_0_is_named(folder, M):
    mistaken(folder, "bead", "mass-matrix-singular", H=f"M={M}, U=q[1]")


@pytest.mark.parametrize(
    "M", ["sp.diag(1, m - 2)", "sp.diag(q[0], 1)", "sp.Matrix([[1, 1], [1, 1]])", "sp.diag(1, -m)", "sp.diag(1, 1 / q[0])"]
)
def test_a_mass_matrix_that_is_none_at_the_start_is_named_before_anything_of_h(folder, M):
    mistaken(folder, "bead", "problem-check-failed", "the mass matrix M", H=f"M={M}, U=q[1]")


NAMED = {"loggamma": "lgamma", "digamma": "polygamma"}
UNKNOWN = ["loggamma", "gamma", "erf", "erfc", "factorial", "zeta", "digamma", "airyai", "LambertW", "elliptic_k", "fresnels", "Si"]


@pytest.mark.parametrize(("function", "kind"), [*zip(UNKNOWN, cycle(KINDS), strict=False)], ids=UNKNOWN)
def test_a_function_that_the_kernels_do_not_have_is_named(folder, kind, function):
    part, text = SCALARS[kind]
    expression = f"sp.{function}({OPENED[kind]} / 3 + sp.Rational(1, 2))"
    more = {"bead": "m * q[1] + (p[0] ** 2 + p[1] ** 2) / 2", "species": "u - sp.log(u) + v - a * sp.log(v)", "links": "x[1]"}[kind]
    (folder / "mine.py").write_text(written(kind, **{part: text.format(f"{more} + {expression}")}))
    with refused("problem-check-failed", says=["H", NAMED.get(function, function)]):
        run("./mine.py", method="midpoint" if kind == "species" else "rattle", h=0.01, steps=1, anyway=True)


def test_an_expression_that_divides_by_0_is_named():
    x = sp.Symbol("x", real=True)
    for bad in (1 / (x - x), sp.nan + x, sp.oo * x, sp.I * x):
        with refused("nowhere-finite-real", InvalidProblem, ["f"]):
            expressions("f", {"q": [x]}, [bad], (), [])


DEPTHS = {"sin": "sp.sin(z, evaluate=False)", "sum": "sp.cos(z, evaluate=False) + 1", "shared": "sp.sin(z, evaluate=False) + z / 2"}


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("depth", DEPTHS)
def test_an_expression_that_is_nested_too_deep_is_refused(folder, kind, depth):
    part, text = SCALARS[kind]
    lines = f"z = {OPENED[kind]}\n    for _ in range({45 if depth == 'shared' else 2 * DEEPEST}): z = {DEPTHS[depth]}"
    code = "expression-too-long" if depth == "shared" else "expression-too-deep"
    mistaken(folder, kind, code, part, lines=lines, **{part: text.format("z")})


def test_the_extent_of_an_expression_is_that_written_out_however_much_is_shared():
    x = sp.Symbol("x")
    z = x
    for k in range(1, 60):
        z = sp.sin(z, evaluate=False) + sp.cos(z, evaluate=False)
        assert extent(z) == (2 ** (k + 2) - 3 - 0, 2 * k + 1)
    assert extent(z)[0] > LARGEST


@pytest.mark.parametrize("sign", ["-", "~", "not "])
def test_a_file_that_python_cannot_read_is_named(folder, sign):
    mistaken(folder, "bead", "problem-file-too-deep", H=f"M=sp.eye(2), U={sign * 100000}q[1]")

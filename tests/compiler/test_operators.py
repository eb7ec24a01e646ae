"""Operators in scheme files: which operations of the algebra they stand for, and what is refused."""

import ast
import subprocess
import sys
import textwrap
from pathlib import Path

import pytest
from planted import plant

from daebench.compiler.declared import Declarations
from daebench.compiler.operators import Lowering
from daebench.compiler.syntax import SourceFile
from daebench.errors import InvalidProblem
from daebench.methods.fixed_step.constrained import FixedStep
from daebench.runs.request import Request

ROOT = Path(__file__).parents[2]
ARGUMENTS = (
    "p: Vector, q: Vector, lam: Multiplier, nu: Multiplier, G0: Jacobian, V: Rows, S: Matrix, L: InverseMass, A: Gram, "
    "u: Half, U: HalfMatrix, h: Number, K: tuple[Vector, ...], x: Any, k: int"
)
NAMES = "G, H_p, H_q, STAGES, CONSTRAINTS, dot, multiplier, norm, solve, zero"


def read(module):
    """Return a file of the package as syntax."""
    path = ROOT.joinpath(*module.split(".")).with_suffix(".py")
    return SourceFile(module, path.read_text(encoding="utf-8"), {})


def lowered(*lines):
    """Return the lines of a function whose last is returned, without its operators."""
    *before, last = lines
    body = "\n".join([*before, f"return {last}"])
    text = f"from daebench.schemes.kernels.language import {NAMES}\nfrom daebench.schemes.kernels.spaces import DATA, I\n\n\n"
    text += f"def trial({ARGUMENTS}):\n{textwrap.indent(body, '    ')}\n"
    file = SourceFile("daebench.schemes.trial", text, {})
    found = Lowering("trial.py", Declarations(file, read)).function(file.functions["trial"])
    return [ast.unparse(statement) for statement in found.body]


def returned(expression):
    """Return an expression without its operators."""
    return lowered(expression)[0].removeprefix("return ")


WRITTEN = {
    "p + q": "axpy(1.0, q, p)",
    "p - q": "axpy(-1.0, q, p)",
    "-p": "scale(-1.0, p)",
    "p - h * q": "axpy(-h, q, p)",
    "h * p + q": "axpy(h, p, q)",
    "h * p - 2 * q": "axpy(-2.0, q, scale(h, p))",
    "h * (p + q)": "scale(h, axpy(1.0, q, p))",
    "p - h / 2 * (H_q(p, q) + G0.T @ lam)": "axpy(-0.5 * h, axpy(1.0, mul_T(G0, lam), H_q(p, q)), p)",
    "-h / 2 * p": "scale(-0.5 * h, p)",
    "2 / h**2 * nu": "scale_m(2.0 / (h * h), nu)",
    "q - h**2 * p": "axpy(-h * h, p, q)",
    "p / h": "scale(1.0 / h, p)",
    "lam - nu": "axpy_m(-1.0, nu, lam)",
    "u - h * u": "axpy_m(-h, u, u)",
    "G0 @ p": "mul(G0, p)",
    "V @ p": "mul_full(V, p)",
    "V.T @ lam": "mul_full_T(V, lam)",
    "G0 @ V.T": "gram(G0, V)",
    "V @ G0.T": "gram_full(V, G0)",
    "h * V @ V.T + G0 @ V.T": "plus_mm(scale_mm(h, gram_full(V, V)), gram(G0, V))",
    "G0 @ L": "jacobian_times(G0, L)",
    "G0 @ S": "apply_md(transpose(S), G0)",
    "G0 @ S.T": "apply_md(S, G0)",
    "G0 @ (S @ V.T)": "gram(G0, apply_md(S, V))",
    "S.T @ p": "apply(transpose(S), p)",
    "I - h * S.T": "identity_plus(-h, transpose(S))",
    "I + S @ L": "identity_plus(1.0, product(S, L))",
    "I - h * U": "identity_minus(h, U)",
    "G0.T @ G0 + S": "axpy_dd(1.0, S, product_T(G0, G0))",
    "2 * V - G0 @ S": "minus_md(scale_md(2.0, V), apply_md(transpose(S), G0))",
    "G0 + lam @ p.T": "outer_md(lam, p, G0)",
    "solve(A, lam)[0]": "solve(A, lam)[0]",
    "solve(S, p, h * G0)[1]": "solve_dm(S, p, scale_md(h, G0))[1]",
    "norm(p) + norm(lam)": "norm(p) + norm_m(lam)",
    "zero(q)": "zero_m(q)",
    "tuple(q + h * DATA[0][i] * K[i] for i in range(STAGES))": "tuple((axpy(h * DATA[0][i], K[i], q) for i in range(STAGES)))",
    "multiplier(nu[j] + (h if j == k else 0) for j in range(CONSTRAINTS))": (
        "tuple((nu[j] + (h if j == k else 0.0) for j in range(CONSTRAINTS)))"
    ),
    "(*K, p)[k + 1]": "(*K, p)[k + 1]",
}


@pytest.mark.parametrize("expression", WRITTEN)
def test_an_expression_becomes_the_operations_that_one_would_write(expression):
    assert returned(expression) == WRITTEN[expression]


def test_a_sum_over_stages_is_a_loop_whose_kind_is_known():
    lines = lowered("total = h * K[0]", "for j in range(1, STAGES):\n    total += h * K[j]", "total - q")
    assert lines[0] == "total = scale(h, K[0])"
    assert "total = axpy(h, K[j], total)" in lines[1]
    assert lines[2] == "return axpy(-1.0, q, total)"


REFUSED = {
    "q + nu": "a Vector and a Multiplier have different shapes",
    "G0 @ nu": "there is no product of Jacobian and Multiplier",
    "G0.T @ q": "there is no product of Jacobian.T and Vector",
    "p * q": "have no such operation",
    "h + q": "have different shapes",
    "h * x": "x is a value of unknown kind, which no operator takes; annotate it",
    "x + p": "annotate it",
    "x * x": "annotate it",
    "-x": "annotate it",
    "h * K": "K is a tuple, which no operator takes",
    "h * (p, q)": "is a tuple",
    "K * 2": "is a tuple",
    "k * h": "k is an integer, not a number of the run's type",
    "k * p": "k is an integer, not a number of the run's type",
    "sum(K[i] for i in range(STAGES))": "sum adds numbers, but a term is a Vector",
    "p if h > 0 else nu": "it is a Vector or a Multiplier",
    "H_p(nu, q)": "nu is a Multiplier, but H_p takes a Vector there",
    "norm(x)": "there is no norm of a value of unknown kind",
    "solve(A, p)": "there is no solve of a Gram, a Vector",
    "p.T": "may only appear in a product",
    "A.T": "a Gram has no transpose",
    "V + V": "have no such sum",
    "p ** 2": "have no such operation",
    "I + A": "the identity and a Gram have different shapes",
    "[p]": "expressions of this form are not supported in a scheme",
}


@pytest.mark.parametrize("expression", REFUSED)
def test_a_shape_that_does_not_fit_is_refused_with_file_line_and_expression(expression):
    with pytest.raises(InvalidProblem) as refusal:
        lowered("y = p + q", expression)
    said = str(refusal.value)
    assert said.startswith("trial.py, line 7: ")
    assert REFUSED[expression] in said
    assert ast.unparse(ast.parse(expression)) in said


def test_what_changes_its_kind_in_a_loop_or_in_a_branch_is_no_operand():
    with pytest.raises(InvalidProblem, match="unknown kind"):
        lowered("y = p", "for j in range(STAGES):\n    z = h * y\n    y = lam", "y")
    with pytest.raises(InvalidProblem, match="unknown kind"):
        lowered("y = p", "if h > 0.0:\n    y = lam", "h * y")


def test_a_variable_with_the_name_of_an_operation_is_refused():
    with pytest.raises(InvalidProblem, match="axpy is the name of an operation"):
        lowered("axpy = h", "p + q")


def test_a_function_returns_what_its_annotation_says(get_ivp, monkeypatch, tmp_path):
    plant(monkeypatch, tmp_path, "schemes.rattle", "return dp - n, dq, (2 / h**2 * nu", "return dp - n, nu, (2 / h**2 * nu")
    with pytest.raises(InvalidProblem, match=r"daebench/schemes/rattle\.py, line \d+: .*its annotation says"):
        FixedStep("rattle", compiled=False).solve(get_ivp("spherical-fast"), Request(value=0.01, steps=1))


def test_a_mistake_in_a_scheme_is_one_sentence_when_it_is_run(get_ivp, monkeypatch, tmp_path):
    plant(monkeypatch, tmp_path, "schemes.rattle", "q1 = q0 + dq", "q1 = q0 + nu")
    with pytest.raises(InvalidProblem) as refusal:
        FixedStep("rattle", compiled=False).solve(get_ivp("spherical-fast"), Request(value=0.01, steps=1))
    assert "schemes/rattle.py, line " in str(refusal.value)
    assert str(refusal.value).endswith("q0 + nu: a Vector and a Multiplier have different shapes.")


WRONG = """
from daebench.schemes.kernels.language import G, H_q
from daebench.schemes.kernels.spaces import Multiplier, Number, Vector


def right(p0: Vector, q0: Vector, lam: Multiplier, h: Number) -> Vector:
    return p0 - h / 2 * (H_q(p0, q0) + G(q0).T @ lam)


def wrong_sum(q0: Vector, nu: Multiplier) -> Vector:
    return q0 + nu


def wrong_product(q0: Vector, nu: Multiplier) -> Multiplier:
    return G(q0) @ nu


def wrong_transpose(q0: Vector) -> Vector:
    return G(q0).T @ q0
"""


@pytest.mark.slow
def test_the_type_checker_refuses_the_same_mistakes(tmp_path):
    pytest.importorskip("mypy")
    (tmp_path / "trial.py").write_text(WRONG)
    command = [sys.executable, "-m", "mypy", "--strict", "--config-file=", "--follow-imports=silent", str(tmp_path / "trial.py")]
    told = subprocess.run(command, capture_output=True, text=True, cwd=ROOT, check=False)
    lines = [line.partition(":")[2].partition(":")[0] for line in told.stdout.splitlines() if " error: " in line]
    assert [WRONG.splitlines()[int(line) - 1].strip() for line in dict.fromkeys(lines)] == [
        "return q0 + nu",
        "return G(q0) @ nu",
        "return G(q0).T @ q0",
    ]


def test_no_scheme_is_written_with_functions_for_operators():
    schemes = scheme_files()
    calls = {node.func.id for path in schemes for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))) if named(node)}
    assert not calls & {"axpy", "axpy_m", "axpy_dd", "scale", "scale_m", "mul", "mul_T", "gram", "apply", "identity_plus", "norm_m"}


def scheme_files():
    """Return the files of schemes; the language that they are written in is beside them."""
    files = [
        path for path in sorted((ROOT / "daebench" / "schemes").rglob("*.py")) if path.name != "__init__.py" and "kernels" not in path.parts
    ]
    assert len(files) > 25
    return files


def named(node):
    """Whether a node is the call of a function by name."""
    return isinstance(node, ast.Call) and isinstance(node.func, ast.Name)


def test_few_lines_of_scheme_files_are_imports():
    texts = [path.read_text(encoding="utf-8") for path in scheme_files()]
    imports = [node for text in texts for node in ast.walk(ast.parse(text)) if isinstance(node, ast.Import | ast.ImportFrom)]
    assert not any(alias.name == "*" for node in imports for alias in node.names)
    assert sum(node.end_lineno - node.lineno + 1 for node in imports) < 0.12 * sum(len(text.splitlines()) for text in texts)

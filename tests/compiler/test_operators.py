"""Operators in scheme files: which operations of the algebra they stand for, and what is refused."""

import textwrap
from pathlib import Path

import pytest
from planted import plant

from daebench.compiler import files, values
from daebench.compiler.files import Files
from daebench.errors import InvalidProblem
from daebench.methods.fixed_step.constrained import FixedStep
from daebench.runs.request import Request

ROOT = Path(__file__).parents[2]
ARGUMENTS = (
    "p: Vector, q: Vector, lam: Multiplier, nu: Multiplier, G0: Jacobian, V: Rows, S: Matrix, L: InverseMass, A: Gram, "
    "u: Half, U: HalfMatrix, h: Number, K: tuple[Vector, ...], x: Any"
)
SPACES = "DATA, I, Gram, Half, HalfMatrix, InverseMass, Jacobian, Matrix, Multiplier, Number, Rows, Vector"
NAMES = "G, H_p, H_q, STAGES, CONSTRAINTS, dot, multiplier, norm, solve, zero"
MODULE = "daebench.schemes.trial"


def written(pattern):
    """Return an operator that writes itself, and leaves what it is applied to to elements."""
    return lambda self, other: NotImplemented if isinstance(other, values.Element) else Text(pattern.format(self.text, other))


class Text:
    """A number of which only the text is known."""

    of_any_form = True
    __mul__, __rmul__, __add__ = written("{} * {}"), written("{1} * {0}"), written("{} + {}")
    __truediv__, __rtruediv__, __pow__ = written("{} / {}"), written("{1} / {0}"), written("{}**{}")

    def __init__(self, text):
        self.text = text

    def __repr__(self):
        return self.text

    def __neg__(self):
        return Text(f"-{self.text}")

    def __getitem__(self, index):
        return Text(f"{self.text}[{index}]")


class Written(Files):
    """Writes what is done with values."""

    names = {}  # noqa: RUF012
    space = {}  # noqa: RUF012

    def __init__(self):
        super().__init__(PLAN, self)
        self._run.par = ((), Text("DATA"))

    def operation(self, name):
        return lambda *args: Text(f"{name}({', '.join(map(repr, args))})")

    def body(self, function):
        return function.plain


PLAN = {
    "constants": {"STAGES": 2, "CONSTRAINTS": 2},
    "homes": {},
    "states": "constrained",
    "bare": ("dot", "H_p", "H_q", "G", "norm"),
    "after": 0,
    "work": {},
    "single": False,
}


def trial(monkeypatch, text):
    """Return the function ``trial`` of a file that imports what it may need."""
    head = f"from typing import Any\nfrom daebench.schemes.kernels.language import {NAMES}\n"
    head += f"from daebench.schemes.kernels.spaces import {SPACES}\n\n"
    monkeypatch.setattr(files, "text_of", lambda module: head + text)
    return Written().function(MODULE, "trial")


def result(monkeypatch, *lines):
    """Return what a function returns for values of all kinds, its last line being the result."""
    *before, last = lines
    body = "".join(f"    {line}\n" for line in [*before, f"return {last}"])
    function = trial(monkeypatch, f"\ndef trial({ARGUMENTS}):\n{body}")
    kinds = function._kinds[0]
    names = [argument.arg for argument in function.node.args.args]
    known = {
        "h": Text("h"),
        "x": lambda: None,
        "K": tuple(values.Element(function.files.algebra, "Vector", Text(f"K[{i}]")) for i in (0, 1)),
    }
    args = [known.get(name, values.Element(function.files.algebra, str(kind), Text(name))) for name, kind in zip(names, kinds, strict=True)]
    return values.held(function(*args))


WRITTEN = {
    "p + q": "axpy(1.0, q, p)",
    "p - q": "axpy(-1.0, q, p)",
    "-p": "scale(-1.0, p)",
    "p - h * q": "axpy(-h, q, p)",
    "h * p + q": "axpy(h, p, q)",
    "h * p - 2 * q": "axpy(-2.0, q, scale(h, p))",
    "h * (p + q)": "scale(h, axpy(1.0, q, p))",
    "p - h / 2 * (H_q(p, q) + G0.T @ lam)": "axpy(-h / 2, axpy(1.0, mul_T(G0, lam), H_q(p, q)), p)",
    "-h / 2 * p": "scale(-h / 2, p)",
    "2 / h**2 * nu": "scale_m(2 / h**2, nu)",
    "q - h**2 * p": "axpy(-h**2, p, q)",
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
    "I - h * U": "identity_minus(--h, U)",
    "G0.T @ G0 + S": "axpy_dd(1.0, S, product_T(G0, G0))",
    "2 * V - G0 @ S": "minus_md(scale_md(2.0, V), apply_md(transpose(S), G0))",
    "G0 + lam @ p.T": "outer_md(lam, p, G0)",
    "solve(A, lam)[0]": "solve(A, lam)[0]",
    "solve(S, p, h * G0)[1]": "solve_dm(S, p, scale_md(h, G0))[1]",
    "norm(p) + norm(lam)": "norm(p) + norm_m(lam)",
    "zero(q)": "zero_m(q)",
    "tuple(q + h * DATA[0][i] * K[i] for i in range(STAGES))": "(axpy(h * DATA[0][0], K[0], q), axpy(h * DATA[0][1], K[1], q))",
    "multiplier(nu[j] + (h if j == 1 else 0) for j in range(CONSTRAINTS))": "(nu[0] + 0, nu[1] + h)",
    "(*K, p)[1 + 1]": "p",
    "total = h * K[0]; for j in range(1, STAGES): total += h * K[j]; total - q": "axpy(-1.0, q, axpy(h, K[1], scale(h, K[0])))",
    "y = h * p; h * y": "scale(h, scale(h, p))",
    "h * (h * p)": "scale(h * h, p)",
}


def test_an_expression_becomes_the_operations_that_one_would_write(monkeypatch):
    for lines, written in WRITTEN.items():
        assert repr(result(monkeypatch, *lines.split("; "))) == written


REFUSED = {
    "q + nu": "a Vector and a Multiplier",
    "G0 @ nu": "Jacobian and Multiplier",
    "G0.T @ q": "Jacobian.T and Vector",
    "p * q": "a Vector stands",
    "h + q": "different shapes",
    "x + p": "a function and a Vector",
    "p * K": "a tuple stands",
    "p + K": "a Vector and a tuple",
    "G0 @ h": "Jacobian and a number",
    "sum(K[i] for i in range(STAGES))": "a term is a Vector",
    "p if p else nu": "neither true nor false",
    "H_p(nu, q)": "argument 1 is a Multiplier",
    "norm(x)": "norm of a function",
    "solve(A, p)": "a Gram, a Vector",
    "p.T": "in a product",
    "A.T": "no transpose",
    "V + V": "no such sum",
    "p ** 2": "no such operation",
    "I + A": "the identity and a Gram",
}


def test_a_shape_that_does_not_fit_is_refused_with_file_line_and_expression(monkeypatch):
    for expression, words in REFUSED.items():
        with pytest.raises(InvalidProblem) as refusal:
            result(monkeypatch, "y = p + q", expression)
        said = str(refusal.value)
        assert said.startswith("daebench/schemes/trial.py, line 8: ")
        assert words in said
        assert expression in said


def test_a_function_vouches_for_the_zeros_of_what_it_returns(monkeypatch):
    function = trial(monkeypatch, "\ndef trial(S: Matrix) -> InverseMass:\n    return S\n")
    assert function(values.Element(function.files.algebra, "Matrix", Text("S"))).kind == "InverseMass"


def test_a_function_does_not_take_a_dense_matrix_for_one_with_zeros(monkeypatch):
    function = trial(monkeypatch, "\ndef inner(X: Jacobian) -> Rows:\n    return X\n\n\ndef trial(V: Rows) -> Rows:\n    return inner(V)\n")
    with pytest.raises(InvalidProblem, match=r"line 11: inner\(V\): argument 1 is a Rows, but inner takes a Jacobian there"):
        function(values.Element(function.files.algebra, "Rows", Text("V")))


BAD = {
    "a changed global": ("global counted\ncounted = 1", "global counted: a scheme changes no global name."),
    "an unbounded loop": ("while h > 0.0:\n    h = h - 1.0", "while h > 0.0: a loop needs a bound, as for k in range(n) has."),
    "work in a branch": ("if h > 0.0:\n    wrong = H_q(p0, q0)", "H_q(p0, q0): in a branch or a loop its work cannot be counted"),
    "a function without a name": ("newton(lambda x, data: x, p0, q0)", "lambda x, data: x: a function is passed by its name."),
    "a generator": ("wrong = sum(k for k in (1, 2))", "(k for k in (1, 2)): a generator may be over stages or constraints alone."),
    "an error of type": ("wrong = h * (p0, q0)", "only known at run time"),
}


@pytest.mark.parametrize("what", BAD)
def test_what_a_scheme_may_not_do_is_one_sentence_with_file_and_line(what, get_ivp, monkeypatch, tmp_path):
    lines, said = BAD[what]
    right = "        G0 = G(q0)\n        kick"
    plant(monkeypatch, tmp_path, "schemes.rattle", right, f"{textwrap.indent(lines, ' ' * 8)}\n{right}")
    with pytest.raises(InvalidProblem) as refusal:
        FixedStep("rattle", compiled=False).solve(get_ivp("spherical-fast"), Request(value=0.01, steps=1))
    told = str(refusal.value)
    assert f"daebench/schemes/rattle.py, line {25 if what == 'work in a branch' else 24}" in told
    assert "\n" not in told
    assert said in told


def test_a_function_returns_what_its_annotation_says(get_ivp, monkeypatch, tmp_path):
    plant(monkeypatch, tmp_path, "schemes.rattle", "return dp - n, dq, (2 / h**2 * nu", "return dp - n, nu, (2 / h**2 * nu")
    with pytest.raises(InvalidProblem, match=r"daebench/schemes/rattle\.py, line \d+: increment does not return what its annotation says"):
        FixedStep("rattle", compiled=False).solve(get_ivp("spherical-fast"), Request(value=0.01, steps=1))

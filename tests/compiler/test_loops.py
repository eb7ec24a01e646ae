"""Functions of problems with many unknowns: sums of terms of one form as loops, and kernels on arrays, against what is written out."""

from types import SimpleNamespace

import numpy as np
import pytest
import sympy as sp
import uncompiled

from daebench.compiler.equal_terms import added
from daebench.compiler.expressions import jacobian
from daebench.compiler.facts import WRITTEN_OUT, in_loops
from daebench.compiler.link import Linker, Options
from daebench.methods.fixed_step.constrained import FixedStep
from daebench.methods.formulations import residuals
from daebench.methods.initial_value_problem import initial_value_problem
from daebench.runs.scales import constrained_scales

X, Y = sp.symbols("x1:13", real=True), sp.symbols("y1:13", real=True)
STIFFNESS = sp.Symbol("stiffness", positive=True)


def springs():
    """Return a sum over pairs with terms of two forms, and some of no other's form."""
    pairs = [(i, j) for i in range(12) for j in range(i)]
    bent = sum(sp.exp(X[i] * Y[j]) for i, j in pairs if (i + j) % 3 == 0)
    return STIFFNESS * sp.cos(X[0] * X[5]) + sp.Add(*(STIFFNESS * (X[i] - X[j]) ** 4 / 4 for i, j in pairs)) + bent + sp.sin(Y[3]) + 7


def run(text, name, *arguments):
    """Return what a generated function returns."""
    return getattr(uncompiled.run(text, name), name)(*arguments)


def test_derivatives_of_long_sums_are_those_of_each_term():
    values = [springs(), springs().diff(X[2]), sp.Integer(3)]
    assert jacobian(values, [*X, *Y]) == sp.Matrix(values).jacobian(sp.Matrix([*X, *Y]))


def test_sums_in_loops_are_those_written_out(random):
    x, y = random.normal(size=(2, 12)) / 3
    gradient = jacobian([springs()], [*X, *Y])
    text = added("slope", {"x": X, "y": Y}, {(k,): value for k, value in enumerate(gradient)}, [STIFFNESS])
    scope = {"numpy": np, "x": x, "y": y, "par": (1.7,), "out": np.zeros(24), "exp": np.exp, "sin": np.sin, "cos": np.cos}
    exec("\n".join([*(f"{name} = {table}" for name, table in text.tables.items()), *text.lines]), scope)
    expected = sp.lambdify([*X, *Y, STIFFNESS], list(gradient))(*x, *y, 1.7)
    assert scope["out"] == pytest.approx(expected, rel=1e-13, abs=1e-13)
    assert len(text.lines) < 60
    assert sum(line.startswith("for row in range(65)") for line in text.lines) == 1  # the last pair has another term besides


@pytest.mark.parametrize(
    ("problem", "scheme"),
    [
        ("fekete", "rattle_ilves"),
        ("fekete", "gauss2"),
        ("double_spherical_pendulum", "lobatto3"),
        ("four_bar", "radau2_ggl"),
        ("four_bar", "rattle"),
    ],
)
def test_a_step_on_arrays_is_the_step_on_tuples(problem, scheme):
    ivp, method = initial_value_problem(problem), FixedStep(scheme)
    par = (*ivp.par, constrained_scales(ivp, 0.01, rated=True), *method.data)
    ends = []
    for loops, held in ((False, tuple), (True, np.array)):
        options = Options(compiled=False, stages=method.member.stages, loops=loops)
        linker = Linker(ivp.source.derivation, options, method.scheme_module)
        text = linker.module("A step.", [("daebench.schemes.kernels.constrained", "one_step")])
        x, _, _, report = run(text, "one_step", (held(ivp.p0), held(ivp.q0)), (), 0.01, par)
        assert report[0] == 0
        ends.append(np.concatenate(x))
    assert ends[1] == pytest.approx(ends[0], rel=1e-13, abs=1e-14)


def test_rows_and_their_jacobian_in_loops_are_those_written_out(random):
    rows, scale = jacobian([springs()], X).T, sp.Dummy("scale")
    outputs, found = {"res": rows, "JJ": jacobian(rows, X) + scale * sp.eye(12)}, []
    inputs, numbers = {"x": X, "y": Y, "scale": [scale]}, random.normal(size=(2, 12)) / 3
    for tables in (None, {}):
        text = residuals.writer("rows", inputs, outputs, [STIFFNESS], tables)
        lines = [f"{name} = {table}" for name, table in (tables or {}).items()]
        res, JJ = np.full(12, np.nan), np.full((12, 12), np.nan)
        run("\n".join([*lines, text]), "rows", *numbers, (3.0,), res, JJ, (1.7,))
        found.append(np.column_stack([res, JJ]))
    assert "for row in range" in text
    assert found[1] == pytest.approx(found[0], rel=1e-12, abs=1e-13)


def test_problems_with_many_positions_are_held_as_arrays_in_plain_numbers_only():
    many = SimpleNamespace(KIND="constrained", D=WRITTEN_OUT + 1)
    assert in_loops(many, "complex128")
    assert not in_loops(many, "dual4")
    assert not in_loops(SimpleNamespace(KIND="constrained", D=WRITTEN_OUT))
    assert not in_loops(SimpleNamespace(KIND="constrained", D=WRITTEN_OUT + 1, NODES=9))
    assert not in_loops(SimpleNamespace(KIND="poisson", D=WRITTEN_OUT + 1))

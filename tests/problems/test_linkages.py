"""The linkages that are made of joints: their loops close at all angles of their charts, and a suspension keeps its energy and lengths."""

import numpy as np
import pytest
import sympy as sp
from measures import error_of

from daebench.methods.initial_value_problem import initial_value_problem
from daebench.methods.solvers.scipy_ode import ScipyOde
from daebench.problems import double_wishbone, rssr_four_bar, watt_six_bar
from daebench.runs.request import Request

ROUND = np.linspace(-3.2, 3.2, 65)


@pytest.fixture(
    scope="module", params=[pytest.param(watt_six_bar, marks=pytest.mark.exhaustive, id="watt"), pytest.param(rssr_four_bar, id="rssr")]
)
def linkage(request):
    """Return a linkage, and functions of its chart and back."""
    problem = request.param.problem()
    chart, values = problem.chart, dict(problem.parameters)
    out, back = (
        sp.lambdify(
            [list(arguments)], [sp.sympify(x).xreplace({k: sp.Float(v) for k, v in values.items()}) for x in results], "numpy", cse=True
        )
        for arguments, results in (
            ((*chart.eta, *chart.xi), (*chart.p, *chart.q)),
            ((*problem.p, *problem.q), (*chart.inverse_eta, *chart.inverse_xi)),
        )
    )
    return problem, lambda *x: np.array(out(x), dtype=float), back


def test_its_loops_close_and_it_turns_without_tearing_them_at_all_angles(linkage):
    problem, out, _ = linkage
    g = sp.Matrix(problem.g)
    call = sp.lambdify([list(problem.q)], [g, g.jacobian(problem.q), problem.M.subs(problem.parameters)], "numpy")
    for angle in ROUND:
        p, q = np.split(out(2.0, angle), 2)
        off, G, M = (np.array(x, dtype=float) for x in call(q))
        assert np.abs(off).max() < 1e-13
        v = np.linalg.solve(M, p)
        assert np.abs(G @ v).max() < 1e-12 * max(1.0, np.abs(v).max())
        after, before = (np.split(out(2.0, angle + h), 2)[1] for h in (1e-5, -1e-5))
        assert error_of((after - before) / 1e-5, v) < 1e-6 * max(1.0, np.abs(v).max())


def test_its_chart_is_undone(linkage):
    _, out, back = linkage
    for angle in (-3.0, -1.3, 0.2, 2.4):
        assert error_of(np.array(back(out(-1.7, angle)), dtype=float), [-1.7, angle]) < 1e-12


def test_it_starts_in_its_chart_at_its_reference_position(linkage):
    problem, out, back = linkage
    for case in problem.cases.values():
        values = [float(sp.sympify(x).subs(problem.parameters)) for x in (*case.p, *case.q)]
        assert error_of(out(*back(values)), values) < 1e-13


def test_a_double_wishbone_swings_in_its_spring_and_keeps_its_lengths_and_energy(plain_functions):
    where = initial_value_problem("double_wishbone", "released")
    found = ScipyOde("DOP853").solve(where, Request(value=1e-10, t_end=0.1, points=5)).complete()
    problem = double_wishbone.problem()
    assert problem.d - problem.m == 1
    places = {
        name: [np.array(sp.lambdify([list(problem.q)], x, "numpy")(q), dtype=float) for q in found.q]
        for name, x in problem.picture.points.items()
    }
    for a, b in ("AE", "BE", "CF", "DF", "ST", "EF", "ET", "FT", "WE", "WF", "WT"):
        lengths = np.array([np.linalg.norm(x - y) for x, y in zip(places[a], places[b], strict=True)])
        assert np.ptp(lengths) < 1e-9
    energies = where.along("H", found.p, found.q)
    assert np.ptp(energies) < 1e-7
    heights = np.array(places["W"])[:, 2]
    assert heights.min() < heights[0] - 5e-3
    assert heights.max() == heights[0]

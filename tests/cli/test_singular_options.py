"""Every command that runs methods and can meet a loss of rank takes --on-singular, and its function of Python too."""

import dataclasses

import definitions
import pytest

import daebench as package
from daebench.errors import BadInput

ASKED = {
    "order": ("order", {"methods": ["rattle"]}, ("--methods", "rattle")),
    "check": ("check", {"method": "rattle"}, ("--method", "rattle")),
    "step-for": (
        "step_for",
        {"method": "rattle", "h": 0.1, "t_end": 1, "statistic": "H", "margin": 0.1},
        ("--method", "rattle", "--h", 0.1, "--t-end", 1, "--statistic", "H", "--margin", 0.1),
    ),
    "tolerance-for": ("tolerance_for", {"drift": 0.1, "h": 0.1, "t_end": 1}, ("--drift", 0.1, "--h", 0.1, "--t-end", 1)),
    "run": ("run", {"method": "rattle", "h": 0.1, "t_end": 1}, ("--method", "rattle", "--h", 0.1, "--t-end", 1)),
    "compare": ("compare", {"methods": ["rattle"], "h": 0.1, "t_end": 1}, ("--methods", "rattle", "--h", 0.1, "--t-end", 1)),
}
"""The function of each command, and what both are asked."""


@pytest.mark.parametrize("command", ASKED)
def test_a_command_and_its_function_know_the_option(command, daebench):
    function, asked, words = ASKED[command]
    with pytest.raises(BadInput, match="unknown on_singular 'never'; known: continue, least-squares, stop"):
        getattr(package, function)("planar_pendulum", **asked, on_singular="never")
    status, out, err = daebench(command, "planar_pendulum", *words, "--on-singular", "never")
    assert (status, out) == (2, "")
    assert "unknown on_singular 'never'" in err


def test_redundant_constraints_are_measured_by_least_squares_where_the_case_does_not_say_so(plain_functions):
    problem = definitions.parallelogram()
    cases = {name: dataclasses.replace(case, on_singular="stop") for name, case in problem.cases.items()}
    stopping = dataclasses.replace(problem, cases=cases)
    order = package.order(stopping, methods=["rattle"], halvings=4, on_singular="least-squares")
    assert order.loc[order["component"] == "q", "order"].iloc[0] == pytest.approx(2, abs=0.1)

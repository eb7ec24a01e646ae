"""Functions of a problem with a full mass matrix M(q): derivatives of each other by differences, and the same as of H in symbols."""

import numpy as np
import pytest
from ivps import ivp
from measures import differences, error_of

PAIRS = {
    "H_p": ("H", "p"),
    "H_q": ("H", "q"),
    "H_pp": ("H_p", "p"),
    "H_qp": ("H_q", "p"),
    "H_pq": ("H_p", "q"),
    "H_qq": ("H_q", "q"),
    "Gv_p": ("Gv", "p"),
    "Gv_q": ("Gv", "q"),
}
"""Functions, with the function and the vector that they are the derivative by."""


def value(place, name, p, q):
    return np.asarray(ivp(place).value(name, *((p, q) if name not in ("g", "G") else (q,))), dtype=float)


def states(random):
    return random.uniform(-1, 1, (3, 2, 2))


@pytest.mark.parametrize("name", PAIRS)
def test_a_derivative_is_that_of_differences(name, random):
    function, by = PAIRS[name]
    for p, q in states(random):
        found = differences(lambda x: value("stretched-M", function, *((x, q) if by == "p" else (p, x))), p if by == "p" else q)  # noqa: B023
        assert error_of(value("stretched-M", name, p, q), found) < 1e-8


@pytest.mark.parametrize("name", ["H", "H_p", "H_q", "H_pp", "H_qp", "H_qq", "Gv", "Gv_p", "Gv_q", "lam"])
def test_solving_with_the_masses_gives_what_the_hamiltonian_in_symbols_gives(name, random):
    for p, q in states(random):
        by_solving, in_symbols = (value(f"stretched-{kind}", name, p, q) for kind in "MH")
        assert error_of(by_solving, in_symbols) < 1e-11 * (1 + np.abs(in_symbols).max())

"""A Poisson system is one, or it is refused with the identity that fails and where."""

from dataclasses import replace

import pytest
import sympy as sp
from refusals import refused, unsaid

from daebench.errors import InvalidProblem
from daebench.problems.free_rigid_body import problem as rigid_body
from daebench.problems.lotka_volterra import problem as lotka_volterra
from daebench.systems.poisson import DarbouxMap, Part, PoissonSystem
from daebench.systems.vanishing import expands_to_zero, first_nonzero

x, y, z, w = sp.symbols("x y z w", real=True)
so3 = sp.Matrix([[0, -z, y], [z, 0, -x], [-y, x, 0]])
square = x**2 + y**2 + z**2


def body(**changes):
    return PoissonSystem(**({"y": (x, y, z), "B": so3, "H": x**2 + 2 * y**2 + 3 * z**2, "casimirs": {"C": square}} | changes))


def refusal(build, code, **changes):
    """Return where an identity fails, and the value that is not 0, as texts."""
    with refused(code, InvalidProblem) as caught:
        build(**changes)
    assert unsaid([str(value) for value in caught.value.fields.values()], caught.value) == []
    return caught.value.fields.get("where"), caught.value.fields.get("what")


def altered(system, code, **changes):
    return refusal(lambda **new: replace(system, **new), code, **changes)


def test_a_wrong_sign_in_B_is_named_by_its_pair():
    wrong = so3.copy()
    wrong[2, 1] = -x
    assert refusal(body, "not-skew-symmetric", B=wrong) == ("(y, z)", "-2*x")


def test_an_entry_on_the_diagonal_of_B_is_refused():
    assert refusal(body, "not-skew-symmetric", B=so3 + sp.diag(0, 0, x))[0] == "(z, z)"


def test_a_failing_jacobi_identity_names_the_triple():
    # {x, {y, w}} + {y, {w, x}} + {w, {x, y}} has {x, x z} = x {x, z} in it, which is x.
    upper = sp.Matrix([[0, 1, 1, 0], [0, 0, 0, x * z], [0, 0, 0, 0], [0, 0, 0, 0]])
    assert refusal(PoissonSystem, "jacobi-identity-fails", y=(x, y, z, w), B=upper - upper.T, H=x)[0] == "(x, y, w)"


@pytest.mark.parametrize("order", [(0, 1, 2), (1, 0, 2), (2, 1, 0), (1, 2, 0)], ids=str)
def test_the_jacobi_sum_is_that_of_the_definition_in_any_order_of_coordinates(order):
    """In three dimensions b = (b_23, b_31, b_12) has b . curl b for its sum, up to sign."""
    b = sp.Matrix([x * y, z**2, x + y])
    skew = sp.Matrix([[0, b[2], -b[1]], [-b[2], 0, b[0]], [b[1], -b[0], 0]])
    curl = sp.Matrix([b[2].diff(y) - b[1].diff(z), b[0].diff(z) - b[2].diff(x), b[1].diff(x) - b[0].diff(y)])
    names = [(x, y, z)[i] for i in order]
    where, what = refusal(PoissonSystem, "jacobi-identity-fails", y=names, B=skew.extract(list(order), list(order)), H=x)
    found, expected = sp.sympify(what, locals={"x": x, "y": y, "z": z}), sp.expand(b.dot(curl))
    assert sp.expand(found - expected) == 0 or sp.expand(found + expected) == 0
    assert where == "(" + ", ".join(map(str, names)) + ")"


def test_a_three_dimensional_structure_times_any_function_has_the_jacobi_identity():
    assert body(B=sp.exp(sp.sin(x * y)) / sp.sqrt(2 + z**2) * so3).n == 3


def test_a_wrong_casimir_function_is_named_with_the_bracket_that_shows_it():
    assert refusal(body, "not-a-casimir-function", casimirs={"C": square + z**2}) == ("x", "-2*y*z")


def test_a_wrong_integral_is_named_with_its_bracket():
    assert refusal(body, "not-a-first-integral", integrals={"z": z}) == ("z", "2*x*y")


def test_an_integral_of_one_value_of_a_parameter_only_is_refused():
    a = sp.Symbol("a", positive=True)
    changed = {"H": x**2 + a * y**2 + z**2 + (a - 1) * x, "parameters": {a: 1}, "integrals": {"y": y}}
    assert refusal(body, "not-a-first-integral", **changed)[0] == "y"


def test_a_part_whose_flow_turns_the_wrong_way_is_refused():
    system = rigid_body()
    part = system.parts["T1"]
    back = replace(part, y=[component.subs(part.t, -part.t) for component in part.y])
    assert altered(system, "flow-of-another-field", parts={**system.parts, "T1": back})[0] == "y2"


def test_a_part_whose_flow_is_right_at_time_zero_only_is_refused():
    system = lotka_volterra()
    u, v = system.y
    part = system.parts["L"]
    first_order = replace(part, y=(u * (1 + part.t * (v - 2)), v))
    assert altered(lotka_volterra(b=2), "flow-of-another-field", parts={**system.parts, "L": first_order})[0] == "u"


def test_a_part_that_does_not_start_at_the_state_is_refused():
    system = lotka_volterra()
    u, _ = system.y
    part = system.parts["K"]
    parts = {**system.parts, "K": replace(part, y=(u, 2 * part.y[1]))}
    assert altered(system, "flow-starts-elsewhere", parts=parts) == ("v", "v")


def test_parts_that_do_not_add_up_are_refused_by_the_splitting():
    system = rigid_body()
    assert altered(system, "splitting-does-not-add-up", splittings={"12": ("T1", "T2")})[0] == "y1"


def test_parts_may_miss_H_by_a_casimir_function_and_a_constant():
    system = rigid_body()
    y1, y2, y3 = system.y
    assert replace(system, H=system.H + 5 * (y1**2 + y2**2 + y3**2) - 7).n == 3


def canonical(**changes):
    system = lotka_volterra()
    return lambda: replace(system, darboux=replace(system.darboux, **changes))


def test_canonical_coordinates_in_the_wrong_order_are_refused():
    u, v = lotka_volterra().y
    assert refusal(canonical(Q=(sp.log(v),), P=(sp.log(u),)), "coordinates-not-canonical") == ("Q with P", "-2")


def test_a_wrong_way_back_from_canonical_coordinates_is_refused():
    map_ = lotka_volterra().darboux
    assert refusal(canonical(y=(map_.y[0], 1 / map_.y[1])), "canonical-inverse-wrong")[0] == "v"


def test_a_third_canonical_coordinate_that_is_no_casimir_function_is_refused():
    q, p, c = sp.symbols("q p c", real=True)
    flat = sp.Matrix([[0, 1, 0], [-1, 0, 0], [0, 0, 0]])
    good = DarbouxMap(q=(q,), p=(p,), c=(c,), Q=(x,), P=(y,), C=(z,), y=(q, p, c))
    assert body(B=flat, casimirs={}, darboux=good).n == 3
    wrong = {"B": flat, "casimirs": {}, "darboux": replace(good, C=(z + x,), y=(q, p, c - q))}
    assert refusal(body, "coordinates-not-canonical", **wrong) == ("p with c", "-1")


def test_two_pairs_of_canonical_coordinates_have_no_cross_brackets():
    q1, q2, p1, p2 = sp.symbols("q1 q2 p1 p2", real=True)
    J = sp.Matrix(sp.BlockMatrix([[sp.zeros(2, 2), sp.eye(2)], [-sp.eye(2), sp.zeros(2, 2)]]))
    good = DarbouxMap(q=(q1, q2), p=(p1, p2), Q=(x, y), P=(z, w), y=(q1, q2, p1, p2))
    assert PoissonSystem(y=(x, y, z, w), B=J, H=x, darboux=good).n == 4
    sheared = replace(good, Q=(x, y + z), y=(q1, q2 - p1, p1, p2))
    assert refusal(PoissonSystem, "coordinates-not-canonical", y=(x, y, z, w), B=J, H=x, darboux=sheared) == ("q1 with q2", "1")


def test_a_domain_narrows_where_an_identity_is_to_hold_and_has_points():
    assert first_nonzero({"it": sp.Abs(x) - x}, (x,), (x,)) is None
    with refused("no-points-inside-domain", InvalidProblem):
        first_nonzero({"it": sp.sin(x) ** 2 + sp.cos(x) ** 2 - 1}, (x,), (-1 - x**2,))
    with refused("flow-time-taken", InvalidProblem, ["x", "'A'"]):
        body(parts={"A": Part(H=square, t=x, y=(x, y, z))})


TINY = sp.Rational(1, 10**20)


@pytest.mark.parametrize(
    ("expression", "zero"),
    [
        ((x + y) ** 2 - x**2 - 2 * x * y - y**2, True),
        (sp.sin(x) ** 2 + sp.cos(x) ** 2 - 1, True),
        (sp.sqrt(x**2 + 2 * x * y + y**2 + 1) - sp.sqrt((x + y) ** 2 + 1), True),
        (z * (sp.sin(x) ** 2 + sp.cos(x) ** 2 - 1), True),
        (TINY * x, False),
        (sp.sin(x) ** 2 + sp.cos(x) ** 2 - 1 + TINY, False),
        (sp.Abs(x) - x, False),
    ],
    ids=["square", "circle", "root", "product", "tiny", "nearly circle", "half a line"],
)
def test_zero_is_told_from_almost_zero(expression, zero):
    assert (first_nonzero({"it": expression}, (x, y, z), ()) is None) == zero


def test_only_expressions_of_moderate_size_are_expanded():
    long = sp.Add(*(sp.Symbol(f"a{i}") * (x + i) for i in range(200)))
    assert not expands_to_zero(long - sp.expand(long))
    assert expands_to_zero(x * (x + 1) - x**2 - x)


WRONG_RECORDS = {
    "list": ({"B": [[0, 1], [-1, 0]]}, "structure-matrix-type", ["B", "list"]),
    "empty": ({"y": (), "B": sp.zeros(0, 0), "H": sp.Integer(0)}, "poisson-without-coordinates", []),
    "imaginary": ({"H": sp.I * sp.Symbol("a", real=True)}, "not-real-everywhere", ["H"]),
    "nan": ({"H": sp.nan}, "not-real-everywhere", ["H"]),
    "infinite": ({"H": -sp.oo * sp.Symbol("a", real=True) ** 2}, "not-real-everywhere", ["H"]),
}


@pytest.mark.parametrize("wrong", WRONG_RECORDS, ids=str)
def test_a_record_that_is_none_is_refused_in_a_sentence(wrong):
    a, b = sp.symbols("a b", real=True)
    change, code, names = WRONG_RECORDS[wrong]
    good = {"y": (a, b), "B": sp.Matrix([[0, 1], [-1, 0]]), "H": a**2 + b**2}
    PoissonSystem(**good)
    with refused(code, InvalidProblem, names):
        PoissonSystem(**good | change)

# mypy: disable-error-code="empty-body"
"""The scheme language: for each problem, its own functions and the algebra for their shapes take the place of this module.

A scheme file imports the names of its language from here. It is executed for one problem on values that record what is done with them, from
which machine code is made, or on plain numbers. The rules:

- vectors are values, of shape(d,) for states and shape(m,) for multipliers, that no function changes;
- formulas are written with ``+ - * / @`` and ``.T`` on the classes of ``spaces.py``, as ``p0 - h / 2 * (H_q(p0, q0) + G(q0).T @ lam)``;
- every parameter has an annotation: a value of another kind is refused with the file, the line and the expression. What a function returns
  as a ``Jacobian`` or ``InverseMass`` has the zeros of one;
- branches and loops may depend on values that are not known yet; both sides of such a branch bind the same names to values of the same
  kinds. With values that are known, constants, tuples, indices and functions, everything that Python does is possible;
- work is counted by calls, so that functions of the problem are not called in a branch or a loop, except over stages or constraints;
- at module level there are functions, ``CLAIMS``, names of kinds, and ``if`` statements on the constants below.
"""

from collections.abc import Iterable
from typing import Any, overload

from daebench.schemes.kernels.spaces import (
    Gram,
    Half,
    HalfMatrix,
    InverseMass,
    Jacobian,
    Matrix,
    Multiplier,
    Number,
    Report,
    Rows,
    State,
    Step,
    Vector,
    declare,
)

# ---- constants, known when the file is executed ----------------------------------------------------------------------------

SEPARABLE: bool = False
"""H = 1/2 p^T M^-1 p + U(q) with constant M, HLW (1.22)."""

QUADRATIC: bool = False
"""H is quadratic in p, so that G H_p = 0 is linear in p."""

FREE: bool = False
"""There are no constraints."""

ON_VELOCITIES: int = 0
"""Number of constraints on velocities, the last rows of G. The entries of g for them are 0, and A has these rows alone."""

EXTENDED: bool = False
"""The last position is the time, and the last momentum its conjugate: H is K = H + p_t, see ``daebench/systems/extended.py``."""

FORCED: bool = False
"""There are forces without potential: H_q and T_q have them, and are no gradients."""

MULTISTEP: bool = False
"""The scheme carries a memory from step to step, made by its function ``start``."""

COMPOSED: bool = False
"""A step is several substeps of different sizes, whose weights are run-time data."""

COMPENSATED: bool = False
"""Sums over steps are compensated for rounding, HLW VIII.5."""

PROJECTED: bool = False
"""Each step ends with the orthogonal projection onto the manifold."""

LOCAL: bool = False
"""The scheme computes in local coordinates of the manifold, HLW (2.22)."""

CANONICAL: bool = False
"""They are the coordinates of a chart and their momenta."""

STIFF: bool = False
"""The system is the penalised one, whose force is stiff."""

RANK_WATCHED: bool = False
"""The loop monitors whether G keeps its rank."""

SINGLE: bool = False
"""Pivots of a step do not show the rank of G, which is measured at its end: there is one constraint, or G M^-1 G^T is not formed."""

STAGES: int = 1
"""Number of stages. A loop ``for`` over a range that names this constant, or the next, is unrolled in the kernel. Generators, in ``tuple``,
``min``, ``max`` and ``sum``, are over such ranges only."""

CONSTRAINTS: int = 1
"""Number of constraints m."""

AGAIN: int = 1
"""Newton's iterations are repeated this many times: 2 when derivatives are in the imaginary part."""

TANGENTS: bool = False
"""Numbers are dual and carry derivatives in several directions, see ``daebench/compiler/trace/dual.py``."""

ONCE: bool = False
"""Newton's iterations end as soon as they have converged, and are written so that several runs at once have little to select."""

ONE_UNKNOWN: bool = False
"""As ONCE, and there is one constraint: a linear solve is a division."""

ITERATIONS_ASKED: int = 0
"""Number of iterations after which Newton's iteration is ended even if it has not converged; 0: no such limit."""

ROUNDINGS: float = 4.0
"""Size of an increment, in roundings, that ends Newton's iteration."""

EPS: Number = 0.0
"""Spacing of the run's numbers at 1."""

INF: Number = 0.0
"""Infinity in the run's number type."""

# ---- the problem ---------------------------------------------------------------------------------------------------------


def H(p: Vector, q: Vector) -> Number:
    """Hamiltonian."""


def H_p(p: Vector, q: Vector) -> Vector:
    """Velocity dH/dp."""


def H_q(p: Vector, q: Vector) -> Vector:
    """Minus the force, dH/dq."""


def H_pp(p: Vector, q: Vector) -> InverseMass:
    """Inverse mass d2H/dp2, shape(d, d)."""


def H_pp_and_time(p: Vector, q: Vector) -> Matrix:
    """H_pp with a 1 in place of the time, which makes it regular."""


def H_qp(p: Vector, q: Vector) -> Matrix:
    """Derivative of H_q with respect to p, shape(d, d)."""


def H_pq(p: Vector, q: Vector) -> Matrix:
    """Derivative of H_p with respect to q, shape(d, d): the transpose of H_qp, unless forces without potential depend on velocities."""


def H_qq(p: Vector, q: Vector) -> Matrix:
    """Derivative of H_q with respect to q at fixed p, shape(d, d)."""


def M(q: Vector) -> Matrix:
    """Mass matrix, shape(d, d)."""


def mass(p: Vector, q: Vector) -> Matrix:
    """Mass matrix, the inverse of H_pp, of any problem, shape(d, d)."""


def U(q: Vector) -> Number:
    """Potential energy."""


def U_q(q: Vector) -> Vector:
    """Gradient of the potential energy."""


def U_qq(q: Vector) -> Matrix:
    """Second derivative of the potential energy, shape(d, d)."""


def N(q: Vector, v: Vector) -> Matrix:
    """Derivative of M(q) v with respect to q, shape(d, d)."""


def T_q(q: Vector, v: Vector) -> Vector:
    """Gradient of 1/2 v^T M(q) v with respect to q at fixed v."""


def T_qq(q: Vector, v: Vector) -> Matrix:
    """Derivative of T_q with respect to q at fixed v, shape(d, d)."""


def T_qv(q: Vector, v: Vector) -> Matrix:
    """Derivative of T_q, with the forces without potential, with respect to v, shape(d, d): N^T where there are none."""


def rate_of_time(q: Vector) -> Vector:
    """Velocity of a system at rest: 1 in place of the time, if it is a position, and 0 elsewhere."""


def damping(q: Vector, time: tuple[Number]) -> tuple[Number, Number]:
    """Rate c of a damping F = -c p, and exp(-c t) - 1."""


def c_v(q: Vector, v: Vector) -> Matrix:
    """Derivative of the velocity terms c = N v - T_q with respect to v, shape(d, d)."""


def g(q: Vector) -> Multiplier:
    """Constraint, shape(m,)."""


def G(q: Vector) -> Jacobian:
    """Constraint Jacobian: rows of dg/dq, and below them those of A, shape(m, d)."""


def A(q: Vector) -> Jacobian:
    """G with rows of 0 for constraints on positions, shape(m, d)."""


def A_qv(q: Vector, v: Vector) -> Rows:
    """Derivative of A(q) v with respect to q at fixed v, shape(m, d)."""


def squares(q: Vector) -> Multiplier:
    """Squares of the distances that the constraints prescribe, -g(0), shape(m,), for a problem whose constraints are all distances."""


def rows(X: Rows, p: Vector, q: Vector) -> Rows:
    """X H_pp for a Jacobian X of constraints: M^-1 applied to each of its rows, shape(m, d)."""


def g_qv(q: Vector, v: Vector) -> Rows:
    """Derivative of G(q) v with respect to q at fixed v, shape(m, d)."""


def curvature(q: Vector, lam: Multiplier) -> Matrix:
    """Derivative of G(q)^T lam with respect to q, shape(d, d)."""


def Gv(p: Vector, q: Vector) -> Multiplier:
    """Velocity constraint G H_p, HLW (1.11), shape(m,)."""


def Gv_p(p: Vector, q: Vector) -> Rows:
    """Derivative of G H_p with respect to p, G H_pp, shape(m, d)."""


def Gv_q(p: Vector, q: Vector) -> Rows:
    """Derivative of G H_p with respect to q, shape(m, d)."""


def a(p: Vector, q: Vector, lam: Multiplier) -> Multiplier:
    """Right side of HLW (1.12): the second derivative of g along the solution, shape(m,)."""


def a_p(p: Vector, q: Vector, lam: Multiplier) -> Rows:
    """Derivative of a with respect to p, shape(m, d)."""


def f(p: Vector, q: Vector) -> tuple[Vector, Vector, Number]:
    """p', q' of the ODE in the chosen form, (1.18) by default, and the smallest relative pivot."""


def K_y(p: Vector, q: Vector) -> Any:
    """Gradient of K(y) = H(chi(y)) in local coordinates y = (p, q), shape(2 d,)."""


def two_form(p: Vector, q: Vector) -> Any:
    """X^T J X with X = chi'(y) at local coordinates y = (p, q), HLW (2.21), shape(2 d, 2 d)."""


def impulse(p: Vector, q: Vector) -> Vector:
    """Right side of X^T M X Q' = P - ..., at canonical coordinates P = p and Q = q of a chart, shape(d,)."""


def L_q(q: Vector, v: Vector) -> Vector:
    """P' at the coordinates Q = q of a chart and their rates v, with the forces, shape(d,)."""


def L_qv(q: Vector, v: Vector) -> Matrix:
    """Derivative of ``L_q`` with respect to v, shape(d, d)."""


def placed(q: Vector, v: Vector, p: Vector) -> tuple[Vector, Vector]:
    """State (p, q) of the problem at the coordinates of a chart, their rates v and momenta p."""


def chart(p: Vector, q: Vector) -> tuple[Vector, Vector]:
    """State (p, q) at the local coordinates of a scheme, as momenta and positions."""


def kinetic_increment(p: Vector, q: Vector, time: tuple[Number]) -> tuple[Vector, Vector]:
    """Increments of p and q by the flow of the kinetic energy on the manifold over a time, if the problem declares that flow."""


def integrals(p: Vector, q: Vector) -> tuple[Number, ...]:
    """First integrals other than H that the problem declares."""


# ---- algebra -------------------------------------------------------------------------------------------------------------


def zero(q: Vector) -> Multiplier:
    """A multiplier of zeros in q's number type."""


def dot(x: Vector, y: Vector) -> Number:
    """x^T y."""


def dot_moduli(x: Vector, y: Vector) -> Number:
    """Sum of the moduli |x_i y_i|: the largest change of x^T y under a relative change of one in y."""


def mul_moduli(X: Jacobian, x: Vector, least: Number) -> Multiplier:
    """Sums of moduli sum_i |X_ki| (|x_i| + least), shape(m,): the changes of X x under relative changes of x, if x_i is at least that."""


def exceeding(y: Multiplier, bound: Multiplier) -> Number:
    """The number of constraints k with |y_k| > bound_k."""


def sqrt(x: Number) -> Number:
    """Square root; NaN of a negative number."""


def identity_d(q: Vector) -> Matrix:
    """I in q's number type, shape(d, d)."""


@overload
def norm(x: Vector) -> Number: ...
@overload
def norm(x: Multiplier) -> Number: ...
@overload
def norm(x: Half) -> Number: ...
def norm(x: Any) -> Any:
    """Sum of moduli; unlike the largest modulus it cannot hide a NaN.

    It measures increments only: for dual numbers it also has the sums of the derivatives' moduli, which are not its derivative.
    """


def multiplier(entries: Iterable[Number]) -> Multiplier:
    """The multiplier of these entries, one for each constraint: ``multiplier(... for k in range(CONSTRAINTS))``."""


@overload
def solve(A: Gram, b: Multiplier) -> tuple[Multiplier, Number]: ...
@overload
def solve(A: HalfMatrix, b: Half) -> tuple[Half, Number]: ...
@overload
def solve(A: Matrix, b: Vector) -> tuple[Vector, Number]: ...
@overload
def solve(A: Matrix, b: Vector, X: Rows) -> tuple[Vector, Rows, Number]: ...
@overload
def solve(A: Matrix, b: Vector, X: Matrix) -> tuple[Vector, Matrix, Number]: ...
def solve(A: Any, b: Any, X: Any = None) -> Any:
    """A^-1 b; the solutions for the rows of X, as rows, if X is given; and the smallest relative pivot."""


@overload
def solve_mass(A: Matrix, b: Vector) -> tuple[Vector, Number]: ...
@overload
def solve_mass(A: Matrix, b: Vector, X: Rows) -> tuple[Vector, Rows, Number]: ...
@overload
def solve_mass(A: Matrix, b: Vector, X: Matrix) -> tuple[Vector, Matrix, Number]: ...
def solve_mass(A: Any, b: Any, X: Any = None) -> Any:
    """As ``solve`` for A = M(q); entries that M does not couple are left out."""


def solve_2m(A: Gram, B: Gram, C: Gram, D: Gram, b: Multiplier, c: Multiplier) -> tuple[Multiplier, Multiplier, Number]:
    """x, y with [[A, B], [C, D]] (x, y) = (b, c), and the smallest relative pivot."""


def solve_stages(B: tuple[tuple[Gram, ...], ...], b: tuple[Multiplier, ...]) -> tuple[tuple[Multiplier, ...], Number]:
    """X with sum_j B[i][j] x[j] = b[i] for STAGES blocks of shape(m, m), and the smallest relative pivot."""


def solve_stages_but_one(B: tuple[tuple[Gram, ...], ...], b: tuple[Multiplier, ...]) -> tuple[tuple[Multiplier, ...], Number]:
    """X with sum_j B[i][j] x[j] = b[i] for STAGES - 1 blocks of shape(m, m), and the smallest relative pivot."""


@overload
def solve_2s(B: tuple[tuple[Gram, ...], ...], b: tuple[Multiplier, ...]) -> tuple[tuple[Multiplier, ...], Number]: ...
@overload
def solve_2s(B: tuple[tuple[Matrix, ...], ...], b: tuple[Vector, ...]) -> tuple[tuple[Vector, ...], Number]: ...
def solve_2s(B: Any, b: Any) -> Any:
    """X with sum_j B[i][j] x[j] = b[i] for 2 STAGES blocks of shape(m, m) or shape(d, d), and the smallest relative pivot."""


def solve_2d(A: Any, b: Any) -> tuple[Vector, Vector, Number]:
    """Both halves of the x with A x = b, shape(2 d,), and the smallest relative pivot."""


# ---- used only by Newton and the loop -----------------------------------------------------------------------------------


def tally(update: Any, iterations: int) -> Any:
    """Work of a number of iterations of ``update``; empty if work is not counted."""


def no_work() -> Any:
    """No work; empty where work is not counted."""


def plus_work(x: Any, y: Any) -> Any:
    """Sum of two amounts of work."""


def with_tangents(x: Any, y: Any) -> Any:
    """The values of x with the derivatives of y."""


def unsettled(size: Number, scale: Number, last: Number) -> Number:
    """Change of derivatives in a sweep, negative if they have settled; ``last`` is the change in the previous sweep."""


def at_rest(last: Number) -> bool:
    """Whether derivatives have settled in every direction, according to ``unsettled``."""


def finite_tangents(size: Number) -> bool:
    """Whether the derivatives that a norm has are finite."""


def step(p0: Vector, q0: Vector, h: Number) -> Any:
    """p1, q1, stage multipliers and a report; a multistep scheme's step has its memory after q0 and returns it after q1."""


def plain_step(p0: Vector, q0: Vector, h: Number) -> Step:
    """The scheme's own step, without operations around it."""


def increment(p0: Vector, q0: Vector, h: Number) -> Step:
    """The scheme's step as p1 - p0, q1 - q0, before they are added to the state."""


def start(p0: Vector, q0: Vector, h: Number) -> tuple[Any, Report]:
    """A multistep scheme's first memory."""


def one_step(x: State, memory: Any, h: Number) -> Any:
    """The next state, memory, the stage multipliers and a report."""


def initialise(x: State, h: Number) -> Any:
    """The memory that the first step needs, and a report."""


def after_step(x: State, report: Report) -> Any:
    """State and report after the end of a step."""


def output(x: State) -> State:
    """The state in the monitored and stored coordinates."""


def state_norm(x: State) -> Number:
    """Sum of moduli of a state."""


def conserved_quantities(x: State) -> tuple[Number, ...]:
    """Conserved quantities that the run monitors."""


def monitored_errors(x: State, first: tuple[Number, ...]) -> tuple[Number, ...]:
    """Moduli of the errors that the run monitors, given the conserved quantities at the start."""


def worst(x: tuple[Number, ...], y: tuple[Number, ...]) -> tuple[Number, ...]:
    """The larger of each pair; NaN if either is NaN."""


def total(x: tuple[Number, ...]) -> Number:
    """Sum of monitored moduli; not finite if any of them is not."""


def defined(x: State) -> Number:
    """0 if H has a value, NaN if it has none; always 0 if the forces show this, or if H is monitored."""


def store(states: Any, stage_lams: Any, row: int, x: State, stage_lam: Any) -> None:
    """Write a state into row ``row`` of the outputs, and the step's stage multipliers on request; or H if samples are requested."""


declare(globals())

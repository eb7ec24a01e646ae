"""Certified references in tests: agreement of a code's results with them, and convergence to them."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from daebench.diagnostics.order import SLACK
from daebench.errors import DaebenchError, positive, real
from daebench.reference.check.convergence import Solve, agreement, convergence
from daebench.reference.keep import store
from daebench.reference.keep.record import Reference
from daebench.runs.external_state import external_state
from daebench.runs.state import State

Step = Callable[..., Any]
"""``step(p, q, h)`` returns p and q after a step of h, shape(d,) each; for a Poisson system ``step(y, h)`` returns y, shape(n,)."""


def reference_trajectory(problem: str | Reference, case: str | None = None, *, folder: Path | None = None) -> Reference:
    """Return a certified reference: t, q, p, lam (y for a Poisson system), bound, amplification, horizon, certificate.

    Parameters
    ----------
    problem : str or Reference
        Name of a reference, for example "spherical_pendulum-fig1.2", or of a problem. A Reference is returned as it is.
    case : str, optional
        Name of the case; by default the first of the problem.
    folder : Path, optional
        Folder of references; by default those of daebench, and the user's own.

    Raises
    ------
    BadInput
        If there is no reference of this name; the message has the nearest names, or says how to build it.
    Damaged
        If its files have changed since they were written.

    Examples
    --------
    >>> from daebench.testing import reference_trajectory
    >>> reference = reference_trajectory("planar_pendulum-horizontal")
    >>> reference.t[:3].tolist(), reference.q.shape
    ([0.0, 0.125, 0.25], (801, 2))
    """
    __tracebackhide__ = True
    if isinstance(problem, Reference):
        return problem
    try:
        return store.load(problem, folder) if case is None and "-" in problem else store.find(problem, case, folder)
    except DaebenchError as error:
        raise error.with_traceback(None) from None


def assert_converges(
    step: Step,
    problem: str | Reference,
    order: float,
    *,
    case: str | None = None,
    t_end: float = 1.0,
    h: float = 1 / 16,
    halvings: int = 6,
    slack: float = SLACK,
) -> None:
    """Assert that a one-step method converges to a certified reference with at least this order, in q and in p, or in y.

    The method runs from the reference's initial values with h, h/2, h/4, ..., and its errors are measured at the stored times up to t_end
    that are multiples of h. The order is the slope fitted to the asymptotic part of the errors. Points at round-off, which the reference's
    amplification predicts, and points at which the slopes have not settled are left out.

    Parameters
    ----------
    step : callable
        One step: ``step(p, q, h)`` returns (p, q), arrays of shape(d,); of a Poisson system ``step(y, h)`` returns y, shape(n,).
    problem : str or Reference
        As for :func:`reference_trajectory`.
    order : float
        Order claimed.
    case : str, optional
        Name of the case.
    t_end : float
        Last time, s; a stored time of the reference.
    h : float
        Largest step size, s; t_end is a multiple of it.
    halvings : int
        Number of halvings.
    slack : float
        A slope is accepted if it is below the order by at most this and two standard errors.

    Raises
    ------
    AssertionError
        If the order is lower, or the errors show none; the message has a table of step sizes, errors and slopes, and advice.
    BadInput
        If a name or number is invalid, t_end is beyond a horizon, or ``step`` does not return such a state.

    Examples
    --------
    >>> import numpy as np
    >>> from daebench.testing import assert_converges
    >>> def step(p, q, h):
    ...     "RATTLE for the planar pendulum with unit mass and length."
    ...     down = np.array([0.0, 1.0])
    ...     free = q + h * (p - h / 2 * down)
    ...     inner = q @ free
    ...     q1 = free - (inner - np.sqrt(inner**2 - free @ free + 1)) * q
    ...     p1 = (q1 - q) / h - h / 2 * down
    ...     return p1 - (p1 @ q1) * q1, q1
    >>> assert_converges(step, "planar_pendulum-horizontal", 2)
    """
    __tracebackhide__ = True
    reference = reference_trajectory(problem, case)
    assert_solver_converges(_march(step, reference.state), reference, order, t_end=t_end, h=h, halvings=halvings, slack=slack)


def assert_solver_converges(
    solve: Solve,
    problem: str | Reference,
    order: float,
    *,
    case: str | None = None,
    t_end: float = 1.0,
    h: float = 1 / 16,
    halvings: int = 6,
    slack: float = SLACK,
) -> None:
    """Assert the same for codes that are not maps of states: multistep methods, staggered grids, solvers with an internal state.

    Parameters
    ----------
    solve : callable
        A whole run: ``solve(p, q, h, t)`` begins with p and q of shape(d,) at time 0, takes steps of h, and returns p and q at the
        times t, shape(n, d) each; every time is a multiple of h. For a Poisson system it is ``solve(y, h, t)``.
    problem, order, case, t_end, h, halvings, slack
        As for :func:`assert_converges`.

    Raises
    ------
    AssertionError, BadInput
        As :func:`assert_converges`.

    Examples
    --------
    >>> import daebench
    >>> from daebench.testing import assert_solver_converges
    >>> def solve(p, q, h, t):
    ...     run = daebench.run("planar_pendulum", p0=p, q0=q, method="rattle", h=h, t_end=t[-1])
    ...     rows = np.rint(np.asarray(t) / h).astype(int)
    ...     return run.p[rows], run.q[rows]
    >>> assert_solver_converges(solve, "planar_pendulum-horizontal", 2)
    """
    __tracebackhide__ = True
    try:
        asked = positive("order", order) - real("slack", slack)
        study = convergence(solve, reference_trajectory(problem, case), t_end=t_end, h=h, halvings=halvings)
    except DaebenchError as error:
        raise error.with_traceback(None) from None
    faults = study.faults(order, asked)
    if faults:
        raise AssertionError("\n".join([*faults, study.table()]))


def _march(step: Step, state: State) -> Solve:
    def solve(*given: Any) -> Any:
        __tracebackhide__ = True
        *vectors, h, t = given
        shapes, rows, n = [part.shape for part in vectors], [], 0
        for steps in np.rint(t / h):
            while n < steps:
                vectors = external_state(step(*vectors, h), shapes, f"step must return {state.as_tuple}")
                n += 1
            rows.append([part.copy() for part in vectors])
        columns = [np.array(part) for part in zip(*rows, strict=True)]
        return columns if len(columns) > 1 else columns[0]

    return solve


def assert_agrees(
    problem: str | Reference,
    *,
    t: ArrayLike,
    q: ArrayLike | None = None,
    p: ArrayLike | None = None,
    y: ArrayLike | None = None,
    digits: float,
    case: str | None = None,
) -> None:
    """Assert that a trajectory agrees with a certified reference to this number of digits, at each time and in each component.

    Digits are relative to the largest modulus of q, p, or y in the reference: an error e in q has -log10(e / max |q|) digits.

    Parameters
    ----------
    problem : str or Reference
        As for :func:`reference_trajectory`.
    t : array_like, shape(n,)
        Times, s; each a stored time of the reference.
    q, p : array_like, shape(n, d)
        Positions and momenta of a constrained problem.
    y : array_like, shape(n, size)
        States of a Poisson system.
    digits : float
        Required digits of agreement.
    case : str, optional
        Name of the case.

    Raises
    ------
    AssertionError
        If there are fewer; the message has the first time and the component, and the worst.
    BadInput
        If a name is unknown, a time is not stored, states are those of the other kind of problem, or the shapes do not fit.

    Examples
    --------
    >>> import daebench
    >>> from daebench.testing import assert_agrees
    >>> run = daebench.run("planar_pendulum", case="horizontal", method="rattle", h=1 / 1024, t_end=1, every=128)
    >>> assert_agrees("planar_pendulum-horizontal", t=run.t, q=run.q, p=run.p, digits=4)
    """
    __tracebackhide__ = True
    try:
        asked = real("digits", digits)
        states = {name: values for name, values in (("q", q), ("p", p), ("y", y)) if values is not None}
        comparison = agreement(reference_trajectory(problem, case), t, **states)
    except DaebenchError as error:
        raise error.with_traceback(None) from None
    if np.min(comparison.digits) < asked:
        raise AssertionError(comparison.lack(asked))

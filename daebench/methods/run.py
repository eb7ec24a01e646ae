"""``daebench.run``: one method on one problem, from Python."""

import warnings
from inspect import signature
from typing import TYPE_CHECKING, Any, overload

from daebench.errors import LostMotion
from daebench.methods.names import Code
from daebench.methods.plan import arguments, plan
from daebench.runs.ivp import ConstrainedIvp, InitialValueProblem, PoissonIvp
from daebench.runs.trajectory import PoissonTrajectory, Trajectory

if TYPE_CHECKING:
    from daebench.systems.constrained import ConstrainedHamiltonian
    from daebench.systems.poisson import PoissonSystem


@overload
def run(problem: "ConstrainedHamiltonian | ConstrainedIvp", *, method: Code, **settings: Any) -> Trajectory: ...
@overload
def run(problem: "PoissonSystem | PoissonIvp", *, method: Code, **settings: Any) -> PoissonTrajectory: ...
@overload
def run(problem: str, *, method: Code, **settings: Any) -> Any: ...
def run(
    problem: "str | ConstrainedHamiltonian | PoissonSystem | InitialValueProblem", *, method: Code, **settings: Any
) -> Trajectory | PoissonTrajectory:
    """Return the trajectory of one method on one problem: with states q and p, or y on a Poisson system.

    Parameters
    ----------
    problem : str, ConstrainedHamiltonian, PoissonSystem or InitialValueProblem
        Name in the catalogue, the path of a problem file, which is executed, a definition, or an initial value problem.
    method : str or callable
        Name in the grammar of :mod:`daebench.methods.names`, for example "rattle" or "ida:index2"; or code from outside, for example
        "./mine.py:step" or a callable, see :func:`daebench.methods.outside.callables.method_of_callable`. What is named by its place runs
        in a process of its own, and what ends that ends this run alone. A callable runs in this process: ``SystemExit`` ends its run, but
        ``os._exit`` and signals, as of a segmentation fault, end Python, and cannot be caught.
    case : str, optional
        Named initial values; by default the problem's first.
    h, tol : float
        The method's resolution: step size of a fixed-step method, s; relative and absolute tolerance of other methods.
    steps : int, optional
        Number of steps of a fixed-step method.
    t_end : float, optional
        End time, s, in place of ``steps``.
    points, every : int, optional
        Output: number of equidistant times of a tolerance-driven method; number of steps between outputs of a fixed-step method, 0 for the
        end only.
    parameters, options : mapping of str to float, optional
        Values of the problem's parameters, and free numbers of the method.
    q0, p0 : sequence of float, shape(d,), optional
        Initial values of a constrained problem in place of the case's; of a mechanism also by name, ``q0={"B": (0.3, 0.4)}``, see
        :class:`daebench.runs.own_start.OwnStart`.
    v0 : sequence of float, shape(d,), or mapping, optional
        Initial velocities in place of momenta; of a mechanism also by name, ``v0={"B": (0, 1), "spin(arm)": 2}``.
    y0 : sequence of float, shape(n,), optional
        Initial state of a Poisson system in place of the case's.
    watch : sequence of str, optional
        Any of "energy", "manifold" (of a constrained problem), "casimirs" (of a Poisson system), "integrals"; by default all but
        "integrals".
    project : bool
        Whether the initial values of a constrained problem are first projected onto the manifold.
    precision : str
        "float64"; "float32"; or "mixed", with forces in float32 and everything else in float64, as in OpenMM.
    multipliers : bool
        Whether lam(p, q) is computed at the output times.
    raw : bool
        Whether the stage multipliers of every step of a fixed-step scheme are kept, see :attr:`daebench.Trajectory.raw`. Those of RATTLE
        are of first order; ``mean``, of two adjacent steps, is of second order.
    compensated : bool
        Whether a fixed-step method compensates its sums over steps for rounding, HLW VIII.5: over 1e7 steps of rattle/kahan_li8 or
        lobatto5 the random walk of the energy is 7 to 40 times smaller, for 0 to 40 % more time.
    sensitivities : sequence of str
        Parameters of the problem and initial values, "q0", "p0" or "y0", by which the states are differentiated, see
        :attr:`daebench.runs.trajectory.Outcome.sensitivities`.
    on_singular : str, optional
        What to do where G loses rank: "stop", "continue" or "least-squares"; by default what the case declares.
    algebra : str
        Form of vectors: "values" or "arrays", for a chain of nodes; "" to choose by the problem's size.
    anyway : bool
        Whether a scheme may be run on a Poisson system outside of the class for which it is a Poisson integrator.
    count : bool
        Whether work is counted.
    seconds_limit : float, optional
        Wall-clock limit, s.
    callbacks : str
        Callbacks of IDA and CVODE: "native", machine code if the libraries of SUNDIALS allow it, or "python".
    solver_steps : bool
        Whether to record size, order and error estimate of each step of IDA or CVODE, see :class:`daebench.runs.solver_steps.SolverSteps`.
    progress : callable, optional
        Called with the fraction done.

    Returns
    -------
    Trajectory or PoissonTrajectory
        States, maxima and work. A run that stops early raises no error: it has its states so far, and the reason in
        :attr:`daebench.runs.trajectory.Outcome.failure`.

    Warns
    -----
    LostMotion
        If the run reached its end with an energy error above the mean kinetic energy, or with a broken constraint; or if a damping is
        negative, which is allowed.

    Raises
    ------
    BadInput
        If the request cannot be met.
    InconsistentStart
        If the initial values are off the manifold and are not to be projected.

    Notes
    -----
    ``sensitivities`` are derivatives of a fixed-step scheme's own steps, exact to rounding. IDA solves the variational equations
    F_y s + F_y' s' + F_a da = 0 with its formulation F(y, y', a) = 0: it has (1 + k) n unknowns in k directions, and derivatives are in its
    error test.

    An initial value can be changed only on the manifold. After a change of its entry q0_j or p0_j or of a parameter a, the start is
    projected as by ``project``, positions first, and the derivative is that of the projected start::

        dq -> dq - M^-1 G^T W^-1 dg,       dg = G dq + g_a da,                 W = G M^-1 G^T
        dp -> dp - G^T W^-1 dv,            dv = d(G H_p), by dp, dq and da

    This does not alter a change along the manifold, and a change along the normal, dq = M^-1 G^T nu, has no effect. A start with the
    numbers of its case varies with a parameter as the case declares; any other start does not vary before the projection.

    Examples
    --------
    >>> import daebench
    >>> run = daebench.run("planar_pendulum", case="horizontal", method="rattle", h=0.01, t_end=1)
    >>> run.q.shape, run.failure is None
    ((101, 2), True)

    With ``sensitivities`` it has derivatives of the states with respect to parameters and initial values:

    >>> swing = daebench.run(
    ...     "planar_pendulum", case="horizontal", method="rattle", h=0.01, t_end=1, sensitivities=["gravity", "q0"]
    ... )
    >>> swing.sensitivities["gravity"]["q"].shape, swing.sensitivities["q0"]["q"].shape
    ((101, 2), (101, 2, 2))
    >>> swing.sensitivities["gravity"]["q"][-1].round(4).tolist()
    [-0.2321, -0.429]
    """
    planned = plan(problem, method=method, **settings)
    trajectory: Trajectory | PoissonTrajectory = planned.execute(settings.get("progress"))
    for doubt in planned.doubts(trajectory):
        warnings.warn(doubt, LostMotion, stacklevel=2)
    return trajectory


run.__signature__ = arguments().replace(return_annotation=signature(run).return_annotation)  # type: ignore[attr-defined]

"""Properties of a code in tests: symplecticity, reversibility, conserved quantities, drift of its energy, order."""

from collections.abc import Callable, Mapping
from typing import Any

from daebench.errors import DaebenchError, RunFailed, positive
from daebench.testing.references import Step


def assert_symplectic(
    step: Step | str,
    problem: Any,
    *,
    case: str | None = None,
    parameters: Mapping[str, float] | None = None,
    h: float = 0.01,
    steps: int = 10,
) -> None:
    """Assert that a method keeps the two-form on the manifold, over several steps; on a Poisson system, that it is a Poisson map.

    The derivative is by complex step if the code computes in complex numbers, otherwise by differences, whose error is taken into account.

    Parameters
    ----------
    step : callable or str
        One step, ``step(p, q, h)`` or ``step(y, h)``, or anything else that :func:`daebench.run` takes as a method.
    problem : str, ConstrainedHamiltonian or PoissonSystem
        Name in the catalogue, the path of a problem file, or a definition.
    case : str, optional
        Name of the case; by default the first.
    parameters : mapping of str to float, optional
        Parameters of the problem that differ from the case's.
    h : float
        Step size, s.
    steps : int
        Number of steps, at most 10.

    Raises
    ------
    AssertionError
        If the defect is larger than rounding explains.
    BadInput
        If a name or number is invalid, or ``step`` does not return such a state.

    Examples
    --------
    >>> from daebench.testing import assert_symplectic
    >>> assert_symplectic("rattle", "planar_pendulum")
    """
    __tracebackhide__ = True
    _assert((step, problem, case, parameters), lambda properties, ivp, method: properties.defect("symplectic", ivp, method, h, steps))


def assert_reversible(
    step: Step | str,
    problem: Any,
    *,
    case: str | None = None,
    parameters: Mapping[str, float] | None = None,
    h: float = 0.01,
    steps: int = 10,
) -> None:
    """Assert that steps with reversed momenta lead back to the start; on a Poisson system, that steps of -h do.

    Parameters and errors are those of :func:`assert_symplectic`.

    Examples
    --------
    >>> from daebench.testing import assert_reversible
    >>> assert_reversible("rattle", "planar_pendulum")
    """
    __tracebackhide__ = True
    _assert((step, problem, case, parameters), lambda properties, ivp, method: properties.defect("symmetric", ivp, method, h, steps))


def assert_keeps(
    step: Step | str,
    problem: Any,
    *names: str,
    case: str | None = None,
    parameters: Mapping[str, float] | None = None,
    h: float = 0.01,
    steps: int = 200,
    within: float | None = None,
) -> None:
    """Assert that a method conserves quantities along a run.

    Parameters
    ----------
    step, problem, case, parameters, h
        As for :func:`assert_symplectic`.
    *names : str
        "g", "Gv" (the velocity constraint G H_p), "energy", or Casimir functions and first integrals by their names.
    steps : int
        Number of steps of the run.
    within : float, optional
        Largest error allowed; by default the rounding of the steps.

    Raises
    ------
    AssertionError
        If an error is larger; the message lists all such errors.
    BadInput
        As :func:`assert_symplectic`, or if the problem has no quantity of a name.

    Examples
    --------
    >>> from daebench.testing import assert_keeps
    >>> assert_keeps("rattle", "planar_pendulum", "g", "Gv")
    """
    __tracebackhide__ = True
    _assert((step, problem, case, parameters), lambda properties, ivp, method: properties.conserved(names, ivp, method, h, steps, within))


def assert_no_drift(
    step: Step | str,
    problem: Any,
    *,
    case: str | None = None,
    parameters: Mapping[str, float] | None = None,
    h: float = 0.01,
    t_end: float = 100.0,
) -> None:
    """Assert that the energy error of a run is bounded. A run that is too short for a decision fails, too.

    Parameters
    ----------
    step, problem, case, parameters, h
        As for :func:`assert_symplectic`.
    t_end : float
        End of the run, s: many oscillations.

    Raises
    ------
    AssertionError
        If the energy drifts, with the law of the drift; or if it cannot be decided, with the reason.
    BadInput
        As :func:`assert_symplectic`.

    Examples
    --------
    >>> from daebench.testing import assert_no_drift
    >>> assert_no_drift("rattle", "planar_pendulum")
    """
    __tracebackhide__ = True
    _assert((step, problem, case, parameters), lambda properties, ivp, method: properties.drift(ivp, method, h, t_end))


def assert_order(
    step: Step | str,
    problem: Any,
    order: float,
    *,
    case: str | None = None,
    parameters: Mapping[str, float] | None = None,
    halvings: int | None = None,
) -> None:
    """Assert the order on any problem, against a closed form or a reference made for it; :func:`assert_converges` takes certified ones.

    Parameters
    ----------
    step, problem, case, parameters
        As for :func:`assert_symplectic`.
    order : float
        Required order of q and p, or y.
    halvings : int, optional
        Number of halvings of the step size; by default until round-off is reached.

    Raises
    ------
    AssertionError
        If the order is lower, or the errors show none.
    BadInput
        As :func:`assert_symplectic`.

    Examples
    --------
    >>> from daebench.testing import assert_order
    >>> assert_order("rattle", "planar_pendulum", 2)
    """
    __tracebackhide__ = True
    _assert(
        (step, problem, case, parameters), lambda properties, ivp, method: properties.order(positive("order", order), ivp, method, halvings)
    )


def _assert(posed: tuple[Any, Any, str | None, Mapping[str, float] | None], fault: Callable[[Any, Any, Any], str]) -> None:
    """Raise AssertionError with the sentence on what is wrong, if there is one.

    ``fault`` receives the module of properties, whose import is slow, a problem and a method.
    """
    __tracebackhide__ = True
    from daebench.studies.claims import properties

    step, problem, case, parameters = posed
    try:
        sentence = fault(properties, *properties.posed(problem, case, parameters, step))
    except RunFailed as error:
        sentence = str(error)
    except DaebenchError as error:
        raise error.with_traceback(None) from None
    if sentence:
        raise AssertionError(sentence)

"""Properties of a code in tests: symplecticity, reversibility, what it conserves, drift of its energy, order."""

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

    The derivative is by complex step where the code computes in complex numbers, else by differences, whose floor is allowed for.

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
        Steps, at most 10.

    Raises
    ------
    AssertionError
        If the defect is larger than rounding explains.
    BadInput
        If a name or number is not what it must be, or ``step`` returns no such state.

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
    """Assert that steps are undone by turning momenta round and stepping again; on a Poisson system, by steps of -h.

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
        Steps of the run.
    within : float, optional
        Largest error allowed; by default what the rounding of the steps explains.

    Raises
    ------
    AssertionError
        If one is off by more; with all that are.
    BadInput
        As :func:`assert_symplectic`, or if a name is none of the problem's.

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
    """Assert that the energy error of a run is bounded. A run that is too short to tell fails too.

    Parameters
    ----------
    step, problem, case, parameters, h
        As for :func:`assert_symplectic`.
    t_end : float
        End of the run, s: many oscillations.

    Raises
    ------
    AssertionError
        If the energy drifts, with the law of the drift; or if it cannot be told, with the reason.
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
        Order of q and p, or y, that is asked for.
    halvings : int, optional
        How often the step size is halved; by default until round-off is reached.

    Raises
    ------
    AssertionError
        If it is lower, or the errors show none.
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

    ``fault`` is given the module of properties, which takes longer to import than all else here, a problem and a method.
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

"""``daebench.diagnose``: the mistake in a code that is meant to be RATTLE, or another scheme."""

from collections.abc import Callable, Iterator, Mapping
from contextlib import suppress
from dataclasses import asdict, dataclass, field
from typing import Annotated, Any, ClassVar, Unpack

from daebench.diagnostics.freedom import redundant
from daebench.errors import BadInput, DaebenchError, RunFailed, positive
from daebench.methods.catalogue import problems
from daebench.methods.fixed_step.constrained import FixedStep
from daebench.methods.initial_value_problem import initial_value_problem
from daebench.methods.names import method_of, parse
from daebench.methods.outside.method import OutsideMethod
from daebench.runs.ivp import ConstrainedIvp, Ivp
from daebench.runs.make_ivp import constrained
from daebench.runs.option import Option
from daebench.runs.own_start import OwnStart, given
from daebench.runs.result import Result
from daebench.studies.diagnose.battery import battery, map_of
from daebench.studies.diagnose.dictionary import FAULTS
from daebench.studies.diagnose.measurements import GENTLER, measured
from daebench.studies.diagnose.verdict import CORRECT, MEANT, UNSURE, finding_of, unseen

SMALL = 1e-3
"""Step with which it is seen whether a code takes a problem, s."""

PARAMETERS: Mapping[str, Mapping[str, float]] = {"double_pendulum": {"mass2": 3.0}}
"""Parameters of problems on which more faults show with them."""

MEASURED = {
    "symmetric": "defect of symmetry",
    "symplectic": "defect of the two-form",
    "g": "largest |g|",
    "G H_p": "largest |G H_p|",
    "H": "largest |H - H0|",
}
"""Words for the measurements."""


@dataclass(frozen=True)
class Diagnosis(Result):
    """Diagnosis of a code from its steps.

    Parameters
    ----------
    method, problem, case, scheme : str
        The code, its problem, and the scheme that it is meant to be.
    parameters : mapping of str to float
        The problem's.
    h : float
        The larger step size, s.
    verdict : str
        "correct", "fault" or "unsure".
    faults : tuple of str
        Names in ``FAULTS`` of ``daebench.studies.diagnose.dictionary``, the most likely first.
    resembles : str
        The scheme of daebench with the same steps, if it is not the intended one.
    evidence : tuple of str
        Measurements, as sentences.
    remedies : tuple of str
        What to change, for each fault.
    not_seen : tuple of str
        Faults that a code may have on other problems, because their steps are correct on this problem.
    measured : mapping of str to float or str
        With a quarter of the step size: ``order``, the slope of the error of q and p in a short motion, the smaller; ``symmetric`` and
        ``symplectic``, defects of 10 steps; ``g``, ``G H_p`` and ``H``, largest errors along 200 steps; ``energy``, the verdict on 4000
        steps; or ``failure``, why the code stopped. Empty if not requested.
    """

    fails_if: ClassVar[str] = "it is not correct"

    method: str
    problem: str
    case: str
    scheme: str
    parameters: Mapping[str, float]
    h: float
    verdict: str
    faults: tuple[str, ...] = ()
    resembles: str = ""
    evidence: tuple[str, ...] = ()
    remedies: tuple[str, ...] = ()
    not_seen: tuple[str, ...] = ()
    measured: Mapping[str, float | str] = field(default_factory=dict)

    @property
    def status(self) -> int:
        """1 unless the code is correct."""
        return int(self.verdict != CORRECT)

    def summary(self) -> dict[str, Any]:
        """Return the fields, for JSON."""
        return asdict(self)

    def printed(self) -> Iterator[str]:
        """Yield the verdict, remedies, evidence, and measurements."""
        parameters = ", ".join(f"{name}={value:g}" for name, value in self.parameters.items())
        yield f"{self.method} as {self.scheme} on {self.problem}, case {self.case}, {parameters}, h = {self.h:g}"
        names = ", ".join((*self.faults, *[f"resembles {self.resembles}"] * bool(self.resembles)))
        yield f"{self.verdict}: {names}" if names else self.verdict
        for name, remedy in zip(self.faults, self.remedies, strict=True):
            yield f"  {name}: the code {FAULTS[name].about}.\n    {remedy}"
        yield from (f"- {line.rstrip('.')}." for line in self.evidence)
        if self.measured:
            values = (f"{MEASURED.get(x, x)} {y if isinstance(y, str) else f'{y:.2g}'}" for x, y in self.measured.items())
            yield f"- measured: {', '.join(values)}."
        if self.not_seen:
            yield f"On this problem these faults have no effect: {', '.join(self.not_seen)}; try another with --problem."


def diagnose(
    method: Annotated[Any, Option("code")],
    problem: Annotated[Any, Option("--problem")] = None,
    *,
    case: str | None = None,
    parameters: Mapping[str, float] | None = None,
    scheme: Annotated[str, Option("--as")] = "rattle",
    h: float | None = None,
    measure: Annotated[bool, Option("--measure/--no-measure")] = True,
    progress: Callable[[float, str], None] | None = None,
    **start: Unpack[OwnStart],
) -> Diagnosis:
    """Name the mistake in an integrator that is meant to be RATTLE.

    First of all, the limit of (step - state) / h as h goes to zero is held against the equations of the problem, which tells a wrong mass,
    inertia or force. Then its steps are compared with those of the scheme, of codes with one of 35 known faults, and of the schemes of
    daebench. A fault is named if the steps agree to 1e-12, or if the parts of a step show it. If two faults explain the steps, both are
    named and the verdict is unsure. A code is correct only if it meets both constraints to round-off.

    Parameters
    ----------
    method : callable or str
        The code, see :func:`daebench.methods.outside.callables.method_of_callable`, or its place, FILE.py:NAME, LIBRARY.so:NAME or
        exec:PROGRAM; it is executed.
    problem : str or ConstrainedHamiltonian, optional
        The problem that the code solves, or the path of its file, which is executed; by default one of the catalogue is searched for, on
        which the code has a fault if it has one on any.
    case : str, optional
        Named initial values; by default the problem's first.
    parameters : mapping of str to float, optional
        Values of the problem's parameters, as in the code.
    scheme : str
        The intended fixed-step method. Faults are known for RATTLE; if a code is a different scheme of daebench, the diagnosis names the
        scheme that it resembles, and no fault.
    h : float, optional
        Step size, s; by default a large one, so that faults are far above rounding.
    measure : bool
        Whether order and defects of the code are also measured.
    progress : callable, optional
        Called with the fraction of the problems that have been tried, and a label of the next.
    **start : OwnStart
        A start of one's own in place of the case's: q0, p0, v0, y0 and project, as for :func:`daebench.initial_value_problem`.

    Raises
    ------
    BadInput
        If a name or number is invalid, or the problem has no constraints.
    RunFailed
        If the code takes none of the requested steps.

    Examples
    --------
    >>> import daebench
    >>> import numpy as np
    >>> def step(p, q, h):
    ...     "RATTLE for the planar pendulum, without the projection of the momentum at its end."
    ...     down = np.array([0.0, 1.0])
    ...     free = q + h * (p - h / 2 * down)
    ...     inner = q @ free
    ...     q1 = free - (inner - np.sqrt(inner**2 - free @ free + 1)) * q
    ...     return (q1 - q) / h - h / 2 * down, q1
    >>> diagnosis = daebench.diagnose(step, problem="planar_pendulum", measure=False)
    >>> diagnosis.verdict, diagnosis.faults, diagnosis.resembles
    ('fault', ('velocity_not_projected',), '')
    """
    if h is not None:
        positive("h", h)
    if problem is None:
        if case is not None or parameters or given(start):
            option = "--case" if case is not None else "--param" if parameters else "a start"
            raise BadInput(f"{option} belongs to a problem; name it, for example --problem double_pendulum.", "option-needs-problem")
        problem, parameters = _somewhere(method, scheme, h, progress or (lambda part, name: None))
    ivp = _with_known_faults(initial_value_problem(problem, case, parameters, **start))
    code, meant = _outside(method_of(ivp, method)), _meant(ivp, scheme)
    trial = battery(ivp, code, h)
    values = measured(ivp, code, trial.h / GENTLER, trial.eps) if measure else {}
    finding = finding_of(trial, code, meant, values)
    return Diagnosis(
        code.name,
        ivp.problem,
        ivp.case,
        meant.name,
        dict(ivp.parameters),
        trial.h,
        finding.verdict,
        finding.faults,
        finding.resembles,
        (*finding.evidence, *trial.failures),
        tuple(FAULTS[fault].remedy for fault in finding.faults),
        unseen(trial) if finding.verdict == CORRECT and meant.name in MEANT else (),
        values,
    )


def _with_known_faults(ivp: Ivp) -> ConstrainedIvp:
    """Return the problem; refuse one on which the faults of constrained steps are not known."""
    if not ivp.on_manifold or ivp.arrays:
        raise BadInput(
            f"the faults are not known on {ivp.problem}; give a constrained problem with few positions.", "diagnose-no-positions"
        )
    if not ivp.m:
        raise BadInput(
            f"{ivp.problem} has no constraint, and the faults that are known are those of constrained steps; use check.",
            "diagnose-no-constraint",
        )
    if ivp.facts.EXTENDED or redundant(ivp):
        what = "is in time or under forces" if ivp.facts.EXTENDED else "has redundant constraints"
        raise BadInput(f"{ivp.problem} {what}, for which the faults are not known; give another problem.", "diagnose-faults-unknown")
    return ivp


def _meant(ivp: ConstrainedIvp, scheme: str) -> FixedStep:
    """Return the scheme that a code is meant to be; refuse one that chooses its own steps, or is not for the problem."""
    meant = method_of(ivp, scheme)
    if not isinstance(meant, FixedStep):
        raise BadInput(
            f"{scheme} chooses its own steps, so a code cannot be compared with it; give a fixed-step method, for example rattle.",
            "compared-own-steps",
        )
    if refusal := meant.refusal(ivp):
        raise BadInput(refusal, "method-refuses-problem")
    return meant


def _outside(method: Any) -> OutsideMethod:
    """Return a code from outside; refuse a method of daebench."""
    if not isinstance(method, OutsideMethod):
        raise BadInput(f"{method.name} is a method of daebench; give code from outside, for example ./mine.py:step.", "diagnose-own-method")
    return method


def _somewhere(method: Any, scheme: str, h: float | None, progress: Callable[[float, str], None]) -> tuple[str, Mapping[str, float]]:
    """Return a problem of the catalogue on which the steps of a code are known, and its parameters: one with a fault if there is one.

    A code that solves one problem is known there, and one that takes many is right only if it is right on all of them.
    """
    _outside(parse(method))
    diagnoses, names = [], list(problems("constrained"))
    for k, name in enumerate(names):
        progress(k / len(names), f"{method} on {name}")
        with suppress(DaebenchError):
            ivp = constrained(initial_value_problem(name, None, PARAMETERS.get(name)))
            if _takes(method, ivp):
                diagnoses.append(diagnose(method, name, parameters=PARAMETERS.get(name), scheme=scheme, h=h, measure=False))
    known = [shown for shown in diagnoses if shown.verdict != UNSURE or shown.faults or shown.resembles]
    if not known:
        raise BadInput(
            f"the steps of {method} are known on no problem of the catalogue; give the problem that it solves, for example --problem "
            f"./mine.py.",
            "diagnose-steps-unknown",
        )
    shown = next((shown for shown in known if shown.verdict != CORRECT), known[0])
    return shown.problem, shown.parameters


def _takes(method: Any, ivp: ConstrainedIvp) -> bool:
    """Return whether a code takes a step from the start of a problem."""
    try:
        map_of(method_of(ivp, method), ivp)(ivp.p0, ivp.q0, SMALL)
    except (RunFailed, BadInput, ValueError):
        return False
    return True

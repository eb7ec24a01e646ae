"""The verdict on a code that is meant to be a scheme: correct, faulty with the fault, or unsure."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

from daebench.diagnostics.freedom import redundant
from daebench.errors import BadInput
from daebench.methods.fixed_step.constrained import FixedStep
from daebench.methods.initial_value_problem import initial_value_problem
from daebench.methods.names import method_of
from daebench.methods.outside.method import OutsideMethod
from daebench.studies.diagnose.agreement import (
    CONFIRMED,
    NEAR,
    RUN_CONFIRMED,
    Match,
    claimed_deviation,
    dictionary_matches,
    nearer,
    nearest,
    resembled,
    shifted,
    step_of,
)
from daebench.studies.diagnose.battery import Battery, Map, battery, map_of
from daebench.studies.diagnose.dictionary import FAULTS
from daebench.studies.diagnose.effects import GENTLER, contradiction, measured
from daebench.studies.diagnose.equations import other_equations
from daebench.studies.diagnose.exactness import Exactness, exactness
from daebench.studies.diagnose.faulty_steps import FAULTY_STEPS, baumgarte_variants
from daebench.studies.diagnose.feedback import Feedback, bias, feedback
from daebench.studies.diagnose.kicks import RATTLE
from daebench.studies.diagnose.laws import force_factor
from daebench.studies.diagnose.laws import law as obeyed_law
from daebench.studies.diagnose.multipliers import inexact

CORRECT, FAULT, UNSURE = "correct", "fault", "unsure"

TOLERATED = 100.0
"""Largest deviation of a step in units of the distance at which the code's positions meet the constraint."""

MEANT = ("rattle", "lobatto2")
"""Schemes to whose step the faults of the dictionary are relative; they are one map."""


@dataclass(frozen=True)
class Diagnosis:
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
        Names in :data:`daebench.studies.diagnose.dictionary.FAULTS`, the most likely first.
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


@dataclass(frozen=True)
class Finding:
    """A verdict and what it rests on, see :class:`Diagnosis`."""

    verdict: str
    faults: tuple[str, ...]
    evidence: tuple[str, ...]
    resembles: str = ""


def diagnose(
    method: Any,
    problem: Any,
    *,
    case: str | None = None,
    parameters: Mapping[str, float] | None = None,
    scheme: str = "rattle",
    h: float | None = None,
    measure: bool = True,
) -> Diagnosis:
    """Return the fault of a code that is meant to be RATTLE, or another scheme.

    Parameters
    ----------
    method : callable or str
        The code, see :func:`daebench.methods.outside.callables.method_of_callable`, or its place, as ``./mine.py:step``; it is executed.
    problem : str or ConstrainedHamiltonian
        The problem that the code solves.
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
    ivp = initial_value_problem(problem, case, parameters)
    if not ivp.on_manifold or ivp.arrays:
        raise BadInput(f"the faults are not known on {ivp.problem}; give a constrained problem with few positions.")
    if ivp.facts.EXTENDED or redundant(ivp):
        what = "is in time or under forces" if ivp.facts.EXTENDED else "has redundant constraints"
        raise BadInput(f"{ivp.problem} {what}, for which the faults are not known; give another problem.")
    code, meant = method_of(ivp, method), method_of(ivp, scheme)
    if not isinstance(code, OutsideMethod):
        raise BadInput(f"{code.name} is a method of daebench; give code from outside, for example ./mine.py:step.")
    if not isinstance(meant, FixedStep):
        raise BadInput(
            f"{scheme} chooses its own steps, so a code cannot be compared with it; give a fixed-step method, for example rattle."
        )
    if refusal := meant.refusal(ivp):
        raise BadInput(refusal)
    trial = battery(ivp, code, h)
    values = measured(ivp, code, trial.h / GENTLER, trial.eps) if measure else {}
    finding = _held_against(_of_equations(_finding(trial, code, meant), other_equations(trial, map_of(code, ivp))), values, meant, trial)
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
        _not_seen(trial) if finding.verdict == CORRECT and meant.name in MEANT else (),
        values,
    )


def _finding(trial: Battery, code: OutsideMethod, meant: FixedStep) -> Finding:
    """Return the first verdict that the steps give: agreement, then what their parts show."""
    single, run = claimed_deviation(trial, meant)
    step, confirmed = map_of(code, trial.mechanics.ivp), trial.rounding(CONFIRMED)
    ours = meant.name in MEANT
    matches = dictionary_matches(trial) if ours and (trial.single or single > confirmed) else []
    exact = nearest(trial, [match for match in matches if match.deviation <= confirmed])
    if single <= confirmed and not (exact and nearer(trial, exact[0].deviation, single)):
        return _same_steps(trial, step, meant, single, run)
    apart = f"a step differs from that of {meant.name} by {single:.1e} of the size of the state"
    if name := resembled(trial):
        names = () if trial.single else tuple(dict.fromkeys(match.fault for match in exact)) or (_reduced(trial, step) if ours else ())
        return Finding(UNSURE, names, (apart, f"its steps are those of {name}, to {confirmed:.2g}"), name)
    if exact:
        return _matched(exact, apart)
    if not ours:
        return Finding(UNSURE, (), (apart, f"it agrees with no scheme of daebench; faults are known only for {MEANT[0]}"))
    return _by_parts(trial, step, matches, apart) or _solved(trial, step, apart, single, run) or _by_rest(trial, step, matches, apart)


def _reduced(trial: Battery, step: Map) -> tuple[str, ...]:
    """Return the fault of a code that resembles a scheme on the index-reduced equations."""
    shown = feedback(trial, step)
    return ("index_reduced",) if shown and not (shown.damping or shown.stiffness) else ()


def _by_parts(trial: Battery, step: Map, matches: Sequence[Match], apart: str) -> Finding | None:
    """Return the verdict on a code that agrees with no step to rounding: what it does off the manifold, or a law that its steps obey."""
    if shown := feedback(trial, step):
        return _fed_back(trial, shown, apart)
    if part := bias(trial):
        law = f"velocities are computed with a bias that removes {part:.4g} of g in each step: G(q0) (q1 - q0) = -{part:.4g} g(q0)"
        return Finding(FAULT, ("baumgarte",), (apart, law))
    if obeyed := obeyed_law(trial, step):
        return Finding(FAULT, (obeyed.fault,), (apart, obeyed.about))
    return None


def _solved(trial: Battery, step: Map, apart: str, single: float, run: float) -> Finding | None:
    """Return the verdict on a code whose steps are RATTLE's but for how exactly the multipliers are solved for."""
    if not (solved := inexact(trial, step)):
        return None
    form = f"the step has the form of {MEANT[0]}'s: {solved.about}"
    if names := tuple(filter(None, solved.fault.split(", "))):
        return Finding(FAULT if len(names) == 1 else UNSURE, names, (apart, form))
    if solved.exact and single <= trial.rounding(NEAR) and run <= trial.rounding(NEAR):
        return Finding(CORRECT, (), (apart, form))
    return Finding(UNSURE, (), (apart, form))


def _by_rest(trial: Battery, step: Map, matches: Sequence[Match], apart: str) -> Finding:
    """Return the verdict on a code that may iterate to a tolerance of its own, or have another force."""
    if explained := _explained(trial, matches):
        return _near(explained, apart)
    if (factor := force_factor(trial, step)) is not None:
        return _under_other_force(trial, step, factor, apart)
    return Finding(UNSURE, (), (apart, "it agrees with no step that is known"))


def _under_other_force(trial: Battery, step: Map, factor: float, apart: str) -> Finding:
    """Return the verdict on a code that has a multiple of the problem's force: what its steps are under that force."""
    law = f"as h goes to zero its force is {factor:.6g} times the problem's; give the problem the numbers of the code"
    other = replace(trial, mechanics=replace(trial.mechanics, force=factor))
    solved = inexact(other, step)
    if other.deviation(step_of(other, RATTLE)) <= trial.rounding(CONFIRMED) or (solved and solved.exact):
        return Finding(FAULT, ("force_scaled",), (apart, law))
    exact = nearest(trial, [match for match in dictionary_matches(other) if match.deviation <= trial.rounding(CONFIRMED)])
    if not exact:
        return Finding(UNSURE, ("force_scaled",), (apart, law, "under that force it agrees with no step that is known"))
    finding = _matched(exact, apart)
    return replace(finding, evidence=(apart, law, *finding.evidence[1:]))


def _same_steps(trial: Battery, step: Map, meant: FixedStep, single: float, run: float) -> Finding:
    agree = f"single steps agree with those of {meant.name} to {single:.1e}"
    if meant.name in MEANT and not (met := exactness(trial, step)).exact:
        return _hardly_met(met, agree)
    if run <= trial.rounding(RUN_CONFIRMED):
        return Finding(CORRECT, (), (agree, f"and a run of {len(trial.rows) - 1} steps to {run:.1e}"))
    if way := shifted(trial, meant):
        return Finding(FAULT, ("step_off_by_one",), (agree, f"but in a run {way}"))
    return Finding(UNSURE, (), (agree, f"but a run differs by {run:.1e}: the code has a memory from step to step, or a run fails"))


def _hardly_met(met: Exactness, agree: str) -> Finding:
    """Return the verdict on a code whose steps are the right ones, but whose constraints are not met to round-off."""
    if met.follows:
        return Finding(FAULT, ("loose_tolerance",), (agree, f"{met.words}; the code's own iteration ends there"))
    return Finding(UNSURE, (), (agree, f"{met.words}; they are irregular, as roundings are"))


def _matched(matches: Sequence[Match], apart: str) -> Finding:
    """Return the verdict where steps of the dictionary are the code's but for rounding."""
    first: dict[str, Match] = {}
    for match in matches:
        first.setdefault(match.fault, match)
    evidence = tuple(f"a step that {_words(match)} agrees with the code's to {match.deviation:.1e}" for match in first.values())
    return Finding(FAULT if len(first) == 1 else UNSURE, tuple(first), (apart, *evidence))


def _words(match: Match) -> str:
    return f"{FAULTS[match.fault].about} ({match.variant})"


def _explained(trial: Battery, matches: Sequence[Match]) -> list[Match]:
    """Return the matches whose deviation the code's own tolerance explains: that to which its positions meet the constraint."""
    allowed = TOLERATED * (trial.off_manifold + trial.rounding(CONFIRMED))
    return [match for match in matches if match.deviation <= allowed]


def _near(matches: Sequence[Match], apart: str) -> Finding:
    """Return the verdict where steps of the dictionary are near the code's, which may iterate to a tolerance."""
    names = tuple(dict.fromkeys(match.fault for match in matches))
    note = "the rest is put down to the tolerance of the code's own iteration, which its |g| shows"
    finding = _matched(matches, apart)
    return Finding(FAULT if len(names) == 1 else UNSURE, names, (*finding.evidence, note))


def _fed_back(trial: Battery, shown: Feedback, apart: str) -> Finding:
    """Return the verdict on a code that integrates index-reduced equations, with feedback or without."""
    if not (shown.damping or shown.stiffness):
        limit = f"off the manifold its accelerations are those of the index-reduced equations, to {shown.residual:.1e}"
        return Finding(FAULT, ("index_reduced",), (apart, limit))
    law = f"off the manifold its accelerations meet g'' = -{shown.damping:g} g' - {shown.stiffness:g} g, to {shown.residual:.1e}"
    matches = dictionary_matches(trial, baumgarte_variants(shown.damping, shown.stiffness))
    return Finding(FAULT, ("baumgarte",), (apart, law, *(f"its steps are those of {x.variant}, to {x.deviation:.1e}" for x in matches[:1])))


def _of_equations(finding: Finding, sentence: str) -> Finding:
    """Return the verdict where the steps are those of other equations in the limit: a fault that is named may be why, else that is it."""
    if not sentence:
        return finding
    evidence = (sentence, *finding.evidence)
    if finding.verdict == CORRECT or finding.resembles:
        return replace(finding, verdict=UNSURE, evidence=evidence)
    if finding.faults:
        return replace(finding, evidence=evidence)
    return Finding(FAULT, ("other_equations",), evidence)


def _held_against(finding: Finding, values: Mapping[str, float | str], meant: FixedStep, trial: Battery) -> Finding:
    """Return the verdict, "unsure" in place of "correct" where what was measured of the code contradicts it."""
    if finding.verdict != CORRECT or not values:
        return finding
    against = contradiction(trial.mechanics.ivp, values, meant, trial.h / GENTLER, trial.rounding(CONFIRMED))
    return replace(finding, verdict=UNSURE, evidence=(*finding.evidence, against)) if against else finding


def _not_seen(trial: Battery) -> tuple[str, ...]:
    """Return the faults whose steps are the right ones on this problem."""
    confirmed = trial.rounding(CONFIRMED)
    first = {name: next(iter(variants.values())) for name, variants in FAULTY_STEPS.items()}
    return tuple(name for name, step in first.items() if trial.deviation(step_of(trial, step), confirmed) <= confirmed)

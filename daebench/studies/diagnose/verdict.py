"""The verdict on a code that is meant to be a scheme: correct, faulty with the fault, or unsure."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from daebench.methods.fixed_step.constrained import FixedStep
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
from daebench.studies.diagnose.battery import Battery, Map, map_of
from daebench.studies.diagnose.dictionary import FAULTS
from daebench.studies.diagnose.equations import Feedback, bias, feedback, other_equations
from daebench.studies.diagnose.faulty_steps import FAULTY_STEPS, baumgarte_variants
from daebench.studies.diagnose.kick_drift_kick import RATTLE
from daebench.studies.diagnose.laws import force_factor
from daebench.studies.diagnose.laws import law as obeyed_law
from daebench.studies.diagnose.measurements import GENTLER, contradiction, exactness
from daebench.studies.diagnose.multipliers import inexact

CORRECT, FAULT, UNSURE = "correct", "fault", "unsure"

TOLERATED = 100.0
"""Largest deviation of a step in units of the distance at which the code's positions meet the constraint."""

MEANT = ("rattle", "lobatto2")
"""Schemes to whose step the faults of the dictionary are relative; they are one map."""


@dataclass(frozen=True)
class Finding:
    """A verdict, its faults and its evidence, see :class:`daebench.studies.diagnose.diagnosis.Diagnosis`."""

    verdict: str
    faults: tuple[str, ...]
    evidence: tuple[str, ...]
    resembles: str = ""


def _named(faults: Sequence[str], *evidence: str) -> Finding:
    """Return a verdict that names a fault; of several, and of none, it is not known which it is."""
    return Finding(FAULT if len(faults) == 1 else UNSURE, tuple(faults), evidence)


def finding_of(trial: Battery, code: OutsideMethod, meant: FixedStep, values: Mapping[str, float | str]) -> Finding:
    """Return the verdict on a code, held against the equations that it solves and against what was measured of it."""
    finding = _of_equations(_finding(trial, code, meant), other_equations(trial, map_of(code, trial.mechanics.ivp)))
    if finding.verdict != CORRECT or not values:
        return finding
    against = contradiction(trial.mechanics.ivp, values, meant, trial.h / GENTLER, trial.rounding(CONFIRMED))
    return replace(finding, verdict=UNSURE, evidence=(*finding.evidence, against)) if against else finding


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
        return _named((), apart, f"it agrees with no scheme of daebench; faults are known only for {MEANT[0]}")
    return _by_parts(trial, step, apart) or _solved(trial, step, apart, single, run) or _by_rest(trial, step, matches, apart)


def _reduced(trial: Battery, step: Map) -> tuple[str, ...]:
    """Return the fault of a code that resembles a scheme on the index-reduced equations."""
    shown = feedback(trial, step)
    return ("index_reduced",) if shown and not (shown.damping or shown.stiffness) else ()


def _by_parts(trial: Battery, step: Map, apart: str) -> Finding | None:
    """Return the verdict on a code that agrees with no step to rounding: what it does off the manifold, or a law that its steps obey."""
    if shown := feedback(trial, step):
        return _fed_back(trial, shown, apart)
    if part := bias(trial):
        law = f"velocities are computed with a bias that removes {part:.4g} of g in each step: G(q0) (q1 - q0) = -{part:.4g} g(q0)"
        return _named(("baumgarte",), apart, law)
    if obeyed := obeyed_law(trial, step):
        return _named((obeyed.fault,), apart, obeyed.about)
    return None


def _fed_back(trial: Battery, shown: Feedback, apart: str) -> Finding:
    """Return the verdict on a code that integrates index-reduced equations, with feedback or without."""
    if not (shown.damping or shown.stiffness):
        limit = f"off the manifold its accelerations are those of the index-reduced equations, to {shown.residual:.1e}"
        return _named(("index_reduced",), apart, limit)
    law = f"off the manifold its accelerations meet g'' = -{shown.damping:g} g' - {shown.stiffness:g} g, to {shown.residual:.1e}"
    matches = dictionary_matches(trial, baumgarte_variants(shown.damping, shown.stiffness))
    return _named(("baumgarte",), apart, law, *(f"its steps are those of {x.variant}, to {x.deviation:.1e}" for x in matches[:1]))


def _solved(trial: Battery, step: Map, apart: str, single: float, run: float) -> Finding | None:
    """Return the verdict on a code whose steps are RATTLE's but for how exactly the multipliers are solved for."""
    if not (solved := inexact(trial, step)):
        return None
    finding = _named(solved.faults, apart, f"the step has the form of {MEANT[0]}'s: {solved.about}")
    near = trial.rounding(NEAR)
    return replace(finding, verdict=CORRECT) if solved.exact and single <= near and run <= near else finding


def _by_rest(trial: Battery, step: Map, matches: Sequence[Match], apart: str) -> Finding:
    """Return the verdict on a code that may iterate to the tolerance that its positions show, or have another force."""
    allowed = TOLERATED * (trial.off_manifold + trial.rounding(CONFIRMED))
    if explained := [match for match in matches if match.deviation <= allowed]:
        finding = _matched(explained, apart)
        note = "the rest is put down to the tolerance of the code's own iteration, which its |g| shows"
        return replace(finding, evidence=(*finding.evidence, note))
    if (factor := force_factor(trial, step)) is not None:
        return _under_other_force(trial, step, factor, apart)
    return _named((), apart, "it agrees with no step that is known")


def _under_other_force(trial: Battery, step: Map, factor: float, apart: str) -> Finding:
    """Return the verdict on a code that has a multiple of the problem's force: what its steps are under that force."""
    law = f"as h goes to zero its force is {factor:.6g} times the problem's; give the problem the numbers of the code"
    other, confirmed = replace(trial, mechanics=replace(trial.mechanics, force=factor)), trial.rounding(CONFIRMED)
    solved = inexact(other, step)
    if other.deviation(step_of(other, RATTLE)) <= confirmed or (solved and solved.exact):
        return _named(("force_scaled",), apart, law)
    if exact := nearest(trial, [match for match in dictionary_matches(other) if match.deviation <= confirmed]):
        return _matched(exact, apart, law)
    return Finding(UNSURE, ("force_scaled",), (apart, law, "under that force it agrees with no step that is known"))


def _same_steps(trial: Battery, step: Map, meant: FixedStep, single: float, run: float) -> Finding:
    """Return the verdict on a code whose single steps are the right ones: its constraints, and its run."""
    agree = f"single steps agree with those of {meant.name} to {single:.1e}"
    if meant.name in MEANT and not (met := exactness(trial, step)).exact:
        if met.follows:
            return _named(("loose_tolerance",), agree, f"{met.words}; the code's own iteration ends there")
        return _named((), agree, f"{met.words}; they are irregular, as roundings are")
    if run <= trial.rounding(RUN_CONFIRMED):
        return Finding(CORRECT, (), (agree, f"and a run of {len(trial.rows) - 1} steps to {run:.1e}"))
    if way := shifted(trial, meant):
        return _named(("step_off_by_one",), agree, f"but in a run {way}")
    return _named((), agree, f"but a run differs by {run:.1e}: the code has a memory from step to step, or a run fails")


def _matched(matches: Sequence[Match], *evidence: str) -> Finding:
    """Return the verdict where steps of the dictionary are the code's but for rounding."""
    first: dict[str, Match] = {}
    for match in matches:
        first.setdefault(match.fault, match)
    agreeing = (f"a step that {FAULTS[x.fault].about} ({x.variant}) agrees with the code's to {x.deviation:.1e}" for x in first.values())
    return _named(tuple(first), *evidence, *agreeing)


def _of_equations(finding: Finding, sentence: str) -> Finding:
    """Return the verdict where the steps are those of other equations in the limit: a fault that is named may be why, else that is it."""
    if not sentence:
        return finding
    evidence = (sentence, *finding.evidence)
    if finding.verdict == CORRECT or finding.resembles:
        return replace(finding, verdict=UNSURE, evidence=evidence)
    return replace(finding, evidence=evidence) if finding.faults else _named(("other_equations",), *evidence)


def unseen(trial: Battery) -> tuple[str, ...]:
    """Return the faults whose steps are the right ones on this problem."""
    confirmed = trial.rounding(CONFIRMED)
    first = {name: next(iter(variants.values())) for name, variants in FAULTY_STEPS.items()}
    return tuple(name for name, step in first.items() if trial.deviation(step_of(trial, step), confirmed) <= confirmed)

"""Checks of stored digits against runs in double precision: by a method of our own, throughout and from row to row, and by IDA."""

from collections.abc import Iterator
from dataclasses import replace
from fractions import Fraction

import numpy as np

from daebench.reference.check.recomputation import (
    WORTH,
    Check,
    Parts,
    Recomputed,
    Solution,
    at_most,
    coarsest,
    followed,
    ida_names,
    own_name,
    rounding_of,
    so_far,
    solved,
    suffered,
)
from daebench.reference.keep.record import EPS, Reference
from daebench.runs.ivp import Array, Ivp
from daebench.runs.request import Request

FINEST = 512
"""Steps from output to output of the finest run."""

SAFETY = 2.0
"""Factor on the error estimate |S(h) - S(h/2)|, which is the error of S(h) until both errors are rounding."""

ENOUGH = 100 * WORTH
"""Fraction of the motion above which the error of a run is too large for a useful check."""

SHORT_ROUNDINGS = 40.0
"""Effect of rounding from one row to the next, in units of the rounding of the start times the growth of neighbours. Measured values are
at most 10, for multipliers of the chain."""

NEAR = 1000.0
"""Largest factor by which uncompensated sums increase rounding in runs made here: three digits."""

SHIFT = 2.0**-30
"""Relative change of a parameter by which its effect is measured."""


def throughout(reference: Reference) -> tuple[Recomputed | None, list[Check]]:
    """Return the run through all rows, with its step halved until halving changes only rounding, and the check of its error."""
    ivp, n = reference.ivp(), followed(reference)
    name = method_of(reference, ivp)
    rounding = {part: rounding_of(reference, part, n) for part in reference.values}
    refinement = _halved(reference, ivp, rounding, coarsest(name))
    if refinement is None:
        expected = f"reaches t = {reference.t[n - 1]:g}"
        return None, [Check(name, expected, f"stops early at every step down to {_step(reference, FINEST):g}", False)]
    count, states, estimate = refinement
    moved = _inexact(reference, ivp, count, states)
    limit = {part: SAFETY * estimate[part] + rounding[part] + moved[part] for part in states}
    return Recomputed(f"{name}, h = {_step(reference, count):g}", states, limit), [_precise(reference, name, limit)]


def method_of(reference: Reference, ivp: Ivp) -> str:
    """Return the name of our own method for a reference and its initial value problem; reading its definition imports SymPy."""
    return own_name(ivp, crosses=bool(reference.rank_losses))


def _halved(reference: Reference, ivp: Ivp, rounding: Parts, count: int) -> tuple[int, Parts, Parts] | None:
    """Return steps from output to output, states, and |S(h) - S(h/2)| so far, when that is rounding or the step is the finest.

    If sums are not compensated, rounding grows with the number of steps: the halving ends when it gains nothing more.
    """
    coarse, refinement, n = None, None, len(next(iter(rounding.values())))
    while count <= FINEST:
        fine = stepped(reference, ivp, n, count)
        if coarse is not None and fine is not None:
            estimate = {part: so_far(fine[part] - coarse[part]) for part in rounding}
            if refinement is not None and _exhausted(refinement[2], estimate, rounding):
                return refinement[0], refinement[1], {part: np.maximum(refinement[2][part], estimate[part]) for part in rounding}
            refinement = count, fine, estimate
            if all(np.all(estimate[part] <= rounding[part]) for part in rounding):
                break
        coarse, count = fine, 2 * count
    return refinement


def _exhausted(last: Parts, estimate: Parts, rounding: Parts) -> bool:
    """Return whether halving the step has brought no improvement, and the remaining error is close to rounding."""
    return all(estimate[part].max() > last[part].max() / 2 and np.all(last[part] <= NEAR * rounding[part]) for part in rounding)


def row_by_row(reference: Reference) -> tuple[Recomputed | None, list[Check]]:
    """Return the result of integrating each stored row to the next, which shows what one run cannot show after its errors have grown.

    All runs from a row begin at its rounded digits; steps are halved as above, beginning with a quarter of the number of the previous row.
    """
    n, ivp = len(reference.t), reference.ivp()
    method = method_of(reference, ivp)
    name = f"{method} from each row to the next"
    rounding = {part: _short_rounding(reference, part) for part in reference.values}
    states = {part: values.copy() for part, values in reference.values.items()}
    limit = {part: values.copy() for part, values in rounding.items()}
    count = coarsest(method)
    for k in range(n - 1):
        start = reference.restarted(ivp, k)
        refinement = _halved(reference, start, {part: values[k : k + 2] / 2 for part, values in rounding.items()}, count)
        if refinement is None:
            return None, [Check(name, f"reaches t = {reference.t[k + 1]:g}", f"stops after t = {reference.t[k]:g} at every step", False)]
        count = max(coarsest(method), refinement[0] // 4)
        for part in states:
            states[part][k + 1] = refinement[1][part][1]
            limit[part][k + 1] += SAFETY * refinement[2][part][1]
    return Recomputed(name, states, limit), [_precise(reference, name, limit)]


def _inexact(reference: Reference, ivp: Ivp, count: int, states: Parts) -> Parts:
    """Return the effect of the rounding of parameters to double precision, from runs with changed parameters."""
    moved = {part: np.zeros_like(values) for part, values in states.items()}
    for name, text in reference.certificate["definition"]["parameters"].items():
        value = ivp.parameters[name]
        wrong = float(abs(Fraction(text) - Fraction(value)))
        if wrong:
            beside = replace(ivp, parameters={**ivp.parameters, name: value * (1 + SHIFT)})
            changed = stepped(reference, beside, len(next(iter(states.values()))), count)
            for part in states:
                effect = np.inf if changed is None else so_far(changed[part] - states[part])
                moved[part] += effect * wrong / abs(value * SHIFT)
    return moved


def _short_rounding(reference: Reference, part: str) -> Array:
    """Return the largest effect of rounding on a part from one row to the next, shape(n, 1)."""
    growth = np.maximum(1.0, reference.step_amplification) * suffered(reference, part)
    return np.asarray(SHORT_ROUNDINGS * EPS * reference.size(part) * growth)[:, None]


def _precise(reference: Reference, name: str, limit: Parts) -> Check:
    """Check that the estimated error of a run is small enough for a comparison."""
    n = len(next(iter(limit.values())))
    error = max(float(limit[part].max()) / reference.size(part) for part in limit)
    return at_most(f"own error of {name} up to t = {reference.t[n - 1]:g}, as a part of the motion", ENOUGH, error)


def stepped(reference: Reference, ivp: Ivp, n: int, count: int) -> Parts | None:
    """Return the run of our own method with this many steps from output to output, or None if it stops early."""
    request = Request(value=_step(reference, count), steps=(n - 1) * count, every=count, watch=(), count=False)
    run = solved(ivp, method_of(reference, ivp), request)
    return None if run.failure else run.states


def _step(reference: Reference, count: int) -> float:
    return float(reference.t[1]) / count


TOL, IDA_END = 1e-12, 10.0
"""Tolerance of IDA, and the end of its runs, s."""

IDA_SAFETY = 3.0
"""Factor on the error estimate: |S(tol) - S(tol/10)|, the largest of a run, was 0.62 to 1.92 times IDA's largest true error in 70 cases."""

VAGUE, FEWEST = 1e-3, 8
"""The comparison with IDA ends when its error may be this fraction of the motion. At least this many outputs must come before."""

TABLE_FACTOR = 10.0
"""Largest ratio of an error to that in the certificate for which both count as of the same order of magnitude."""


def by_ida(reference: Reference) -> tuple[Recomputed | None, list[Check]]:
    """Return the run of IDA as far as it is informative, and the checks that it reached its end with the error in the certificate.

    It is stopped before a rank loss, where it may take another branch. A tenth of the tolerance may be too near to round-off for IDA;
    then its error is estimated as far as that run came.
    """
    n = min(followed(reference), int(np.searchsorted(reference.t, min((IDA_END, *reference.rank_losses)), "right")))
    t_end, ivp = float(reference.t[n - 1]), reference.ivp()
    ida = ida_names(ivp)[0]
    runs = [_by_tolerance(ivp, ida, tol, t_end, n) for tol in (TOL, TOL / 10)]
    if why := runs[0].failure:
        return None, [Check(f"{ida}, tol = {TOL:g}", f"reaches t = {t_end:g}", why, False)]
    n = int(np.searchsorted(reference.t, runs[1].t[-1], "right"))
    loose, tight = ({part: rows[:n] for part, rows in trajectory.states.items()} for trajectory in runs)
    estimate = {part: IDA_SAFETY * so_far(loose[part] - tight[part]) for part in loose}
    vague = np.any([estimate[part][:, 0] > VAGUE * reference.size(part) for part in loose], axis=0)
    outputs = int(np.argmax(vague)) if vague.any() else n
    clear = Check(f"{ida}, tol = {TOL:g}", f"below {VAGUE:g} of the motion for {FEWEST} outputs", f"for {outputs}", outputs >= FEWEST)
    if outputs < FEWEST:
        return None, [clear]
    limit = {part: estimate[part][outputs - 1] + rounding_of(reference, part, outputs) for part in loose}
    run = Recomputed(f"{ida}, tol = {TOL:g}", {part: loose[part][:outputs] for part in loose}, limit)
    return run, [clear, *_table(reference, ida, loose)]


def _table(reference: Reference, ida: str, states: Parts) -> Iterator[Check]:
    """Compare errors of IDA with those in the certificate, which are equal if they end at the same time, and otherwise larger."""
    rows = [row for row in reference.certificate["ida"] if row["method"] == ida and row["tol"] == TOL]
    if not rows:
        yield Check(f"the certificate's row of {ida} at tol = {TOL:g}", "is there", "is not", False)
        return
    for part, values in states.items():
        same = rows[0]["t_reached"] <= reference.t[len(values) - 1]
        claimed = float(rows[0]["error"][part])
        error = float(np.abs(values - reference.values[part][: len(values)]).max())
        least = claimed / TABLE_FACTOR if same else 0.0
        most, what = TABLE_FACTOR * claimed, f"error of {ida} in {part} against the certificate's"
        yield Check(what, f"{least:.1e} to {most:.1e}", f"{error:.1e}", least <= error <= most)


def _by_tolerance(ivp: Ivp, ida: str, tol: float, t_end: float, n: int) -> Solution:
    """Return the run of IDA with output at the first n stored times."""
    on_singular = None if ivp.singular else "continue"
    return solved(ivp, ida, Request(value=tol, t_end=t_end, points=n, watch=(), on_singular=on_singular))

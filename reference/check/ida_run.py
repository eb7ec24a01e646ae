"""Check of stored digits against IDA, and of its error against that in the certificate."""

from collections.abc import Iterator

import numpy as np

from daebench.reference.check.recomputation import Parts, Recomputed, followed, rounding_of, so_far
from daebench.reference.check.runs import Solution, ida_names, solved
from daebench.reference.check.verification import Check
from daebench.reference.keep.record import Reference
from daebench.runs.ivp import Ivp
from daebench.runs.request import Request

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

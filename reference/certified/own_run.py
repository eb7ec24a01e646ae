"""Stored digits held against a method of our own: one run through all of them, and short ones from each row to the next."""

from dataclasses import replace
from fractions import Fraction

import numpy as np

from daebench.method import Request
from daebench.names import parse
from daebench.reference.certified.recomputation import (
    WORTH,
    Array,
    Parts,
    Recomputed,
    followed,
    parts_of,
    rounding_of,
    so_far,
)
from daebench.reference.certified.record import EPS, PARTS, Reference
from daebench.reference.certified.verification import Check, at_most
from daebench.scene import Scene

METHOD = "rattle/kahan_li8"
"""Order 8 on the constrained system itself, for every H; it needs no multiplier formula, and half the compile time of lobatto5 or less,
which has the same order and gives much the same digits."""

COARSEST, FINEST = 8, 512
"""Steps from output to output of the first run, and of the last one that is tried."""

SAFETY = 2.0
"""|S(h) - S(h/2)| is the error of S(h), which that of S(h/2) is far below, until both are rounding."""

ENOUGH = 100 * WORTH
"""A run whose own error may be more than this part of the motion tells too little."""

SHORT_ROUNDINGS = 40.0
"""What rounding leaves from one row to the next, in units of the rounding of the start times the growth of neighbours: 10 at most where it
was measured, for multipliers of the chain."""

SHIFT = 2.0**-30
"""Relative change of a parameter by which its effect is measured."""


def throughout(reference: Reference) -> tuple[Recomputed | None, list[Check]]:
    """Return the run through all rows, its step halved until what halving changes is rounding, and the check of its error."""
    scene, n = reference.scene(), followed(reference)
    rounding = {part: rounding_of(reference, part, n) for part in PARTS}
    found = _halved(reference, scene, rounding)
    if found is None:
        expected = f"reaches t = {reference.t[n - 1]:g}"
        return None, [Check(METHOD, expected, f"stops early at every step down to {_step(reference, FINEST):g}", False)]
    count, states, estimate = found
    moved = _inexact(reference, scene, count, states)
    limit = {part: SAFETY * estimate[part] + rounding[part] + moved[part] for part in PARTS}
    return Recomputed(f"{METHOD}, h = {_step(reference, count):g}", states, limit), [_precise(reference, METHOD, limit)]


def _halved(reference: Reference, scene: Scene, rounding: Parts, count: int = COARSEST) -> tuple[int, Parts, Parts] | None:
    """Return steps from output to output, states, and |S(h) - S(h/2)| so far, where that is rounding or the step the finest."""
    coarse, found, n = None, None, len(rounding["q"])
    while count <= FINEST:
        fine = stepped(reference, scene, n, count)
        if coarse is not None and fine is not None:
            found = count, fine, {part: so_far(fine[part] - coarse[part]) for part in PARTS}
            if all(np.all(found[2][part] <= rounding[part]) for part in PARTS):
                break
        coarse, count = fine, 2 * count
    return found


def row_by_row(reference: Reference) -> tuple[Recomputed | None, list[Check]]:
    """Return what becomes of each stored row by the next one: it sees what one run cannot, after errors have grown.

    Both runs of a row begin at its rounded digits; steps are halved as above, and begin with those of the row before.
    """
    name, n, scene = f"{METHOD} from each row to the next", len(reference.t), reference.scene()
    rounding = {part: _short_rounding(reference, part) for part in PARTS}
    states = {part: np.array(getattr(reference, part)) for part in PARTS}
    limit = {part: rounding[part].copy() for part in PARTS}
    count = COARSEST
    for k in range(n - 1):
        start = replace(scene, q0=reference.q[k], p0=reference.p[k])
        found = _halved(reference, start, {part: rounding[part][k : k + 2] / 2 for part in PARTS}, count)
        if found is None:
            return None, [Check(name, f"reaches t = {reference.t[k + 1]:g}", f"stops after t = {reference.t[k]:g} at every step", False)]
        count = max(COARSEST, found[0] // 2)
        for part in PARTS:
            states[part][k + 1] = found[1][part][1]
            limit[part][k + 1] += SAFETY * found[2][part][1]
    return Recomputed(name, states, limit), [_precise(reference, name, limit)]


def _inexact(reference: Reference, scene: Scene, count: int, states: Parts) -> Parts:
    """Return what it does that double precision does not have every parameter exactly, from runs with changed ones."""
    moved = {part: np.zeros_like(states[part]) for part in PARTS}
    for name, text in reference.certificate["definition"]["parameters"].items():
        value = scene.parameters[name]
        wrong = float(abs(Fraction(text) - Fraction(value)))
        if wrong:
            beside = replace(scene, parameters={**scene.parameters, name: value * (1 + SHIFT)})
            changed = stepped(reference, beside, len(states["q"]), count)
            for part in PARTS:
                effect = np.inf if changed is None else so_far(changed[part] - states[part])
                moved[part] += effect * wrong / abs(value * SHIFT)
    return moved


def _short_rounding(reference: Reference, part: str) -> Array:
    """Return what rounding may leave of a part from one row to the next, shape(n, 1)."""
    return np.asarray(SHORT_ROUNDINGS * EPS * reference.size(part) * np.maximum(1.0, reference.step_amplification))[:, None]


def _precise(reference: Reference, name: str, limit: Parts) -> Check:
    """Check that a run knows itself to be good enough for a comparison."""
    error = max(float(limit[part].max()) / reference.size(part) for part in PARTS)
    return at_most(f"own error of {name} up to t = {reference.t[len(limit['q']) - 1]:g}, as a part of the motion", ENOUGH, error)


def stepped(reference: Reference, scene: Scene, n: int, count: int) -> Parts | None:
    """Return the run of our own method with so many steps from output to output, or None if it stops early."""
    request = Request(value=_step(reference, count), steps=(n - 1) * count, every=count, watch=(), count=False, multipliers=True)
    found = parse(METHOD, compensated=True).solve(scene, request)
    return None if found.failure else parts_of(found)


def _step(reference: Reference, count: int) -> float:
    return float(reference.t[1]) / count

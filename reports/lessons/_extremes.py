"""The experiments of the lesson on extremes, and the numbers that it tells."""

from functools import partial
from types import SimpleNamespace

import numpy as np

from daebench.pages.lesson.control import NO_YES, defaults
from daebench.pages.lesson.experiment import Preparation
from daebench.pages.report.claims import require
from daebench.reports.lessons import _extremes_chaos, _extremes_lock, _extremes_rounding, _extremes_stiff
from daebench.reports.lessons._extremes_chaos import CHAOS, DELTA, apart, parted
from daebench.reports.lessons._extremes_lock import LOCK
from daebench.reports.lessons._extremes_rounding import ROUNDING
from daebench.reports.lessons._extremes_stiff import STIFF

EXPERIMENTS = (LOCK, STIFF, ROUNDING, CHAOS)
MANY = 200_000
NEARLY, TIGHT = 1.001, 0.001


def preparations() -> list[Preparation]:
    """Return what has to be compiled before the controls answer at once."""
    found: list[Preparation] = [
        (f"compiling {name} for the crank", partial(_extremes_lock.run, name, 2.0, 0.01)) for name in _extremes_lock.SCHEMES
    ]
    found += [(f"compiling {name}", partial(_extremes_stiff.run, name, 0.1, 0.01)) for name in _extremes_stiff.SCHEMES]
    found += [(f"compiling rattle, {_extremes_rounding.NAMES[each]}", partial(_extremes_rounding.run, each, 0.1, 1000)) for each in NO_YES]
    return found + [
        (f"compiling {name} for two arms", partial(_extremes_chaos.run, name, 0.0, 0.01, 0.1)) for name in _extremes_chaos.SCHEMES
    ]


def facts() -> SimpleNamespace:
    """Return the numbers of the text; the first sentence that does not hold raises ClaimRefuted."""
    lock = {rod: _extremes_lock.run("rattle", rod, _extremes_lock.H) for rod in (2.0, NEARLY, 1.0)}
    energy = {rod: float(np.max(np.abs(found[1]))) for rod, found in lock.items()}
    rounding = {each: float(np.max(np.abs(_extremes_rounding.run(each, 0.01, MANY)[1]))) for each in NO_YES}
    stiff = {name: _extremes_stiff.run(name, TIGHT, 0.005) for name in _extremes_stiff.SCHEMES}
    chaos = {name: parted(*apart(defaults(CHAOS.controls) | {"scheme": name})[:2]) for name in _extremes_chaos.SCHEMES}
    nearer = parted(*apart(defaults(CHAOS.controls) | {"delta": DELTA / 100})[:2])
    require(energy[NEARLY] > 10 * energy[2.0], "the energy error grows as the rod comes close to the crank", energy)
    require(lock[1.0][0].failure is not None, "a rod as long as the crank locks", lock[1.0][0].t[-1])
    require(rounding[True] < 0.5 * rounding[False], "compensated sums lose less", rounding)
    require(
        stiff["stiff:rk4"][0].failure is not None and stiff["stiff:midpoint"][0].failure is None,
        "the explicit method ends, the implicit one does not",
        stiff["stiff:rk4"][0].t[-1],
    )
    require(all(np.isfinite(each) for each in (*chaos.values(), nearer)), "all of the pendulums part", chaos)
    require(nearer > chaos["rattle"], "a smaller difference takes longer", nearer)
    return SimpleNamespace(
        energy=energy,
        lock=lock,
        rounding=rounding,
        stiff=stiff,
        chaos=chaos,
        nearer=nearer,
        delta=DELTA,
        many=MANY,
        tight=TIGHT,
        nearly=NEARLY,
    )

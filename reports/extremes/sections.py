"""Sections of the report on extremes: problem, extreme, and the text before the numbers; and their runs, in a store beside the page."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import pandas as pd

from daebench.pages.report import Progress
from daebench.pages.report.timed_runs import Processes, make_runs
from daebench.pages.report.two_processes import two_processes
from daebench.records.store import opened
from daebench.studies.grid.runs import runs_of
from daebench.studies.precision import specifications_of, table_of
from daebench.studies.stability.extreme import Asked
from daebench.studies.stability.study import EXTREMES

FAST = Asked(problem="spherical_pendulum", case="fig1.2")

RODS = (2.0, 1.5, 1.1, 1.03, 1.01, 1.003, 1.001)
"""Length of the rod of the slider-crank over that of the crank: at 1 the mechanism can fold, where G loses rank."""

MAPPED = ("symplectic_euler", "rattle", "lobatto3", "rk4", "rk4+proj", "generalized_alpha")
"""Methods whose maps are drawn."""


@dataclass(frozen=True)
class Section:
    """One extreme of one problem."""

    key: str
    title: str
    """Name in links and files, and heading."""
    extreme: str
    """Name of the extreme, see :data:`daebench.studies.stability.study.EXTREMES`."""
    asked: Asked
    """The problem and the methods."""
    about: str
    """The experiment and its reason, as HTML."""
    alt: str
    """Text alternative of the picture."""


SECTIONS = (
    Section(
        "steps",
        "How large may a step be?",
        "step-limit",
        FAST,
        "The fast spherical pendulum, with larger and larger steps. An implicit scheme stops where Newton's iteration finds no solution of "
        "its equations; an explicit one goes on long after its numbers have lost their meaning. Two limits are bisected: the largest step "
        "with which a run reaches its end, and the largest with which the energy stays within one part in a hundred of twice the kinetic "
        "energy. Between the limits a wrong result looks right.",
        "A line for each method with two marks on a logarithmic scale of step sizes: one for reaching the end, one for the energy.",
    ),
    Section(
        "map",
        "How does a run with too large a step end?",
        "outcome-map",
        replace(FAST, methods=MAPPED),
        "The fast spherical pendulum with gravity from a hundredth to a hundred times its value, in 16 to 2048 steps. The outcome of each"
        " run is one word, determined from its failure, the residual of the constraints, the agreement of each step with the velocities, "
        "and the size of the energy error. The colour is that size. Hatches show where the error drifts, and where this is undecided.",
        "A map for each method, step size across and gravity up: colours for the outcome of each run, hatches for the trend of its energy.",
    ),
    Section(
        "masses",
        "Which mass ratios does a method bear?",
        "parameter-range",
        Asked(problem="double_pendulum", case="swing"),
        "The double pendulum with an upper mass of 10<sup>&minus;8</sup> to 10<sup>8</sup> times the lower. "
        "<i>G M</i><sup>&minus;1</sup><i>G</i><sup>T</sup> then has entries of very different size, and with "
        "a light upper mass a fast motion appears that a fixed step does not resolve. "
        "Energy errors are in parts of twice the largest kinetic energy.",
        "Energy error and constraint residual against the mass on logarithmic scales, one curve per method.",
    ),
    Section(
        "lock",
        "How near to lock-up does a mechanism still run?",
        "parameter-range",
        Asked(problem="slider_crank", case="turning", parameters={"rod": RODS}, near=1.0),
        "The slider-crank with a rod from twice the length of the crank to hardly longer. The shorter the rod, the closer each turn "
        "passes to the position in which the slider meets the axle. There the gradients of the constraints are nearly dependent, and "
        "velocities are large.",
        "Energy error and constraint residual against the length of the rod, one curve per method.",
    ),
    Section(
        "penalty",
        "Does a penalty replace the constraint?",
        "penalty",
        FAST,
        "The fast spherical pendulum on a stiff spring: <i>g</i><sup>T</sup><i>g</i>/(2 <i>ε</i><sup>2</sup>) is added to <i>H</i> "
        "instead of the constraint. As <i>ε</i> goes to 0 the motion becomes the constrained one, with an oscillation of frequency of the"
        " order 1/<i>ε</i> across the manifold on top. A step may resolve the motion but not the oscillation. Errors are against the "
        "certified constrained motion, and each method is compared with one of its order on the constrained system.",
        "Three panels, one per step size: error of q against eps on logarithmic scales, with the constrained runs of both orders as "
        "levels.",
    ),
    Section(
        "round-off",
        "When does a smaller step make the error larger?",
        "round-off",
        FAST,
        "The fast spherical pendulum, with smaller and smaller steps: the error falls until the rounding of a step exceeds its truncation"
        " error. For solvers that choose their steps, smaller tolerances have the same effect. A system of higher index should show it "
        "first: with index 3 round-off is divided by powers of the step.",
        "Two panels: error against step size and against tolerance, logarithmic, one curve per method; a cross where a method gives up.",
    ),
    Section(
        "unstable",
        "How long can a run follow a motion from near an unstable equilibrium?",
        "lost-motion",
        Asked(problem="planar_pendulum", case="near_top"),
        "The pendulum is released a thousandth of a radian from its highest point, and returns there each turn. An error on the way "
        "up grows on the way down.",
        "Time until which each method follows, against its step and its tolerance; a dashed line where double precision ends, if it does.",
    ),
    Section(
        "chaos",
        "How long can a run follow a chaotic motion?",
        "lost-motion",
        Asked(problem="double_pendulum", case="horizontal"),
        "The double pendulum is released from the horizontal. Two motions whose starts differ by a rounding error separate in the end. "
        "After that no run follows the motion, and only energies, constraints and statistics can be compared.",
        "Time until which each method follows, against its step and its tolerance; a dashed line where double precision ends, if it does.",
    ),
)
"""The sections, in their order."""

PRECISION = replace(FAST, methods=("rattle", "lobatto3"))
"""What is computed in several precisions."""


STORE = "studies.db"
"""File of the stored runs."""

KNOWN = 0.95
"""Fraction of the work that is done after the runs that are known beforehand."""


@dataclass(frozen=True)
class Numbers:
    """The measurements of the report."""

    tables: Mapping[str, pd.DataFrame]
    """The table of each section, by its key."""
    precision: pd.DataFrame
    """Runs in several precisions."""


def measure(out: Path, progress: Progress, sections: Sequence[Section] = SECTIONS, processes: Processes = two_processes) -> Numbers:
    """Return the numbers; runs in the store of the folder are not repeated.

    Runs that are known beforehand are made in two processes, timed runs in different precisions last; bisections make further runs.
    """
    ways = specifications_of(PRECISION)[0]
    with opened(out / STORE) as store:
        known = [specification for section in sections for specification in EXTREMES[section.extreme].specifications(section.asked)]
        make_runs(
            [*known, *(specification for _, specification in ways)], store, lambda done, doing: progress(KNOWN * done, doing), processes
        )
        tables: dict[str, pd.DataFrame] = {}
        for k, section in enumerate(sections):
            progress(KNOWN + (1 - KNOWN) * k / len(sections), section.title)
            tables[section.key] = EXTREMES[section.extreme].measure(section.asked, runs_of(store))
        return Numbers(tables, table_of(ways, runs_of(store)))

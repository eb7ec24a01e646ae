"""Motions of the report on work against precision, each of a different character, and their runs: stored, and timed one at a time."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from types import MappingProxyType
from typing import Any

import pandas as pd

from daebench.errors import DaebenchError
from daebench.methods.fixed_step.lifted import Lifted
from daebench.methods.initial_value_problem import initial_value_problem
from daebench.methods.names import methods_of
from daebench.pages.report import Progress
from daebench.pages.report.timed_runs import Processes, make_runs
from daebench.pages.report.two_processes import two_processes
from daebench.records.store import opened
from daebench.studies.grid.claimed import claims_of
from daebench.studies.grid.metrics import defect_of
from daebench.studies.grid.study import Study
from daebench.studies.work_precision.study import REPEAT, TOLERANCES, standard, with_conserved, with_costs

EVERY_OTHER = TOLERANCES[1::2]
"""Tolerances of long runs: 1e-4, 1e-6, ... 1e-12."""

COARSE = MappingProxyType(dict.fromkeys(("scipy:Radau", "solve_dae:Radau"), EVERY_OTHER[:4]))
"""Tolerances of the two methods whose runs take longest, without the tightest."""

WANTED = (1e-3, 1e-6, 1e-9)
"""Accuracies for which a method is recommended."""


@dataclass(frozen=True)
class Work:
    """A motion up to a horizon."""

    problem: str
    case: str
    """Names; the case has a certified reference."""
    t_end: float
    """Horizon, s."""
    title: str
    character: str
    """Its name, and the reason why it is in the set, as HTML."""
    tol: tuple[float, ...] = TOLERANCES
    """Tolerances."""

    @property
    def key(self) -> str:
        """Name in files and links."""
        return f"{self.problem}-{self.case}-{self.t_end:g}".replace(".", "_").replace(",", "_")

    @property
    def poisson(self) -> bool:
        """Whether it is a Poisson system."""
        return not initial_value_problem(self.problem, self.case).on_manifold

    @property
    def letter(self) -> str:
        """Letter of the variable whose errors are measured: q, or y."""
        return "y" if self.poisson else "q"

    @property
    def error(self) -> str:
        """Column of the error."""
        return f"error_{self.letter}"

    def study(self) -> tuple[Study, Mapping[str, str]]:
        """Return the standard study, and the reasons why methods of the standard set are not in it."""
        study, left_out = standard(self.problem, case=self.case, t_end=self.t_end, tol=self.tol, repeat=REPEAT, anyway=self.poisson)
        coarse_tols = {method: tol for method, tol in COARSE.items() if method in study.methods}
        return replace(study, values={**study.values, **coarse_tols}), left_out


WORKS = (
    Work("spherical_pendulum", "fig1.2", 10.0, "Spherical pendulum, short", "the standard: one constraint, a fast swing (HLW Fig. 1.2)"),
    Work("spherical_pendulum", "fig1.2", 100.0, "Spherical pendulum, long", "the same motion over ten times the time", EVERY_OTHER),
    Work("double_pendulum", "horizontal", 10.0, "Double pendulum", "chaotic: errors grow exponentially, so the horizon is short"),
    Work("slider_crank", "turning", 10.0, "Slider crank", "a mechanism: two constraints, a mass matrix that is not diagonal"),
    Work("free_rigid_body", "hlw", 100.0, "Free rigid body", "a Poisson system with a quadratic Casimir function", EVERY_OTHER),
    Work("lotka_volterra", "4,2", 100.0, "Predator and prey", "a Poisson system in the plane, whose orbits are closed curves", EVERY_OTHER),
)
"""The standard set."""


STORE = "studies.db"
"""File of the runs, in the folder of the report."""

MADE = 0.95
"""Fraction of the work that is done when all runs are done."""

COARSER = 2
"""Defects are measured with steps this many times as long as the middle one of a method's step sizes."""


@dataclass(frozen=True)
class Numbers:
    """The measurements of the report."""

    works: tuple[Work, ...]
    """The motions."""
    runs: Mapping[str, pd.DataFrame]
    """One row per run, by key of the motion, with costs and conserved quantities, see
    :func:`daebench.studies.work_precision.study.with_conserved`.
    """
    defects: pd.DataFrame
    """Columns key, method, h, claimed, defect: of fixed-step methods; claimed is whether the method claims that there is none."""
    left_out: pd.DataFrame
    """Columns key, method, why: of the methods of the standard set that cannot solve a problem."""


def measure(folder: Path, tell: Progress, works: Sequence[Work] = WORKS, processes: Processes = two_processes) -> Numbers:
    """Return the numbers; runs in the store of the folder are not repeated."""
    studies = {work.key: work.study() for work in works}
    with opened(folder / STORE) as store:
        specifications = [specification for study, _ in studies.values() for specification in study.specifications()]
        make_runs(specifications, store, lambda done, doing: tell(MADE * done, doing), processes)
        tables = {key: study.table(store) for key, (study, _) in studies.items()}
    tell(MADE, "defects")
    defect_rows = [row for work in works for row in defects(work, studies[work.key][0])]
    frame = pd.DataFrame(defect_rows, columns=["key", "method", "h", "claimed", "defect"])
    return Numbers(
        works=tuple(works),
        runs={key: with_conserved(with_costs(table), _by_method(frame, key), claims_of(table)) for key, table in tables.items()},
        defects=frame,
        left_out=pd.DataFrame(
            [(key, method, why) for key, (_, left) in studies.items() for method, why in left.items()], columns=["key", "method", "why"]
        ),
    )


def _by_method(frame: pd.DataFrame, key: str) -> dict[str, float]:
    motion_defects = frame[frame["key"] == key]
    return {str(name): float(defect) for name, defect in zip(motion_defects["method"], motion_defects["defect"], strict=True)}


def defects(work: Work, study: Study) -> list[dict[str, object]]:
    """Return the defect of the two-form, or of the structure matrix, of each fixed-step method, uncompiled."""
    ivp = study.specifications()[0].ivp
    rows: list[dict[str, object]] = []
    for name, solver in zip(study.methods, methods_of(ivp, study.methods, anyway=study.anyway), strict=True):
        if solver.knob != "h":
            continue
        steps = sorted(study.values.get(name, study.values["h"]))
        h = COARSER * steps[len(steps) // 2]
        try:
            defect = defect_of(ivp, _uncompiled(solver), h)
        except DaebenchError:
            defect = float("nan")
        rows.append({"key": work.key, "method": name, "h": h, "claimed": _claimed(solver, ivp), "defect": defect})
    return rows


def _uncompiled(solver: Any) -> Any:
    return Lifted(replace(solver.method, compiled=False)) if isinstance(solver, Lifted) else replace(solver, compiled=False)


def _claimed(solver: Any, ivp: Any) -> bool:
    return bool(solver.claims.symplectic if ivp.on_manifold else solver.is_poisson(ivp))

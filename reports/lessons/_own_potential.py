"""The lesson why-symplectic on a problem of the reader's: motions, symplectic areas and energy errors, computed in the page."""

import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from daebench.diagnostics.symplecticity import tangent_basis
from daebench.draw.figures import BLUE
from daebench.draw.methods import name_of, stroke_of
from daebench.errors import BadInput, positive
from daebench.methods.catalogue import find_problem
from daebench.methods.fixed_step.script import numbers, require_small, script, script_of_functions
from daebench.methods.initial_value_problem import initial_value_problem
from daebench.methods.names import parse
from daebench.pages.gallery import Asked
from daebench.pages.lesson.page import Content
from daebench.pages.report import Progress
from daebench.runs.ivp import Array, ConstrainedIvp
from daebench.runs.make_ivp import constrained
from daebench.runs.request import Request
from daebench.runs.trajectory import Trajectory
from daebench.studies.claims.measured_run import default_step

FREE = {"rattle": "Störmer-Verlet", "symplectic_euler": "symplectic Euler", "rk4": "RK4", "implicit_euler": "implicit Euler"}
CONSTRAINED = {
    "rattle": "RATTLE",
    "midpoint": "midpoint rule, reduced",
    "se": "symplectic Euler, reduced",
    "rk4": "RK4, reduced",
}
"""Methods, and their names on the page."""

MOST_CASES = 8


@dataclass(frozen=True)
class Posed:
    """A problem that the lesson can be on, its cases, and the step size at first."""

    ivp: ConstrainedIvp
    cases: dict[str, ConstrainedIvp]
    h: float
    asked: Asked

    @property
    def name(self) -> str:
        """The name on the page: that of the catalogue, or of the file."""
        return Path(self.asked.problem).stem

    @property
    def methods(self) -> Mapping[str, str]:
        """Names of the methods by name."""
        return CONSTRAINED if self.ivp.m else FREE


def posed(asked: Asked) -> Posed:
    """Return the problem of a lesson; BadInput is raised where the lesson would have nothing to show on it."""
    at_first = initial_value_problem(asked.problem, asked.case)
    ivp = constrained(at_first, "and the lesson why-symplectic needs H(p, q); take poisson-maps")
    if ivp.facts.EXTENDED or ivp.facts.FORCED:
        why = "H contains the time" if ivp.facts.EXTENDED and not ivp.facts.FORCED else "it has forces without a potential"
        raise BadInput(
            f"no method keeps energy and areas on {ivp.problem}, because {why}; give the lesson the problem without that.",
            "lesson-energy-and-areas",
        )
    require_small(ivp)
    if ivp.on_singular == "least-squares":
        raise BadInput(
            f"{ivp.problem} has redundant constraints, which a page does not solve; give the lesson a problem without them.",
            "lesson-of-redundant",
        )
    others = [initial_value_problem(asked.problem, name) for name in ivp.facts.CASES if name != ivp.case]
    same = [constrained(other) for other in others if other.source.key == ivp.source.key]
    cases = {case.case: case for case in (ivp, *same[: MOST_CASES - 1])}
    problem = Posed(ivp, cases, default_step(ivp, 1) if asked.h is None else positive("h", asked.h), asked)
    if refusal := next(filter(None, (parse(name).refusal(ivp) for name in problem.methods)), None):
        raise BadInput(f"the lesson why-symplectic cannot be on {problem.name}: {refusal}", "lesson-refuses-problem")
    return problem


def content(tell: Progress, problem: Posed, folder: Path) -> Content:
    """Return the content of the page, which computes all of its numbers itself."""
    ivp, h = problem.ivp, problem.h
    chosen, kernels = {name: parse(name) for name in problem.methods}, {}
    for k, (name, method) in enumerate(chosen.items()):
        kernels[name] = script(method, ivp, h, watch=("energy",), directions=2)
        tell((k + 1) / len(chosen), name_of(name))
    cases = {
        name: {
            "about": case.facts.CASES[name]["about"] if name in case.facts.CASES else "",
            "state": [float(x) for vector in case.start for x in vector],
            "sides": sides(case).T.tolist(),
            "problem": list(map(float, case.par)),
            "par": {method: numbers(chosen[method], case, h)["par"] for method in chosen},
        }
        for name, case in problem.cases.items()
    }
    across, up = plane(problem)
    colours = {name: stroke_of(name).color for name in chosen}
    data = {"cases": cases, "h": h, "axes": labels(ivp), "across": across, "up": up, "m": ivp.m}
    data |= {"names": problem.methods, "colours": colours}
    return Content(
        f"Why symplectic: {problem.name}",
        under=find_problem(problem.asked.problem).summary,
        scripts=kernels,
        functions=script_of_functions(ivp, ["g"]) if ivp.m else "{}",
        data=data,
        text=data | {"problem": problem.name, "d": ivp.d},
        notebook={
            "PROBLEM": place(problem.asked.problem, folder),
            "CASE": ivp.case,
            "METHODS": ", ".join(map(repr, chosen)),
            "STEP": f"{h:g}",
        },
    )


def labels(ivp: ConstrainedIvp) -> list[str]:
    """Return the names of the numbers of a state, momenta first."""
    return [*(f"p{k + 1}" for k in range(ivp.d)), *ivp.coordinates]


def sides(ivp: ConstrainedIvp) -> Array:
    """Return two tangent vectors of the manifold at the start, momenta first, with dq ^ dp = 1; shape(2d, 2)."""
    X = tangent_basis(ivp, ivp.p0, ivp.q0)
    p, q = X[: ivp.d], X[ivp.d :]
    # A bit of each tangent vector: a plane of few coordinates may be one that every method moves exactly.
    across = np.full(X.shape[1], X.shape[1] ** -0.5)
    conjugate = (q.T @ p - p.T @ q).T @ across
    return np.stack([X @ across, X @ conjugate / (conjugate @ conjugate)], axis=1)


def plane(problem: Posed) -> tuple[int, int]:
    """Return the places in a state, momenta first, of the two positions that move most, or of the only position and its momentum."""
    d = problem.ivp.d
    if d == 1:
        return 1, 0
    across, up = sorted(np.argsort(np.ptp(orbit(problem).q, axis=0))[-2:])
    return d + int(across), d + int(up)


def orbit(problem: Posed) -> Trajectory:
    """Return the first thousand steps of RATTLE."""
    run: Trajectory = parse("rattle").solve(problem.ivp, Request(value=problem.h, steps=1000, every=1, watch=()))
    return run


def thumbnail(axis: Any, problem: Posed) -> None:
    """Draw the first thousand steps of RATTLE in the plane that the page shows at first."""
    run, names = orbit(problem), labels(problem.ivp)
    across, up = plane(problem)
    states = np.hstack([run.p, run.q])
    axis.plot(states[:, across], states[:, up], color=BLUE, linewidth=1.0)
    axis.set_xlabel(names[across], loc="right")
    axis.set_ylabel(names[up], loc="top")
    axis.set_title(f"{problem.name}, {problem.ivp.case}", loc="left")


def place(problem: str, folder: Path) -> str:
    """Return a problem's name, or the path of its file from the folder of the page."""
    return Path(os.path.relpath(problem, folder)).as_posix() if Path(problem).suffix else problem

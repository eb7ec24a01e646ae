"""An exhaustive search for the cheapest run of an accuracy, made apart from ``daebench advise``, and how near its choices come to it.

    python tests/support/exhaustive_search.py results.jsonl planar_pendulum torus:through_hole --ends 10 100

Every method that takes a problem is run with step sizes or tolerances of a fine ladder: every fourth rung first, and all of those between
two rungs where an accuracy is reached from one to the next. Nothing is predicted, and no ladder is cut short before a run costs twice as
much as the cheapest one of the highest accuracy that the motion is known to. Errors are against heyoka's Taylor series at 2.2e-16, or
SciPy's DOP853 where it does not take the problem or does not reach its end, once the certified reference, or a second run by DOP853, agrees
with it. The price of a run is the sum of its exact work counts times what each costs, which is fitted to times of all runs of that method
on that problem.

Each method has a process of its own and the two minutes of an answer: methods of many stages on large mechanisms take longer to compile.

Results are kept, a line each, so that a search goes on where it was ended. ``--report`` says how often the choices of advice are within 1.5
times the cheapest, with the exact interval of that share, and lists the others. ``--answers FILE`` puts the answers, without the runs,
into a file that has those of earlier searches; ``exhaustive_answers.jsonl`` beside this file has those of all problems that have been
searched.
"""

import argparse
import json
import math
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from itertools import product
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import numpy as np
from scipy.optimize import nnls
from scipy.stats import beta

import daebench
from daebench.errors import DaebenchError
from daebench.methods.names import method_of
from daebench.reference.solution import certified_for
from daebench.runs.ivp import PoissonIvp
from daebench.runs.request import Request, WorkLimit

METHODS = (
    *("rattle/kahan_li8", "heyoka:taylor", "rattle/suzuki4", "rattle", "strang/kahan_li8", "strang/suzuki4", "strang", "symplectic_euler"),
    *("rattle/kahan_li6", "rattle/suzuki_umeno8", "rattle/triple_jump4", "lobatto3", "lobatto4", "lobatto5", "lobatto6", "lobatto2"),
    *("rk4", "rk4+proj", "gauss2", "gauss3", "gauss4", "local:rk4", "local:gauss2", "local:gauss3", "local:gauss4"),
    *("midpoint/kahan_li8", "midpoint/suzuki4", "midpoint", "verlet", "cvode:adams", "cvode:bdf", "radau2_ggl", "radau3_ggl"),
    *("generalized_alpha", "energy_momentum", "rattle_conformal", "ida:index2", "ida:index1", "ida:ggl", "ida:ode"),
    *("scipy:DOP853", "scipy:RK45", "solve_dae:Radau"),
)
"""All families, on every form of the equations: those come first that are likely to be cheap, so that others need not be followed far."""

GRID = 5040
"""Times at which the motion is known."""

LEAST_IN_COMMON = 24
"""Times that a run of many steps has in common with them, at least; one of fewer steps has all of its own."""

ACCURACIES = (1e-3, 1e-6, 1e-9)

STEPS = 2**20
"""Most steps of a run."""

CALLS = 200_000
"""Most calls of a run by tolerance."""

LIMIT = WorkLimit(10**6, 10**6, 1)
"""Most work of a run from which the motion is taken."""

STRIDE = 4
"""Rungs of a ladder from one run to the next, before those between them are tried."""

LOST = 5.0
"""A method whose runs fail is followed up to a run of so long, s; the first is compiled, and may take longer."""

TIMED = 8, 0.02
"""A run is timed so many times, and no longer than so long altogether, s; the best of its times counts."""

PATIENCE = 120.0
"""Longest time that the runs of a method on a problem may take with their compilation, s: a whole answer of advice may not take longer."""

FORK = get_context("fork")
"""How a process is made that has the motion already."""

EMPTY: dict[str, Any] = {"rows": [], "costs": {}}
"""The ladder of a method that does not take a problem."""

KEPT = ("problem", "case", "t_end", "accuracy", "known", "best", "choice", "ratio", "kept", "why")
"""What is kept of an answer."""

WITHIN = 1.5
"""Price over the cheapest up to which a choice is as good."""


def known_to(bound: float, accuracy: float) -> bool:
    """Return whether a motion that may be wrong by a bound can tell runs of an accuracy from others."""
    return bound <= accuracy / 3


@dataclass(frozen=True)
class Motion:
    """A problem, its motion at equidistant times, shape(GRID + 1, d), and what that may be wrong by."""

    ivp: Any
    t_end: float
    states: Any
    bound: float

    @property
    def sought(self) -> float:
        """The highest accuracy that the motion is known well enough for; infinity where there is none."""
        return min((accuracy for accuracy in ACCURACIES if known_to(self.bound, accuracy)), default=math.inf)

    def error(self, run: Any, count: int) -> float:
        """Return the largest error of a run that has stored ``count`` equidistant states and its start."""
        reached = part(self.ivp, run)
        if run.failure is not None or len(reached) != count + 1:
            return math.inf
        off = np.abs(reached - self.states[:: GRID // count])
        return float(np.max(off)) if np.all(np.isfinite(off)) else math.inf


def part(ivp: Any, run: Any) -> Any:
    """Return the states that accuracy is of."""
    return run.y if isinstance(ivp, PoissonIvp) else run.q


def states(ivp: Any, name: str, tol: float, t_end: float, points: int) -> Any:
    """Return what accuracy is of at equidistant times; None if a solver does not reach the end, or does not take the problem."""
    try:
        run = solver(ivp, name).solve(ivp, Request(value=tol, t_end=t_end, points=points, watch=(), work_limit=LIMIT))
    except DaebenchError:
        return None
    return None if run.failure else part(ivp, run)


def motion(ivp: Any, t_end: float) -> Motion:
    """Return the motion of a problem, computed twice."""
    taylor, other = "heyoka:taylor", "scipy:DOP853"
    exact, tol = states(ivp, taylor, 2.2e-16, t_end, GRID + 1), 2.5e-14
    if exact is None:
        exact, tol = states(ivp, other, 2.5e-14, t_end, GRID + 1), 3e-13
    if exact is None:
        raise DaebenchError("no solver that takes it reaches its end within a million calls")
    second = states(ivp, other, tol, t_end, 61)
    bounds = []
    if second is not None:
        bounds.append(10 * float(np.max(np.abs(second - exact[:: GRID // 60]))))
    reference = certified_for(ivp, t_end)
    if reference is not None:
        t = reference.t[reference.t <= t_end]
        number = t / t_end * GRID
        on_grid = np.abs(number - np.rint(number)) < 1e-6
        stored = reference.values["y" if isinstance(ivp, PoissonIvp) else "q"][: len(t)][on_grid]
        bounds.append(float(np.max(np.abs(stored - exact[np.rint(number[on_grid]).astype(int)]))))
    if not bounds:
        raise DaebenchError("its motion is known once only")
    return Motion(ivp, t_end, exact, min(bounds))


def solver(ivp: Any, name: str) -> Any:
    """Return a method that may run."""
    method = method_of(ivp, name, anyway=True) if isinstance(ivp, PoissonIvp) else method_of(ivp, name)
    if why := method.refusal(ivp):
        raise DaebenchError(why)
    return method


def step_counts() -> list[tuple[int, int]]:
    """Return numbers of steps, coarse to fine and about a tenth apart, each with the number of its times that are compared."""
    few = [(n, n) for n in range(6, 72) if GRID % n == 0]
    numbers, n = few, 72
    while n < STEPS:
        numbers.append((n, max(k for k in range(LEAST_IN_COMMON, 73) if n % k == 0 and GRID % k == 0)))
        n = 24 * math.ceil(1.12 * n / 24 + 1e-9)
    return numbers


def timed(method: Any, ivp: Any, asked: Request) -> tuple[float, dict[str, int]]:
    """Return the least time of a run that keeps nothing, s, and its work."""
    began, best, work = time.process_time(), math.inf, {}
    for k in range(TIMED[0]):
        run = method.solve(ivp, replace(asked, watch=(), count=k == 0, **({"every": 0} if method.knob == "h" else {"points": 2})))
        work = work or dict(run.work) | {"steps": run.steps}
        spent = time.process_time() - began
        if k or run.seconds > TIMED[1]:  # the first of short runs warms up
            best = min(best, run.seconds)
        if run.seconds > TIMED[1] or (k > 1 and spent > TIMED[1]):
            break
    return best, work


def ladder(where: Motion, name: str, cheapest: float) -> list[dict[str, Any]]:
    """Return the runs of a method, until one is as accurate as is sought or costs twice as much as the cheapest that is."""
    method, rows = solver(where.ivp, name), {}
    if method.knob == "h":
        rungs = [(where.t_end / n, {"steps": n, "every": n // k}, k) for n, k in step_counts()]
    else:
        rungs = [(float(f"{10 ** (-k / 5):.3g}"), {"t_end": where.t_end, "points": 61}, 60) for k in range(5, 70)]
    least, before = math.inf, 0
    for k in range(0, len(rungs), STRIDE):
        began = time.process_time()
        if (row := rung(where, method, *rungs[k])) is None:
            if k and time.process_time() - began > LOST:
                break
            continue
        rows[k] = row
        if any(row["error"] <= accuracy < least for accuracy in ACCURACIES):
            rows |= {j: one for j in range(before + 1, k) if (one := rung(where, method, *rungs[j])) is not None}
        least, before = min(least, row["error"]), k
        if row["error"] <= where.sought or row["seconds"] > 2.0 * cheapest:
            break
    return [rows[k] for k in sorted(rows)]


def rung(where: Motion, method: Any, value: float, asked: dict[str, Any], count: int) -> dict[str, Any] | None:
    """Return the error of a run, its time and its work; None where it fails."""
    request = Request(value=value, watch=(), work_limit=None if method.knob == "h" else WorkLimit(CALLS, CALLS + 1, 1), **asked)
    try:
        with np.errstate(all="ignore"):
            error = max(where.error(method.solve(where.ivp, request), count), where.bound)
    except DaebenchError:
        return None
    if not math.isfinite(error):
        return None
    seconds, work = timed(method, where.ivp, request)
    return {"value": value, "error": error, "seconds": seconds, "work": work}


def prices(rows: list[dict[str, Any]]) -> dict[str, float]:
    """Return what each kind of work costs, s, and a start, "": the non-negative costs whose sums are nearest to times of runs in ratio."""
    kinds = sorted({kind for row in rows for kind in row["work"]})
    counts = np.array([[1.0, *(row["work"].get(kind, 0) for kind in kinds)] for row in rows])
    seconds = np.array([row["seconds"] for row in rows])
    costs, _ = nnls(counts / seconds[:, None], np.ones(len(rows)))
    return dict(zip(["", *kinds], costs.tolist(), strict=True))


def price(row: dict[str, Any], costs: dict[str, float]) -> float:
    """Return what a run costs, s."""
    return costs[""] + sum(costs.get(kind, 0.0) * count for kind, count in row["work"].items())


def searched(ivp: Any, t_end: float, known: dict[str, Any], keep: Callable[[dict[str, Any]], None]) -> dict[str, Any]:
    """Return the ladders of all methods; those that are not ``known`` are made and kept, one by one."""
    about = {"problem": ivp.problem, "case": ivp.case, "t_end": t_end}
    if "" in known and set(METHODS) <= set(known):
        return about | known.pop("") | {"ladders": known}
    try:
        where = motion(ivp, t_end)
    except DaebenchError as error:
        return about | {"bound": None, "why": str(error)}
    if math.isinf(where.sought):
        return about | {"bound": where.bound, "why": f"its motion is known to {where.bound:.1e} only"}
    if "" not in known:
        known[""] = {"bound": where.bound}
        keep(about | {"method": "", **known[""]})
    cheapest = math.inf
    for name in METHODS:
        if name not in known:
            print(f"{ivp.problem} to {t_end:g} s: {name}", file=sys.stderr, flush=True)
            known[name] = bounded(where, name, cheapest)
            keep(about | {"method": name, **known[name]})
        rows = known[name]["rows"]
        if rows and rows[-1]["error"] <= where.sought:
            cheapest = min(cheapest, rows[-1]["seconds"])
    return about | known.pop("") | {"ladders": known}


def bounded(where: Motion, name: str, cheapest: float) -> dict[str, Any]:
    """Return the ladder of a method, made in a process of its own; empty, with the reason, after :data:`PATIENCE`."""
    receiver, sender = FORK.Pipe(duplex=False)
    process = FORK.Process(target=lambda: sender.send(climbed(where, name, cheapest)))
    process.start()
    sender.close()
    try:
        return dict(receiver.recv()) if receiver.poll(PATIENCE) else EMPTY | {"why": f"it takes longer than {PATIENCE:g} s"}
    except EOFError:
        return EMPTY | {"why": "its process was lost"}
    finally:
        process.kill()
        process.join()


def climbed(where: Motion, name: str, cheapest: float) -> dict[str, Any]:
    """Return the ladder of a method with what its work costs; empty where the method does not take the problem."""
    try:
        rows = ladder(where, name, cheapest)
    except DaebenchError:
        rows = []
    return {"rows": rows, "costs": prices(rows)} if rows else EMPTY


def answered(search: dict[str, Any], accuracy: float) -> dict[str, Any]:
    """Return what advice says to a question, and its price over the cheapest; it is not asked where the motion is not known well enough."""
    about = {key: search[key] for key in ("problem", "case", "t_end")} | {"accuracy": accuracy}
    known = search["bound"] is not None and known_to(search["bound"], accuracy)
    candidates = [
        (price(row, found["costs"]), name, row)
        for name, found in search.get("ladders", {}).items()
        for row in found["rows"]
        if row["error"] <= accuracy
    ]
    best = min(candidates, default=None, key=lambda one: one[0])
    about |= {"known": known, "best": None if best is None else {"method": best[1], "price": best[0], **best[2]}}
    if not known:
        return about | {"choice": None, "why": search.get("why", "the motion is not known well enough, and advice is not asked")}
    try:
        advice = daebench.advise(search["problem"], case=search["case"], accuracy=accuracy, t_end=search["t_end"], starts=4, share=0)
    except DaebenchError as error:
        return about | {"choice": None, "why": str(error)}
    if advice.choice is None:
        return about | {"choice": None, "why": advice.why}
    choice, ivp = advice.choice, daebench.initial_value_problem(search["problem"], search["case"])
    method = solver(ivp, choice.method)
    seconds, work = timed(method, ivp, Request(value=choice.value, t_end=search["t_end"]))
    row = {"value": choice.value, "error": choice.error, "seconds": seconds, "work": work}
    found = search.get("ladders", {}).get(choice.method)
    paid = price(row, prices([*found["rows"], row])) if found else seconds
    ratio = None if best is None else paid / best[0]
    kept = {name: kept.value for name, kept in advice.kept.items() if kept.kept}
    return about | {"choice": {"method": choice.method, "price": paid, **row}, "ratio": ratio, "kept": kept, "others": advice.left_out}


def report(answers: list[dict[str, Any]]) -> str:
    """Return how often choices are within :data:`WITHIN` times the cheapest, and which are not."""
    known = [one for one in answers if one["known"] and one["best"] is not None]
    told = [one for one in known if one["choice"]]
    hits = [one for one in told if one["ratio"] <= WITHIN]
    lines = [f"{len(answers)} questions, {len(known)} with a reference that is good enough and a run that reaches the accuracy"]
    lines.append(f"answered: {len(told)} of {len(known)}, {_share(len(told), len(known))}")
    lines.append(f"within {WITHIN:g} of the cheapest: {len(hits)} of {len(told)}, {_share(len(hits), len(told))}")
    for one in known:
        if one not in hits:
            asked = f"{one['problem']}-{one['case']} {one['accuracy']:g} to {one['t_end']:g} s"
            best = f"{one['best']['method']} {one['best']['value']:.3g}: {1e6 * one['best']['price']:.3g} us"
            said = f"{one['choice']['method']} {one['choice']['value']:.3g}, {one['ratio']:.2f} times" if one["choice"] else one["why"]
            lines.append(f"  {asked}: {said}; cheapest {best}")
    return "\n".join(lines)


def _share(k: int, n: int) -> str:
    """Return a share with its exact interval of 95 %."""
    if not n:
        return "no share"
    low = 0.0 if k == 0 else beta.ppf(0.025, k, n - k + 1)
    high = 1.0 if k == n else beta.ppf(0.975, k + 1, n - k)
    return f"{100 * k / n:.0f} % [{100 * low:.0f}, {100 * high:.0f}]"


def keep_answers(answers: list[dict[str, Any]], path: Path) -> None:
    """Put answers into a file, a line each, in place of what is there about the same questions."""
    before = [json.loads(line) for line in path.read_text().splitlines()] if path.exists() else []
    every = {(*question(one), one["accuracy"]): {key: one[key] for key in KEPT if key in one} for one in [*before, *answers]}
    path.write_text("".join(json.dumps(every[key]) + "\n" for key in sorted(every)))


def question(one: dict[str, Any]) -> tuple[Any, ...]:
    """Return what a kept line is about."""
    return one["problem"], one["case"], one["t_end"]


def main() -> None:
    """Search, ask, and report."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("results", type=Path)
    parser.add_argument("problems", nargs="*", help="PROBLEM or PROBLEM:CASE")
    parser.add_argument("--ends", nargs="*", type=float, default=[10.0, 100.0])
    parser.add_argument("--again", action="store_true", help="ask advice again where it has answered")
    parser.add_argument("--search", action="store_true", help="search alone, without asking")
    parser.add_argument("--report", action="store_true", help="report alone")
    parser.add_argument("--answers", type=Path, help="file to put the answers into")
    options = parser.parse_args()
    kept = [json.loads(line) for line in options.results.read_text().splitlines()] if options.results.exists() else []
    answers = {(*question(one), one["accuracy"]): one for one in kept if "accuracy" in one}
    ladders: dict[tuple[Any, ...], dict[str, Any]] = {}
    for one in kept:
        if "accuracy" not in one:
            ladders.setdefault(question(one), {})[one["method"]] = one
    with options.results.open("a") as file:
        for t_end, name in [] if options.report else product(options.ends, options.problems):
            problem, _, case = name.partition(":")
            ivp = daebench.initial_value_problem(problem, case or None)
            search = searched(
                ivp, t_end, ladders.get((problem, ivp.case, t_end), {}), lambda one: print(json.dumps(one), file=file, flush=True)
            )
            for accuracy in () if options.search else ACCURACIES:
                if options.again or (*question(search), accuracy) not in answers:
                    answers[*question(search), accuracy] = one = answered(search, accuracy)
                    print(json.dumps(one), file=file, flush=True)
                    print(report([one]), flush=True)
    if options.answers:
        keep_answers(list(answers.values()), options.answers)
    print(report(list(answers.values())))


if __name__ == "__main__":
    main()

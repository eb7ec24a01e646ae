"""Measurements of the report on engines: each contender is tuned, run over step sizes, timed, run for a long time, and stored."""

import hashlib
import inspect
import json
import sys
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pandas as pd

from daebench.diagnostics.drift import FAILED
from daebench.diagnostics.energy_verdict import energy_verdict
from daebench.diagnostics.order import fit_order
from daebench.methods.names import method_of
from daebench.pages.report.page import Progress
from daebench.reports.engines import contender as contender_module
from daebench.reports.engines import motions as motions_module
from daebench.reports.engines.adapters import ENGINES, Engine
from daebench.reports.engines.contender import Contender, halved
from daebench.reports.engines.documentation import sentences_of
from daebench.reports.engines.motions import BY_KEY, MOTIONS, T_END, Motion, compared, reference_of
from daebench.runs.files import atomic, make_folder
from daebench.runs.machine import machine
from daebench.runs.request import Request
from daebench.runs.trajectory import Trajectory

REPEAT = 3
"""Number of runs, of which the shortest time is taken."""

FEWEST, BEYOND = 3, 5.0
"""A sweep ends with the first run beyond the budget, but has at least so many runs, unless one takes so many times the budget."""

OWN = "daebench"

RATTLE, IDA, KAHAN = "rattle", "ida:ggl", "rattle/kahan_li8"
"""Methods of daebench that are compared with the engines: of order two, with a tolerance, and of order eight."""


@dataclass(frozen=True)
class Numbers:
    """Numbers of the report."""

    runs: pd.DataFrame
    """One row per run: motion, engine, setting, variant, constrained, knob, value, error, bound, g, Gv, energy_error, seconds, failure."""
    chosen: pd.DataFrame
    """One row per contender and motion: the most accurate of its runs within the budget, with the energy's verdict and order."""
    tuned: pd.DataFrame
    """One row per variant: its error at one step size, and whether it was chosen."""
    sentences: pd.DataFrame
    """One row per statement of a documentation: engine, place, sentence, measured, holds."""
    engines: tuple[Engine, ...]
    """Engines that ran."""


def own(motions: Sequence[Motion]) -> list[Contender]:
    """Return daebench's own methods as contenders, which :func:`solved` runs without an adapter."""
    first = {"top": 1 / 512, "chain100": 1 / 32}
    entries = []
    for motion in motions:
        entries.append(Contender(OWN, RATTLE, motion.key, "h", halved(first.get(motion.key, 1 / 16), 16), _unused))
        entries.append(Contender(OWN, KAHAN, motion.key, "h", halved(first.get(motion.key, 1 / 16), 12), _unused))
        entries.append(Contender(OWN, IDA, motion.key, "tol", tuple(10.0**-k for k in range(3, 13)), _unused))
    return entries


def _unused(*_: Any) -> Any:
    raise NotImplementedError


def solved(contender: Contender, motion: Motion, value: float, t_end: float, *, outputs: bool) -> Trajectory:
    """Return a run of a contender, with all outputs and monitors, or bare, for its time."""
    spacing = (max(motion.spacing, value) if contender.knob == "h" else motion.spacing) if outputs else t_end
    watch = motion.ivp.state.monitors if outputs else ()
    if contender.engine != OWN:
        run = contender.method(value).solve(motion.ivp, Request(value=spacing, steps=round(t_end / spacing), every=1, watch=watch))
        assert isinstance(run, Trajectory)
        return run
    every, points = (round(spacing / value), None) if contender.knob == "h" else (None, round(t_end / spacing) + 1)
    request = Request(value=value, t_end=t_end, every=every, points=points, watch=watch, count=False)
    run = method_of(motion.ivp, contender.setting).solve(motion.ivp, request)
    assert isinstance(run, Trajectory)
    return run


def error_of(motion: Motion, run: Trajectory) -> float:
    """Return the largest error of a position at the end, at least the error bound of the reference; NaN for a run that stopped."""
    if run.failure:
        return float("nan")
    known = reference_of(motion.key)
    return max(known.bound, float(np.max(np.abs(compared(motion, run.q[-1]) - known.value))))


def tuned(contender: Contender) -> tuple[Contender, str, list[dict[str, Any]]]:
    """Return a contender with its most accurate variant at the middle of its step sizes, the variant's name, and the error of each."""
    if not contender.variants:
        return contender, "", []
    motion, value = BY_KEY[contender.motion], contender.values[len(contender.values) // 2]
    errors = {
        name: error_of(motion, solved(replace(contender, run=run), motion, value, T_END, outputs=False))
        for name, run in contender.variants.items()
    }
    best = min(errors, key=lambda name: (np.isnan(errors[name]), errors[name]))
    about = {"motion": contender.motion, "engine": contender.engine, "setting": contender.setting, "value": value}
    rows = [about | {"variant": name, "error": error, "taken": name == best} for name, error in errors.items()]
    return replace(contender, run=contender.variants[best]), best, rows


def swept(contender: Contender, variant: str) -> list[dict[str, Any]]:
    """Return one row for each step size or tolerance of a contender, until a run takes too long."""
    motion, rows = BY_KEY[contender.motion], []
    for value in contender.values:
        run = solved(contender, motion, value, T_END, outputs=True)
        row = {
            "motion": motion.key,
            "engine": contender.engine,
            "setting": contender.setting,
            "variant": variant,
            "constrained": contender.constrained,
            "knob": contender.knob,
            "value": value,
            "error": error_of(motion, run),
            "bound": reference_of(motion.key).bound,
            **{name: run.maxima.get(name, np.nan) for name in ("g", "Gv")},
            "energy_error": run.maxima.get("energy", np.nan),
            "seconds": timed(contender, motion, value, run),
            "failure": run.failure or "",
        }
        rows.append(row)
        if run.seconds > motion.budget * (1.0 if len(rows) >= FEWEST else BEYOND):
            break
    return rows


def timed(contender: Contender, motion: Motion, value: float, run: Trajectory) -> float:
    """Return the shortest time of stepping over some runs with output at the end only; if far too long, the time of the run itself."""
    if run.failure or run.seconds > BEYOND * motion.budget:
        return float("nan") if run.failure else run.seconds
    return min(solved(contender, motion, value, T_END, outputs=False).seconds for _ in range(REPEAT))


def at_equal_cost(rows: pd.DataFrame, budget: float) -> dict[str, Any]:
    """Return the most accurate run within a budget of seconds; if there is none, the cheapest, and if all failed, the last."""
    done = rows[rows["failure"] == ""]
    within = done[done["seconds"] <= budget]
    ranked = within.sort_values("error") if len(within) else done.sort_values("seconds") if len(done) else rows.iloc[::-1]
    return {str(name): value for name, value in ranked.iloc[0].items()}


def summary(contender: Contender, rows: pd.DataFrame) -> dict[str, Any]:
    """Return the row of a contender: its run at equal cost, the verdict on its energy over the long horizon, and its order."""
    motion = BY_KEY[contender.motion]
    row = at_equal_cost(rows, motion.budget)
    row |= {"order": np.nan, "order_error": np.nan, "verdict": FAILED, "law": "", "reason": row["failure"], "least": rows["error"].min()}
    row["within"] = bool(row["seconds"] <= motion.budget)
    if row["failure"]:
        return row
    slow = row["seconds"] > BEYOND * motion.budget
    long = solved(contender, motion, float(row["value"]), T_END if slow else motion.long, outputs=True)
    drift = energy_verdict(motion.ivp, long)
    row |= {"verdict": drift.verdict, "law": drift.words, "reason": long.failure or drift.reason}
    if contender.knob == "h":
        fit = fit_order(rows["value"], rows["error"], floor=float(rows["bound"].iloc[0]))
        row |= {"order": fit.slope, "order_error": fit.slope_error}
    return row


def key_of(contender: Contender, version: str, *modules: ModuleType) -> str:
    """Return the digest of all that determines the numbers of a contender: its setting, the engine's version, the machine, the code."""
    sources = [inspect.getsource(module) for module in (contender_module, motions_module, *modules)]
    parts = [contender.name, contender.motion, repr(contender.values), version, machine(), *sources]
    return hashlib.sha256("\n".join(parts).encode()).hexdigest()[:32]


def stored(folder: Path, key: str) -> dict[str, Any] | None:
    """Return the measurements of a contender, None if there are none or its file is damaged."""
    path = folder / f"{key}.json"
    try:
        measurements: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return None
    return measurements


def store(folder: Path, key: str, measurements: dict[str, Any]) -> None:
    """Store the measurements of a contender atomically."""
    make_folder(folder)
    with atomic(folder / f"{key}.json") as scratch:
        scratch.write_text(json.dumps(measurements, default=lambda number: number.item()), encoding="utf-8")


def measured(contender: Contender, engine: Engine | None, folder: Path | None) -> dict[str, Any]:
    """Return the measurements of a contender: its runs, its row at equal cost, and its variants; from a folder if they are stored there."""
    code = [sys.modules[__name__], *([engine.adapter] if engine else [])]
    key = key_of(contender, engine.version if engine else "", *code) if folder else ""
    if folder and (measurements := stored(folder, key)):
        return measurements
    ready, variant, variants = tuned(contender)
    rows = swept(ready, variant)
    result = {"rows": rows, "chosen": summary(ready, pd.DataFrame(rows)), "variants": variants}
    if folder:
        store(folder, key, result)
    return result


def entrants(motions: Sequence[Motion], engines: Sequence[Engine]) -> list[tuple[Contender, Engine | None]]:
    """Return all contenders on these motions, daebench's own first, each with its engine."""
    keys = {motion.key for motion in motions}
    pairs: list[tuple[Contender, Engine | None]] = [(entry, None) for entry in own(motions)]
    return pairs + [(entry, engine) for engine in engines for entry in engine.adapter.contenders() if entry.motion in keys]


def measure(
    tell: Progress, folder: Path | None = None, motions: Sequence[Motion] = MOTIONS, engines: Sequence[Engine] = ENGINES
) -> Numbers:
    """Return the numbers for the installed engines; without any engine there are none."""
    present = tuple(engine for engine in engines if engine.installed)
    if not present:
        return Numbers(pd.DataFrame(), pd.DataFrame(), pd.DataFrame(), pd.DataFrame(), ())
    pairs, results = entrants(motions, present), []
    for k, (entrant, engine) in enumerate(pairs):
        tell(0.95 * k / len(pairs), f"{entrant.name} on {entrant.motion}")
        results.append(measured(entrant, engine, folder))
    tell(0.95, "documentation")
    said = [sentence for engine in present for sentence in sentences_of(engine.name)]
    runs = pd.DataFrame([row for result in results for row in result["rows"]])
    variants = pd.DataFrame([row for result in results for row in result["variants"]])
    return Numbers(runs, pd.DataFrame([result["chosen"] for result in results]), variants, pd.DataFrame(said), present)

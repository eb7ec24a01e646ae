"""Results of each method on each problem: whether it reaches the end, stays on the manifold and keeps the energy."""

import re
from collections.abc import Mapping
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.colors import BoundaryNorm, ListedColormap

from daebench.diagnostics.drift import LAWS
from daebench.draw.figures import BLACK, QUIET, grid_of_axes, save
from daebench.draw.methods import name_of
from daebench.pages.report import NONE, TIMES, count, number
from daebench.pages.report.claims import require
from daebench.pages.report.tables import Of, Table, code, finite, once, tiny
from daebench.reports.problems.runs import METHODS, ROUND_OFF

NO_DRIFT = ("bounded", "kept")


def check_runs(runs: pd.DataFrame) -> SimpleNamespace:
    """Test that methods that claim to stay on the manifold do so wherever they reach the end; return the other counts of the text."""
    ran = runs[runs["end"] == "reached"]
    for row in ran[ran["claims_manifold"].astype(bool)].to_dict("records"):
        where = f"{row['method']} stays on the manifold of {row['problem']}"
        require(row["g"] <= row["g_rounding"] and row["Gv"] <= row["Gv_rounding"], where, (row["g"], row["Gv"]))
    rattle_runs = ran[ran["method"] == "rattle"]
    runs_with_integrals = rattle_runs[rattle_runs["integrals"].notna()]
    good = runs_with_integrals["integrals"] <= ROUND_OFF
    return SimpleNamespace(
        problems=runs["problem"].nunique(),
        methods=runs["method"].nunique(),
        runs=(runs["end"] != "not run").sum(),
        left_out=(runs["end"] == "not run").sum(),
        reached=len(ran),
        refused=(runs["end"] == "refused").sum(),
        stopped=(runs["end"] == "stopped").sum(),
        decided=ran["kind"].isin((*NO_DRIFT, *LAWS)).mean(),
        rattle_reached=len(rattle_runs),
        rattle_quiet=rattle_runs["kind"].isin(NO_DRIFT).sum(),
        rattle_open=(~rattle_runs["kind"].isin((*NO_DRIFT, *LAWS))).sum(),
        rattle_other=list(rattle_runs["problem"][rattle_runs["kind"].isin(LAWS)]),
        with_integrals=len(runs_with_integrals),
        keeps=list(runs_with_integrals["problem"][good]),
        loses=list(runs_with_integrals["problem"][~good]),
        on_manifold=ran[ran["claims_manifold"].astype(bool)]["g"].max(),
        table=across(runs),
    )


def at_most(frame: pd.DataFrame, column: str) -> dict[Any, Any] | None:
    """Return the row in which a column is largest, None if there are no rows."""
    return frame.iloc[int(frame[column].to_numpy().argmax())].to_dict() if len(frame) else None


def across(runs: pd.DataFrame) -> pd.DataFrame:
    """Return one row per method: on how many problems it reached the end, kept the manifold and had no drift of the energy."""
    rows = []
    for name in METHODS:
        method_runs = runs[(runs["method"] == name) & (runs["end"] != "not run")]
        if method_runs.empty:
            continue
        done = method_runs[method_runs["end"] == "reached"]
        on = (done["g"] <= done["g_rounding"]) & (done["Gv"] <= done["Gv_rounding"])
        row: dict[str, Any] = {"family": method_runs["family"].iloc[0], "method": name, "asked": len(method_runs), "reached": len(done)}
        row |= {"refused": int((method_runs["end"] == "refused").sum()), "stopped": int((method_runs["end"] == "stopped").sum())}
        row |= {"manifold": int(on.sum()), "bounded": int(done["kind"].isin(NO_DRIFT).sum())}
        rows.append(row | {"least": done["energy"].min(), "median": done["energy"].median(), "most": done["energy"].max()})
    return pd.DataFrame(rows)


def per_problem(runs: pd.DataFrame) -> dict[str, SimpleNamespace]:
    """Return the numbers of the text on each problem."""
    summaries = {}
    for problem, problem_runs in runs.groupby("problem", sort=False):
        done = problem_runs[problem_runs["end"] == "reached"]
        h = done[done["knob"] == "h"]
        best = at_most(h.assign(kept=-h["energy"]), "kept")
        quiet, drifting = (list(done["method"][done["kind"].isin(kinds)]) for kinds in (NO_DRIFT, LAWS))
        short = {end: problem_runs[problem_runs["end"] == end].to_dict("records") for end in ("stopped", "refused")}
        left = {
            why: list(skipped_runs["method"])
            for why, skipped_runs in problem_runs[problem_runs["end"] == "not run"].groupby("why", sort=False)
        }
        summaries[str(problem)] = SimpleNamespace(best=best, quiet=quiet, drifting=drifting, left_out=left, reached=len(done), **short)
    return summaries


SIZES = (1e-12, 1e-10, 1e-8, 1e-6, 1e-4, 1e-2, 1.0)
"""Energy errors at which colours change, relative to the largest kinetic energy."""


COLORS = ("#fffdf0", "#fff1b3", "#fed976", "#feb24c", "#fd8d3c", "#e8601c", "#a63603", "#5c1d00")
"""Colours from small errors to large ones."""


DARK = 1e-4
"""Error from which on signs are white."""


def draw_heat_map(runs: pd.DataFrame, folder: Path) -> Path:
    """Draw a square for each pair of problem and method; return the path of the SVG.

    Parameters
    ----------
    runs : DataFrame
        One row per pair: problem, method, end, energy, kind.
    folder : Path
        Folder of the figures.
    """
    problems, methods = (list(dict.fromkeys(runs[name])) for name in ("problem", "method"))
    table = runs.set_index(["method", "problem"])["energy"].unstack().reindex(index=methods, columns=problems)
    figure, axes = grid_of_axes(1, 1, 1.6 + 0.2 * len(methods))
    axis = axes[0, 0]
    norm = BoundaryNorm(SIZES, len(COLORS), extend="both")
    mesh = axis.pcolormesh(table.to_numpy(dtype=float), cmap=ListedColormap(COLORS), norm=norm, edgecolors="white", linewidth=0.8)
    for row in runs.to_dict("records"):
        _sign(axis, problems.index(row["problem"]) + 0.5, methods.index(row["method"]) + 0.5, row)
    axis.set_xticks(np.arange(len(problems)) + 0.5, [name.replace("_", " ") for name in problems], rotation=40, ha="left")
    axis.set_yticks(np.arange(len(methods)) + 0.5, [name_of(name) for name in methods])
    axis.xaxis.tick_top()
    axis.tick_params(length=0)
    axis.grid(visible=False)
    axis.spines[:].set_visible(False)
    axis.invert_yaxis()
    bar = figure.colorbar(mesh, ax=axis, orientation="horizontal", shrink=0.6, aspect=40, pad=0.02, ticks=SIZES)
    bar.ax.set_xticks(SIZES, [f"$10^{{{round(np.log10(size))}}}$" for size in SIZES])
    bar.set_label("largest energy error / largest kinetic energy")
    return save(figure, folder, "heat_map", runs[[name for name in SHOWN if name in runs]])


SHOWN = ("problem", "method", "end", "energy", "kind", "length", "doubt")
"""Columns of the data beside the picture."""


def _sign(axis: Any, x: float, y: float, row: dict[Any, Any]) -> None:
    """Draw the sign of a square: a drift, a run that stopped, a refusal."""
    if row["end"] == "reached":
        sign = "/" if row["kind"] in LAWS else "" if row["kind"] in NO_DRIFT else "?"
    else:
        sign = {"refused": NONE, "not run": ""}.get(row["end"], TIMES)
    energy = row["energy"]
    color = QUIET if not np.isfinite(energy) else "white" if energy >= DARK else BLACK
    axis.text(x, y, sign, ha="center", va="center", color=color, fontsize=9)


def across_table(frame: pd.DataFrame) -> Table:
    """Return the results of each method on all problems together."""
    return Table(
        frame.assign(group=once(frame["family"])),
        {
            "method": code,
            "group": "family",
            "asked": (count, "problems"),
            "refused": (count, "refuses"),
            "stopped": (count, "stops"),
            "reached": (count, "reaches<small>the end</small>"),
            "manifold": (count, "on the<small>manifold</small>"),
            "bounded": (count, "energy<small>no drift</small>"),
            "median": (number, "energy error<small>median</small>"),
            "most": (number, "<small>largest</small>"),
        },
        frame,
    )


def runs_table(frame: pd.DataFrame) -> Table:
    """Return the results of each method on one problem; a reason takes the place of numbers if there is no full run."""
    columns = {
        "method": code,
        "became": (Of(outcome), "run"),
        "energy": (number, "energy<small>error</small>"),
        "trend": (Of(trend), "<small>which is</small>"),
        "g": (finite(tiny), "|<i>g</i>|"),
        "Gv": (finite(tiny), "|<i>G H<sub>p</sub></i>|"),
        "integrals": (finite(tiny), "integrals<small>error</small>"),
        **dict.fromkeys(("steps", "evaluations", "solves"), finite(count)),
    }
    if frame.get("integrals", pd.Series(dtype=float)).isna().all():
        del columns["integrals"]
    measured = [name for name in columns if name not in ("method", "became", "trend")]
    shown = frame.reindex(columns=list(dict.fromkeys([*frame.columns, *measured])))
    return Table(shown, columns, frame.dropna(axis="columns", how="all"))


def trend(row: Mapping[Any, Any]) -> str:
    """Return the verdict on the energy, with the length of the run that decides it where that is longer."""
    if not isinstance(row.get("kind"), str):
        return NONE
    return row["kind"] if row["length"] == 1 else f"{row['kind']} ({row['length']:g} {TIMES} as long)"


def outcome(row: Mapping[Any, Any]) -> str:
    """Return how a run ended, in a few words."""
    if row["end"] == "reached":
        return "complete" if not row.get("branches") or pd.isna(row["branches"]) else f"complete; {row['branches']}"
    if row["end"] == "refused":
        return "refuses"
    if row["end"] == "not run":
        return "not run"
    return f"stops at {row['t']:.3g}"


def reason(row: Mapping[Any, Any]) -> str:
    """Return why a run ended early or was refused: the sentence without name, case, residual and advice."""
    sentence = re.sub(r", residual [^;,]*?(?=[;,.]*$|[;,])", "", str(row["why"]))
    sentence = re.sub(r"; (to go on|use|remove|start|which)\b.*$", "", sentence).rstrip(".")
    cause = re.sub(r"^.*?\((?:step|tol)[^)]*\): ", "", sentence)
    return cause if cause != sentence else re.sub(r"^\S+ (on|cannot start on) [^:]*?: ", "", sentence)

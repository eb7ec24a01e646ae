"""Claims of the report on problems, tested on the numbers before they are printed."""

from types import SimpleNamespace
from typing import Any

import pandas as pd

from daebench.diagnostics.drift import LAWS
from daebench.pages.report.claims import require
from daebench.reports.problems.numbers import Numbers
from daebench.reports.problems.runs import METHODS, ROUND_OFF

NO_DRIFT = ("bounded", "kept")
ON_PATH = 1e-9
"""A drawn path whose constraint residual is below this satisfies its constraints."""

PASSING = ("rattle", "lobatto3")
"""Methods that, according to the text, pass a loss of rank on the same branch."""


def check(numbers: Numbers) -> SimpleNamespace:
    """Return the numbers of the text; the first sentence that does not hold raises ClaimRefuted."""
    check_drawings(numbers)
    return SimpleNamespace(across=check_runs(numbers.runs), rank=check_rank(numbers), per=per_problem(numbers.runs))


def check_drawings(numbers: Numbers) -> None:
    """Test that every problem has a drawing, and that the drawn path is on the manifold."""
    for problem in numbers.facts:
        require(problem.name in numbers.drawings, f"there is a picture of {problem.name}", "none declared")
        require(
            numbers.drawings[problem.name].off <= ON_PATH, f"the path of {problem.name} satisfies g = 0", numbers.drawings[problem.name].off
        )


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
        runs=int((runs["end"] != "not run").sum()),
        left_out=int((runs["end"] == "not run").sum()),
        reached=len(ran),
        refused=int((runs["end"] == "refused").sum()),
        stopped=int((runs["end"] == "stopped").sum()),
        rattle_reached=len(rattle_runs),
        rattle_quiet=int(rattle_runs["kind"].isin(NO_DRIFT).sum()),
        rattle_open=int((~rattle_runs["kind"].isin((*NO_DRIFT, *LAWS))).sum()),
        rattle_other=list(rattle_runs["problem"][rattle_runs["kind"].isin(LAWS)]),
        with_integrals=len(runs_with_integrals),
        keeps=list(runs_with_integrals["problem"][good]),
        loses=list(runs_with_integrals["problem"][~good]),
        on_manifold=float(ran[ran["claims_manifold"].astype(bool)]["g"].max()),
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
        off = at_most(done, "g")
        drifting = list(done["method"][done["kind"].isin(LAWS)])
        short = {end: problem_runs[problem_runs["end"] == end].to_dict("records") for end in ("stopped", "refused")}
        left = {
            why: list(skipped_runs["method"])
            for why, skipped_runs in problem_runs[problem_runs["end"] == "not run"].groupby("why", sort=False)
        }
        summaries[str(problem)] = SimpleNamespace(best=best, off=off, drifting=drifting, left_out=left, reached=len(done), **short)
    return summaries


def check_rank(numbers: Numbers) -> SimpleNamespace:
    """Test that every method that is set to stop does so before G loses rank and says so, and which branch RATTLE and Lobatto take."""
    rows = numbers.rank
    for row in rows[rows["mode"] == "stop"].to_dict("records"):
        t, who = numbers.losses[row["problem"]], f"{row['method']} on {row['problem']}"
        require(row["end"] == "stopped", f"{who} stops where G loses rank", row["end"])
        require("G loses rank" in row["why"], f"{who} says that G loses rank", row["why"])
        require(row["t"] < t, f"{who} stops before that", (row["t"], t))
    for row in rows[(rows["mode"] == "continue") & rows["method"].isin(PASSING)].to_dict("records"):
        who = f"{row['method']} on {row['problem']}"
        require(row["end"] == "reached" and row["branch"] == "through", f"{who} goes on through", (row["end"], row["branch"]))
    stopped = rows[rows["mode"] == "stop"].assign(exact=lambda frame: frame["problem"].map(numbers.losses))
    error = (stopped["told"] - stopped["exact"]).abs()
    worst = at_most(stopped.assign(error=error), "error")
    fixed = error[stopped["method"].isin(PASSING)]
    went = rows[rows["mode"] == "continue"]
    return SimpleNamespace(
        losses=numbers.losses,
        passing=PASSING,
        told=float(fixed.max()),
        worst=worst,
        worst_error=float(error.max()),
        through=int((went["branch"] == "through").sum()),
        went=len(went),
        elsewhere=went[(went["branch"] != "through") | (went["end"] != "reached")].to_dict("records"),
    )

"""Which tolerance is enough: the change of the energy against the tolerance of each solver, and its cost."""

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.lines import Line2D

from daebench.draw.figures import GREEN, QUIET, STROKES, grid_of_axes, save
from daebench.draw.methods import name_of, stroke_of
from daebench.methods.fixed_step.constraint_structure import RADIUS
from daebench.pages.report.claims import require
from daebench.pages.report.tables import part
from daebench.reports.molecules.laws import clear, extremes
from daebench.reports.molecules.motions import (
    BUTANE,
    DOUBLE,
    GAUSS_SEIDEL,
    ILVES,
    LINCS,
    MIDDLE,
    MULTIPLIERS,
    NEWTON,
    SETTLE,
    SINGLE,
    SINGLE_TOLERANCES,
    TITLES,
    WATER,
    double,
)

MOST = 1e-3
"""The change of the energy that is wanted at most in 10 ps, in parts of the fluctuation of the kinetic energy."""


ROUND_OFF = 1e-9
"""An exact solver changes the energy by less."""


ROUNDS = 1.0
"""Rounds that a decade of the tolerance takes more, at least, for its cost to be spoken of."""


ERRORS = 2.0
"""The modulus of a mean change is at most the measured one and so many of its standard errors; of a normal mean in 19 cases of 20."""


NANOSECOND = 1e4
"""Units of 0.1 ps in a nanosecond."""


def with_rates(runs: pd.DataFrame, converged: pd.DataFrame, molecules: pd.DataFrame, t_end: float) -> pd.DataFrame:
    """Return the runs with the mean change as a rate, kJ/mol per nanosecond and degree of freedom, and the upper limit of its modulus."""
    size = converged.set_index(["molecule", "h"])["fluctuation"]
    degrees = molecules.set_index("molecule")["degrees"]
    keys = zip(runs["molecule"], runs["h"], strict=True)
    unit = np.array([float(size[key]) / float(degrees[key[0]]) for key in keys])
    limit = runs["mean"].abs() + ERRORS * runs["error"]
    return runs.assign(rate=runs["mean"] * unit * NANOSECOND / t_end, limit=limit)


def asked(runs: pd.DataFrame) -> pd.DataFrame:
    """Return, for each molecule and step, the loosest tolerance with which, and with all tighter ones, the change is small enough.

    Small enough is a mean change whose upper limit is at most :data:`MOST`. Columns molecule, scheme, h, tolerance (NaN where none is
    enough), rounds, limit, and fortuitous: looser tolerances with a change as small, though a tighter one has not.
    """
    rows = []
    for (molecule, scheme, h), some in pd.concat([double(runs, GAUSS_SEIDEL), double(runs, ILVES)]).groupby(
        ["molecule", "scheme", "h"], sort=False
    ):
        ordered = some.sort_values("tolerance")
        good = (ordered["limit"] <= MOST).to_numpy()
        first = int(np.argmin(good)) if not good.all() else len(good)
        row: dict[str, Any] = {"molecule": molecule, "scheme": scheme, "h": h, "tolerance": np.nan, "rounds": np.nan, "limit": np.nan}
        if first:
            row |= {name: float(ordered[name].iloc[first - 1]) for name in ("tolerance", "rounds", "limit")}
        rows.append(row | {"fortuitous": [float(x) for x in ordered["tolerance"].to_numpy()[first:][good[first:]]]})
    return pd.DataFrame(rows)


def check_answer(enough: pd.DataFrame) -> SimpleNamespace:
    """Test that some tolerance is enough everywhere; return the tightest that a molecule needs, by the step."""
    require(enough["tolerance"].notna().all(), f"some tolerance keeps the change below {MOST:g} with every step", enough.to_dict("records"))
    least = {scheme: enough[enough["scheme"] == scheme].groupby("h")["tolerance"].min() for scheme in (GAUSS_SEIDEL, ILVES)}
    looser = enough[enough["fortuitous"].map(len) > 0]
    steps: dict[float, list[float]] = {}
    for h in sorted(least[GAUSS_SEIDEL].index):
        steps.setdefault(float(least[GAUSS_SEIDEL][h]), []).append(float(h))
    return SimpleNamespace(
        steps=steps,
        not_run=_steps_left_out(enough),
        usual=least[GAUSS_SEIDEL][MIDDLE],
        newton=least[ILVES][MIDDLE],
        by_molecule=part(enough, scheme=GAUSS_SEIDEL, h=MIDDLE).set_index("molecule")["tolerance"],
        fortuitous=looser,
    )


def _steps_left_out(enough: pd.DataFrame) -> dict[str, list[float]]:
    """Return the steps that some molecule was run with, for each molecule that was not."""
    every = set(enough["h"])
    left = {molecule: sorted(every - set(enough[enough["molecule"] == molecule]["h"])) for molecule in TITLES}
    return {molecule: steps for molecule, steps in left.items() if steps}


def check_radii(molecules: pd.DataFrame) -> pd.DataFrame:
    """Test that LINCS is refused where the spectral radius of its expansion is 1, and only there."""
    refused = molecules["refused"] != ""
    require(
        bool((refused == (molecules["radius"] >= RADIUS)).all()) and int(refused.sum()) == 1,
        "LINCS is refused on the ring alone, where its expansion has no sum",
        molecules[["molecule", "radius", "refused"]].to_dict("records"),
    )
    return molecules


def check_exact(runs: pd.DataFrame, converged: pd.DataFrame) -> SimpleNamespace:
    """Test that SETTLE in double precision and RATTLE leave nothing to see on water, and that converged runs do not drift."""
    closed = part(runs, precision=DOUBLE, scheme=(SETTLE, NEWTON), molecule=WATER)
    most = float(closed["high"].max())
    require(most < ROUND_OFF, f"SETTLE and RATTLE change the energy of water by less than {ROUND_OFF:g}", most)
    verdicts = converged["verdict"].value_counts()
    require(
        "drifts" not in verdicts, "no run with converged constraints drifts", converged[["molecule", "h", "verdict"]].to_dict("records")
    )
    return SimpleNamespace(most=most, bounded=(converged["verdict"] == "bounded").sum(), of=len(converged))


def solvers(runs: pd.DataFrame, enough: pd.DataFrame) -> pd.DataFrame:
    """Return every solver on every molecule with the middle step: with the tolerance that is enough there, and its cost."""
    middle = part(runs, h=MIDDLE, velocities=MULTIPLIERS)
    tolerances = enough[enough["h"] == MIDDLE].set_index(["molecule", "scheme"])["tolerance"]

    def chosen(row: Any) -> bool:
        if row["scheme"] == LINCS:
            return (row["order"], row["iterations"]) == (8, 4)
        wanted = tolerances.get((row["molecule"], row["scheme"]), np.nan)
        if row["precision"] == SINGLE and np.isfinite(row["tolerance"]):
            return bool(row["tolerance"] == max(wanted, SINGLE_TOLERANCES[-1]))
        return bool(np.isnan(row["tolerance"]) or row["tolerance"] == wanted)

    some = middle[middle.apply(chosen, axis=1)]
    least = some[some["precision"] == DOUBLE].groupby("molecule")["nanoseconds"].min()
    return some.assign(times=some["nanoseconds"] / some["molecule"].map(least)).reset_index(drop=True)


def cost(runs: pd.DataFrame, enough: pd.DataFrame) -> SimpleNamespace:
    """Return the rounds of a middle step with the tolerance that is enough there on all molecules, and how many more each decade takes."""
    tightest = enough[enough["h"] == MIDDLE].groupby("scheme")["tolerance"].min()
    middle = {scheme: double(runs, scheme)[lambda rows: rows["h"] == MIDDLE] for scheme in (GAUSS_SEIDEL, ILVES)}
    rounds = {scheme: rows[rows["tolerance"] == tightest[scheme]]["rounds"] for scheme, rows in middle.items()}
    of_molecule = middle[GAUSS_SEIDEL].groupby("molecule")
    slopes = [float(np.polyfit(-np.log10(rows["tolerance"]), rows["rounds"], 1)[0]) for _, rows in of_molecule]
    require(min(slopes) > ROUNDS, "each decade of the tolerance takes more rounds", slopes)
    seconds = {scheme: rows[rows["tolerance"] == tightest[scheme]].set_index("molecule")["nanoseconds"] for scheme, rows in middle.items()}
    faster = seconds[GAUSS_SEIDEL] / seconds[ILVES]
    return SimpleNamespace(
        rounds=extremes(rounds[GAUSS_SEIDEL]),
        newton=extremes(rounds[ILVES]),
        faster=extremes(faster),
        decade=np.median(slopes),
    )


def missed_in_single(runs: pd.DataFrame) -> pd.DataFrame:
    """Return the best run of the Gauss-Seidel iteration in single precision, for each molecule on which none is good enough.

    With the middle step, and velocities from multipliers.
    """
    rows = part(runs, scheme=GAUSS_SEIDEL, precision=SINGLE, velocities=MULTIPLIERS)
    best = rows[rows["h"] == MIDDLE].sort_values("limit").drop_duplicates("molecule")
    return best[best["limit"] > MOST]


def floor(runs: pd.DataFrame) -> float:
    """Return the smallest change of butane that is clear with the iteration of Gauss and Seidel in double precision."""
    return float(clear(part(double(runs, GAUSS_SEIDEL), molecule=BUTANE))["mean"].abs().min())


def scatter(runs: pd.DataFrame) -> Any:
    """Return the row of butane whose tolerance is the tightest and whose step is the largest."""
    return part(double(runs, GAUSS_SEIDEL), molecule=BUTANE).sort_values(["tolerance", "h"], ascending=[True, False]).iloc[0]


CHANGE = "change of the energy in 10 ps\nover fluctuation of the kinetic energy"


LEAST = 1e-16
"""Changes below are drawn here."""


BESIDE = 1e-15, 1e-14
"""Where on the axis of tolerances the two solvers without one are drawn."""


ORDER, ITERATIONS = 8, 4
"""The expansion of LINCS that is drawn."""


FINEST = 1e-8
"""The tightest tolerance in the picture of the answer."""


ENOUGH = GREEN


def draw_answer(runs: pd.DataFrame, answer: float, folder: Path) -> Path:
    """Draw the change against the tolerance of the Gauss-Seidel iteration, a curve a molecule; mark the tolerances that suffice."""
    rows = iteration(runs)
    figure, axes = grid_of_axes(1, 1, 4.0, x="constraint tolerance", y=CHANGE)
    ax = axes[0, 0]
    ax.set(xscale="log", yscale="log", xlim=(FINEST / 3, 3e-3))
    curves_by_molecule(ax, rows)
    ax.axhline(MOST, color=QUIET, linewidth=1.0)
    ax.axvspan(FINEST / 3, answer * 1.25, color=ENOUGH, alpha=0.13, linewidth=0, zorder=0)
    ax.annotate(f"wanted: at most one part in {1 / MOST:.0f}", (2.8e-3, MOST), (0, -3), textcoords="offset points", ha="right", va="top")
    ax.annotate("enough on all three", (FINEST / 2.6, 1), (0, -4), xycoords=("data", "axes fraction"), textcoords="offset points", va="top")
    ax.minorticks_off()
    ax.legend(loc="lower right")
    return save(figure, folder, "answer", rows)


def iteration(runs: pd.DataFrame) -> pd.DataFrame:
    """Return the runs of the Gauss-Seidel iteration with the middle step, in double precision."""
    rows = double(runs, GAUSS_SEIDEL)
    return rows[(rows["h"] == MIDDLE) & (rows["tolerance"] >= FINEST)]


def curves_by_molecule(ax: Any, rows: pd.DataFrame) -> None:
    """Draw the upper limits of the mean changes against the tolerance, a curve a molecule."""
    for k, (molecule, title) in enumerate(TITLES.items()):
        some = rows[rows["molecule"] == molecule].sort_values("tolerance")
        ax.plot(some["tolerance"], some["limit"].clip(lower=LEAST), **STROKES[k].points(), label=title)


def draw_tolerances(runs: pd.DataFrame, folder: Path) -> Path:
    """Draw the change against the tolerance: a panel a molecule, with the middle step; solvers without a tolerance at the left."""
    rows = part(runs, h=MIDDLE, velocities=MULTIPLIERS, precision=(DOUBLE, SINGLE))
    figure, axes = grid_of_axes(1, 3, 3.9, x="tolerance", sharey=True)
    axes[0, 0].set_ylabel(CHANGE)
    for ax, (molecule, title) in zip(axes[0], TITLES.items(), strict=True):
        _panel(ax, rows[rows["molecule"] == molecule])
        ax.set_title(title)
    axes[0, 0].text(3e-14, 1.5 * MOST, f"one part in {1 / MOST:.0f}", color=QUIET, fontsize=7.5, va="bottom")
    _legend(figure, (GAUSS_SEIDEL, ILVES, LINCS, SETTLE))
    return save(figure, folder, "tolerances", rows)


def _panel(ax: Any, rows: pd.DataFrame) -> None:
    """Draw the solvers on one molecule."""
    ax.axhline(MOST, color=QUIET, linewidth=1.0)
    ax.axvspan(BESIDE[0] / 4, BESIDE[1] * 2, color="#eeeeee", zorder=0, linewidth=0)
    beside = dict(zip((SETTLE, LINCS), BESIDE, strict=True))
    for scheme in (GAUSS_SEIDEL, ILVES, *beside):
        for precision in (DOUBLE, SINGLE):
            chosen = part(rows, scheme=scheme, precision=precision).sort_values("tolerance")
            if scheme in beside:
                chosen = part(chosen, order=(0, ORDER), iterations=(0, ITERATIONS))
                chosen = chosen.assign(tolerance=beside[scheme])
            _curve(ax, chosen, scheme, precision)
    ax.set(xscale="log", yscale="log", xlim=(BESIDE[0] / 4, 4e-3), ylim=(LEAST / 3, 20))
    ax.set_xticks([1e-12, 1e-9, 1e-6, 1e-3])
    ax.minorticks_off()


def _curve(ax: Any, rows: pd.DataFrame, scheme: str, precision: str) -> None:
    """Draw medians and bands over the starts; filled markers are single precision."""
    if rows.empty:
        return
    stroke = stroke_of(scheme)
    median, low, high = (rows[name].clip(lower=LEAST) for name in ("median", "low", "high"))
    look = stroke.points() | ({"markerfacecolor": stroke.color, "linewidth": 0.8} if precision == SINGLE else {})
    if len(rows) > 1:
        ax.fill_between(rows["tolerance"], low, high, color=stroke.color, alpha=0.18, linewidth=0)
        ax.plot(rows["tolerance"], median, **look | {"marker": MARKERS[scheme], "markersize": 4.0})
        return
    ax.plot([rows["tolerance"].iloc[0]] * 2, [low.iloc[0], high.iloc[0]], color=stroke.color, linewidth=3, alpha=0.35)
    ax.plot(rows["tolerance"], median, **look | {"marker": MARKERS[scheme], "linestyle": "none", "markersize": 5.5})


MARKERS = {GAUSS_SEIDEL: "o", ILVES: "^", LINCS: "D", SETTLE: "s"}
"""Markers with an inside: open in double precision, filled in single."""


def _legend(figure: Any, schemes: tuple[str, ...]) -> None:
    handles = []
    for scheme in schemes:
        look = stroke_of(scheme).points() | {"marker": MARKERS[scheme]}
        name = f"{name_of(scheme)} ({ORDER}, {ITERATIONS})" if scheme == LINCS else name_of(scheme)
        handles.append(Line2D([], [], label=name, **look))
    handles.append(Line2D([], [], label="double precision", color="black", linestyle="none", marker="o", markerfacecolor="white"))
    handles.append(Line2D([], [], label="single precision", color="black", linestyle="none", marker="o"))
    figure.legend(handles=handles, loc="outside lower center", ncols=3)


def thumbnail(axis: Any, runs: pd.DataFrame) -> None:
    """Draw the picture of the answer in small."""
    axis.axhline(MOST, color=QUIET, linewidth=1.0)
    rows = iteration(runs)
    curves_by_molecule(axis, rows)
    axis.set(xscale="log", yscale="log")
    axis.set_xticks([1e-8, 1e-6, 1e-4])
    axis.minorticks_off()
    axis.set_title("energy change by the solver", loc="right")
    axis.set_xlabel("tolerance", loc="right")
    axis.legend(fontsize=6.5, loc="upper left", handlelength=1.5)

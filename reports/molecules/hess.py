"""Sentences of B. Hess on energy drift and constraints, gmx-developers, April and October 2006, tested on single molecules."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pandas as pd

from daebench.diagnostics.random_walk import WALK
from daebench.pages.report.claims import require
from daebench.reports.molecules.laws import CLEAR, clear, fit
from daebench.reports.molecules.motions import (
    BUTANE,
    COMPENSATED,
    DIFFERENCES,
    GAUSS_SEIDEL,
    LINCS,
    MIDDLE,
    MIXED,
    MULTIPLIERS,
    SETTLE,
    SINGLE,
    TITLES,
    USUAL,
    WATER,
)

ONCE = 0.5
"""A change that grows by less than this part of it in the last seven eighths of the time was there from the beginning."""

INVERSE = (-1.4, -0.6)
"""Exponents of the step that are said to be about -1."""

UNBIASED = 3.5
"""A mean within so many of its standard errors is none."""


def check_hess(runs: pd.DataFrame) -> SimpleNamespace:
    """Return what holds of the sentences on one molecule; the first that the text states and that does not hold raises ClaimRefuted."""
    return SimpleNamespace(diffusive=check_diffusive(runs), always=check_always(runs), smaller=check_smaller(runs))


def single(runs: pd.DataFrame, molecule: str, scheme: str, velocities: str) -> pd.DataFrame:
    """Return the rows of a scheme in single precision, with the usual tolerance where it has one, by the step."""
    rows = runs[(runs["molecule"] == molecule) & (runs["scheme"] == scheme) & (runs["velocities"] == velocities)]
    return rows[(rows["precision"] == SINGLE) & (rows["tolerance"].isna() | (rows["tolerance"] == USUAL))].sort_values("h")


def middle(rows: pd.DataFrame) -> Any:
    """Return the row of the middle step."""
    return rows[rows["h"] == MIDDLE].iloc[0]


def check_diffusive(runs: pd.DataFrame) -> SimpleNamespace:
    """Test "diffusive and does not go down systematically": rounding alone is, and SHAKE at the usual tolerance is on water alone."""
    walk = middle(single(runs, WATER, SETTLE, MULTIPLIERS))
    require(
        WALK[0] < walk["alpha"] < WALK[1] and abs(walk["mean"]) <= UNBIASED * walk["error"],
        "rounding in single precision makes the energy of water a random walk without a bias, where the solver is exact",
        f"spread ~ t^{walk['alpha']:.2f}, mean {walk['mean']:.2g} +- {walk['error']:.2g}",
    )
    water, butane = (middle(single(runs, molecule, GAUSS_SEIDEL, MULTIPLIERS)) for molecule in (WATER, BUTANE))
    require(
        abs(water["slope"]) < ONCE * abs(water["mean"]) and water["mean"] < -CLEAR * water["error"],
        "at the usual tolerance water loses some energy at once, and then no more than a part of that",
        f"{water['mean']:.2g} in all, of which {water['slope']:.2g} in the last seven eighths of the time",
    )
    require(
        butane["slope"] < -CLEAR * butane["slope_error"] and abs(butane["slope"]) > ONCE * abs(butane["mean"]),
        "at the usual tolerance butane goes down systematically",
        f"{butane['slope']:.2g} +- {butane['slope_error']:.2g}",
    )
    return SimpleNamespace(walk=walk, water=water, butane=butane)


def check_always(runs: pd.DataFrame) -> SimpleNamespace:
    """Return how often inaccurate constraining decreases the energy, of the settings whose change is clear; rounding is left out."""
    inaccurate = runs[runs["tolerance"].notna() | (runs["scheme"] == LINCS)]
    seen = clear(inaccurate[inaccurate["velocities"] == MULTIPLIERS])
    up = seen[seen["mean"] > 0].sort_values("mean", ascending=False)
    parts = {molecule: seen[seen["molecule"] == molecule] for molecule in TITLES}
    velocities = inaccurate[inaccurate["velocities"] == MULTIPLIERS]
    later = clear(velocities.assign(mean=velocities["slope"], error=velocities["slope_error"]))
    require(
        len(up) < len(seen) / 2, "inaccurate constraining decreases the energy in most settings", f"{len(up)} of {len(seen)} increase it"
    )
    return SimpleNamespace(
        n=len(seen),
        down=len(seen) - len(up),
        up=up,
        later=len(later),
        later_up=later[later["mean"] > 0].sort_values("mean", ascending=False),
        by_molecule={molecule: (int((rows["mean"] < 0).sum()), len(rows)) for molecule, rows in parts.items()},
    )


def check_smaller(runs: pd.DataFrame) -> SimpleNamespace:
    """Test that in single precision the drift grows as the step falls, where velocities are differences of positions."""
    rows = []
    for molecule in TITLES:
        for scheme in (SETTLE, LINCS, GAUSS_SEIDEL):
            for velocities in (DIFFERENCES, MULTIPLIERS):
                some = single(runs, molecule, scheme, velocities)
                if len(some):
                    rows.append(
                        {"molecule": molecule, "scheme": scheme, "velocities": velocities} | vars(fit(some.assign(tolerance=np.nan)))
                    )
    laws = pd.DataFrame(rows)
    settle = laws[(laws["molecule"] == WATER) & (laws["scheme"] == SETTLE) & (laws["velocities"] == DIFFERENCES)].iloc[0]
    require(
        INVERSE[0] < settle["b"] < INVERSE[1] and settle["b_error"] < 0.3,
        "the drift of water with SETTLE grows like 1/h as the step falls, with velocities from differences",
        f"h^{settle['b']:.2f} +- {settle['b_error']:.2f}",
    )
    both = [single(runs, WATER, SETTLE, velocities).set_index("h") for velocities in (DIFFERENCES, MULTIPLIERS)]
    factors = both[0]["median"] / both[1]["median"]
    require(bool((factors > 10).all()), "velocities from differences change the energy more than ten times as much", factors.to_dict())
    settles = runs[(runs["scheme"] == SETTLE) & (runs["velocities"] == MULTIPLIERS)]
    spread = {precision: float(middle(some)["spread"]) for precision, some in settles.groupby("precision")}
    return SimpleNamespace(
        laws=laws,
        settle=settle,
        least=float(factors.min()),
        most=float(factors.max()),
        differences=both[0].reset_index(),
        compensated=spread[SINGLE] / spread[COMPENSATED],
        mixed=spread[SINGLE] / spread[MIXED],
    )

"""Defects of two-form and reversal against the step size: round-off, or a power of h."""

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pandas as pd
from markupsafe import Markup

from daebench.diagnostics.order import fit_order
from daebench.diagnostics.reversibility import reversibility_defect
from daebench.diagnostics.symplecticity import symplecticity_defect, tangent_basis
from daebench.draw.figures import grid_of_axes, legend_below, save
from daebench.draw.methods import curve_of
from daebench.pages.report import with_error
from daebench.pages.report.claims import require
from daebench.pages.report.tables import Of, Table, code, tiny
from daebench.reports.methods.families import method
from daebench.reports.methods.sweep import PENDULUM, ivp_of

LEAST, EPS = 1e-17, 2.3e-16
"""Smaller values are drawn at this value, the spacing of numbers at 1."""


KEEPING = ("symplectic_euler", "shake", "rattle", "strang", "lobatto3")
"""Methods that claim to keep the two-form, and whose defects are drawn."""


LOSING = ("implicit_euler", "seproj", "energy_momentum", "midpoint", "midpoint+symproj", "radau2_ggl", "rk4")
"""Methods that do not."""


DEFECT_H = tuple(0.02 / 2**k for k in range(7))


DEFECT_STEPS = 10


FLOOR = 1e-13
"""Defects up to this are round-off, or too close to it for a power of h."""


def defects(name: str) -> pd.DataFrame:
    """Return columns method, h, symplectic, symmetric: the defects of ten steps from the start of the pendulum."""
    ivp, fixed_step = ivp_of(PENDULUM), method(name)
    X = tangent_basis(ivp, ivp.p0, ivp.q0)
    rows = []
    for h in DEFECT_H:
        flow = fixed_step.flow(ivp, h, DEFECT_STEPS)
        both = {
            "symplectic": symplecticity_defect(flow, ivp.p0, ivp.q0, X),
            "symmetric": reversibility_defect(flow, ivp.p0, ivp.q0),
        }
        rows.append({"method": name, "h": h} | both)
    return pd.DataFrame(rows)


def powers(frame: pd.DataFrame) -> pd.DataFrame:
    """Return columns method, property, order, most, power, power_error: the fitted powers of h; NaN where all is round-off."""
    rows = []
    for name, method_defects in frame.groupby("method", sort=False):
        for property in ("symplectic", "symmetric"):
            value = method_defects[property].to_numpy()
            fit = fit_order(method_defects["h"], value, floor=FLOOR)
            about = {"method": name, "property": property, "order": method(str(name)).claims.order}
            rows.append(about | {"most": value.max(), "power": fit.slope, "power_error": fit.slope_error})
    return pd.DataFrame(rows)


STEEP = 0.25
"""Tolerance by which a power of h may fall short of the theoretical minimum."""


NO_DEFECT = 1e-11
"""A defect of ten steps up to this is round-off; SHAKE has more round-off than others, because its momenta are difference quotients."""


def check_defects(fitted_powers: pd.DataFrame) -> SimpleNamespace:
    """Test that the two-form is kept at every step size, or that its defect falls at least with the order plus one."""
    two_form = fitted_powers[fitted_powers["property"] == "symplectic"].set_index("method")
    symplectic_rows = two_form[two_form.index.isin(KEEPING)]
    lost = two_form[~two_form.index.isin(KEEPING)]
    require(
        symplectic_rows["most"].max() < NO_DEFECT,
        "symplectic methods keep the two-form at every step size",
        f"a defect of {symplectic_rows['most'].max():.1e}",
    )
    for name, row in lost.iterrows():
        least = row["order"] + 1 - STEEP
        require(row["power"] > least, f"the defect of {name} falls at least with h^{row['order'] + 1}", f"a power of {row['power']:.2f}")
    reversal = fitted_powers[fitted_powers["property"] == "symmetric"]
    flat = list(reversal.loc[reversal["most"] < NO_DEFECT, "method"])
    symmetric_methods = [name for name in reversal["method"] if method(name).claims.symmetric]
    require(flat == symmetric_methods, "of these methods the symmetric ones are reversible at every step size, and no others", flat)
    uneven = [name for name in symplectic_rows.index if name not in flat]
    return SimpleNamespace(kept=list(symplectic_rows.index), most=symplectic_rows["most"].max(), lost=lost, flat=flat, uneven=uneven)


def draw_defects(defects: pd.DataFrame, folder: Path) -> Path:
    """Draw the defects of two-form and symmetry against h."""
    figure, axes = grid_of_axes(1, 2, 4.6, sharey=True)
    names = list(defects["method"].unique())
    for ax, (column, title) in zip(axes[0], (("symplectic", "two-form"), ("symmetric", "symmetry")), strict=True):
        for name in sorted(names, key=KEEPING.__contains__):
            method_defects = defects[defects["method"] == name]
            ax.plot(method_defects["h"], method_defects[column].clip(lower=LEAST), **curve_of(name) | {"markersize": 3.6})
        ax.axhspan(LEAST, 1e-13, color="#eeeeee", zorder=0, linewidth=0)
        ax.set(xscale="log", yscale="log", title=f"defect of the {title}", xlabel="step size $h$ (s)", ylim=(LEAST, 10))
    axes[0, 0].set_ylabel("defect of ten steps")
    legend_below(figure, axes[0, 0], 4)
    return save(figure, folder, "defects", defects)


def powers_table(frame: pd.DataFrame) -> Table:
    """Return one row per method: the powers of h in its defects, or a note that there is no power."""
    shown = frame.pivot(index="method", columns="property", values=["most", "power", "power_error"]).reindex(frame["method"].unique())
    shown.columns = ["_".join(names) for names in shown.columns]
    columns: dict[str, Any] = {"method": code}
    for key, heading in (("symplectic", "two-form"), ("symmetric", "symmetry")):
        columns[key] = (Of(power_or_most, f"most_{key}", f"power_{key}", f"power_error_{key}"), heading)
        columns[f"{key}_word"] = (
            Of(lambda power: "power of h" if np.isfinite(power) else "round-off", f"power_{key}"),
            "<small>which is</small>",
        )
    return Table(shown.reset_index(), columns, frame)


def power_or_most(most: float, power: float, error: float) -> Markup:
    """Return a power of h, or the largest defect where there is none."""
    return with_error(power, error) if np.isfinite(power) else tiny(most)

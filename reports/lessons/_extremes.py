"""Experiments of the lesson on extremes, and the numbers of its text."""

from collections.abc import Sequence
from functools import partial
from itertools import pairwise
from types import SimpleNamespace
from typing import Any

import numpy as np
import numpy.typing as npt
import pandas as pd
from markupsafe import Markup

from daebench.draw.figures import Stroke
from daebench.draw.svg.axis import Axis, around
from daebench.draw.svg.marks import Tiles
from daebench.draw.svg.panels import Panel, draw_panels
from daebench.pages.lesson.control import NO_YES, Control, Values, defaults
from daebench.pages.lesson.experiment import Experiment, Preparation, Shown
from daebench.pages.report import at_most, count, number, percent
from daebench.pages.report.claims import require
from daebench.reports.lessons._extremes_runs import alike, apart, cannot_turn, locked, parted, penalised, released, releases, summed, turned
from daebench.reports.lessons._panels import MINUS_START, against_time, seconds, small

CRANKS = {"rattle": "RATTLE", "rk4": "Runge and Kutta, index reduced (rk4)"}
RODS, H = (2.0, 1.5, 1.2, 1.1, 1.03, 1.01, 1.003, 1.001, 1.0), 0.005
SPRINGS = {"stiff:rk4": "Runge and Kutta (rk4)", "stiff:midpoint": "midpoint rule"}
EPS = (0.1, 0.03, 0.01, 0.003, 0.001, 0.0003, 0.0001)
SUMS = {False: "plain sums", True: "compensated sums"}
STEPS = (1000, 10_000, 50_000, 100_000, 200_000)
PENDULUMS = {"rattle": "RATTLE", "lobatto3": "Lobatto, 3 stages"}
APART, DELTA = tuple(float(f"1e-{k}") for k in range(14, 1, -2)), 1e-10
LATER = (0.1, 0.2, 0.4, 1.0)
WARM = ("#7f2704", "#d94801", "#fd8d3c", "#fdd0a2", "#bdbdbd")
EARLY, LATE = 2.0, 4.0
ENERGIES = (1e-4, 1e-3, 1e-2, 1e-1, 1.0)
COLD = ("#deebf7", "#9ecae1", "#4292c6", "#2171b5", "#08519c", "#d55e00")
MANY = 200_000
NEARLY, TIGHT = 1.001, 0.001


def show_lock(values: Values) -> Shown:
    """Return the energy error and the rank of G along a run."""
    run, energy, rank = locked(**values)
    panels = [
        against_time(run.t, {"": energy}, MINUS_START, "energy error"),
        against_time(
            run.t,
            {"": rank},
            "",
            "how far G is from losing rank",
            Axis("\N{GREEK SMALL LETTER SIGMA} least / largest", 1e-5, 1.0, log=True),
        ),
    ]
    says = Markup("Largest energy error <b>{}</b> J; the smaller singular value of <i>G</i> decreases to {} of the larger one.").format(
        number(np.max(np.abs(energy))), number(rank.min())
    )
    if run.failure:
        says += Markup(" The run stopped at <i>t</i> = {:.3g} s: {}").format(
            run.t[-1], run.failure.partition(": ")[2].partition(", within")[0] + "."
        )
    return Shown(draw_panels(panels, alt="Energy error and rank of G against time.", height=250), says)


def table_lock(values: Values) -> pd.DataFrame:
    """Return the numbers behind the picture."""
    run, energy, rank = locked(**values)
    return pd.DataFrame({"t": run.t, "energy_error": energy, "rank": rank})


def show_stiff(values: Values) -> Shown:
    """Return the distance from the constrained motion and the residual of the constraint."""
    run, away, g = penalised(**values)
    panels = [
        against_time(
            run.t,
            {"": away},
            "",
            "distance from the constrained motion",
            Axis("|q \N{MINUS SIGN} q constrained| [m]", 1e-9, 1e2, log=True),
        ),
        against_time(run.t, {"": g}, "", "residual of the constraint", Axis("|g|", 1e-9, 1e2, log=True)),
    ]
    turns = values["h"] / (np.pi * values["eps"])
    says = Markup(
        "The spring oscillates in {} s: a step is <b>{}</b> of that. |<i>g</i>| is at most {}; the distance at the end is {} m."
    ).format(number(np.pi * values["eps"]), number(turns), at_most(g.max()), number(away[-1]))
    if run.failure:
        says += Markup(" The run stopped at <i>t</i> = {:.3g} s.").format(run.t[-1])
    return Shown(
        draw_panels(panels, alt="Distance from the constrained motion and residual of the constraint against time.", height=250), says
    )


def table_stiff(values: Values) -> pd.DataFrame:
    """Return the numbers behind the picture."""
    run, away, g = penalised(**values)
    return pd.DataFrame({"t": run.t[: len(away)], "distance": away, "g": g})


def show_rounding(values: Values) -> Shown:
    """Return the error of the angular momentum, with plain sums and, on request, compensated ones."""
    shown = {
        SUMS[compensated]: summed(compensated, values["h"], values["steps"])
        for compensated in NO_YES
        if not compensated or values["compensated"]
    }
    errors = {name: error for name, (_, error) in shown.items()}
    t = shown[SUMS[False]][0]
    axis = around("L\N{SUBSCRIPT THREE} \N{MINUS SIGN} its start [J s]", *errors.values(), [0.0])
    panels = [
        against_time(t, errors, "", "error of the angular momentum", axis),
        against_time(t, errors, "", "the same, modulus", around("|error| [J s]", [1e-19, 1e-13], log=True)),
    ]
    largest = Markup(", ").join(Markup("{} <b>{}</b>").format(name, number(np.max(np.abs(error)))) for name, error in errors.items())
    says = Markup("After {} steps, the largest error of the angular momentum: {}.").format(count(values["steps"]), largest)
    return Shown(
        draw_panels(panels, alt="Error of the angular momentum against time, with plain and with compensated sums.", height=250), says
    )


def table_rounding(values: Values) -> pd.DataFrame:
    """Return the numbers behind the picture."""
    (t, plain), (_, compensated) = (summed(choice, values["h"], values["steps"]) for choice in NO_YES)
    return pd.DataFrame({"t": t, "plain": plain, "compensated": compensated})


def show_chaos(values: Values) -> Shown:
    """Return the distance of both pendulums and the energy error of one of them."""
    t, distance, energy = apart(values)
    panels = [
        against_time(t, {"": distance}, "", "distance of the lower points", Axis("distance [m]", 1e-16, 1e1, log=True)),
        against_time(t, {"": energy}, MINUS_START, "energy error of one of them"),
    ]
    when = parted(t, distance)
    text = (
        Markup("they are a tenth of an arm apart after <b>{:.1f} s</b>").format(when) if when == when else Markup("they have not separated")
    )
    says = Markup("Released {} rad apart, {}. The energy error is at most {} J.").format(
        number(values["delta"], 1), text, at_most(np.max(np.abs(energy)))
    )
    return Shown(draw_panels(panels, alt="Distance of two double pendulums against time, and energy error of one.", height=250), says)


def table_chaos(values: Values) -> pd.DataFrame:
    """Return the numbers behind the picture."""
    return pd.DataFrame(dict(zip(("t", "distance", "energy_error"), apart(values), strict=True)))


def show_map(values: Values) -> Shown:
    """Return when the lower arm first turns over, and the energy error, from each release."""
    when, energy = turned(**values)
    steps = [0.0, *(values["t_end"] * part for part in LATER)]
    names = [f"turns over within {hi:g} s" if lo == 0 else f"{lo:g} to {hi:g} s" for lo, hi in pairwise(steps)] + ["not yet"]
    sizes = [*(f"below {level:g} J" for level in ENERGIES), "more"]
    panels = [
        plane_of(np.searchsorted(steps[1:], when), WARM, names, "first turn of the lower arm"),
        plane_of(np.searchsorted(ENERGIES, energy), COLD, sizes, "largest energy error"),
    ]
    says = Markup("From <b>{}</b> of {} releases at rest the lower arm turns over within {:g} s. ")
    says += Markup("The median energy error is {} J, the largest {} J.")
    part = percent(float(np.mean(np.isfinite(when))))
    return Shown(
        draw_panels(panels, alt="Maps over the angles of release: when the lower arm first turns over, and the energy error.", height=330),
        says.format(part, count(when.size), values["t_end"], number(np.median(energy)), at_most(np.max(energy))),
    )


def plane_of(classes: npt.NDArray[np.int64], colours: Sequence[str], names: Sequence[str], title: str) -> Panel:
    """Return a map over the angles of release; each colour lies below those of all later classes."""
    edges = releases()[0]
    axes = [Axis(f"{arm} arm [rad from hanging]", -np.pi, np.pi) for arm in ("upper", "lower")]
    named = enumerate(zip(colours, names, strict=True))
    tiles = [Tiles(edges, edges, classes >= k, Stroke(colour, "-", ""), name) for k, (colour, name) in named]
    return Panel(axes[0], axes[1], tiles, title)


def table_map(values: Values) -> pd.DataFrame:
    """Return the numbers behind the picture, one row per release."""
    when, energy = turned(**values)
    upper, lower = np.meshgrid(releases()[1], releases()[1])
    return pd.DataFrame({"upper": upper.ravel(), "lower": lower.ravel(), "turns_at": when.ravel(), "energy_error": energy.ravel()})


LOCK = Experiment(
    name="lock-up",
    title="A mechanism that locks",
    controls=(
        Control("rod", "rod, in cranks", RODS, 1.1, RODS),
        Control("scheme", "method", tuple(CRANKS), "rattle", tuple(CRANKS), CRANKS.__getitem__),
        Control("h", "step size h", (0.001, 0.002, 0.005, 0.01), H, (), seconds),
    ),
    show=show_lock,
    table=table_lock,
)
STIFF = Experiment(
    name="stiffness",
    title="A spring in place of the constraint",
    controls=(
        Control("eps", "\N{GREEK SMALL LETTER EPSILON}, the softness of the spring", EPS, 0.01, EPS, small),
        Control("scheme", "method", tuple(SPRINGS), "stiff:rk4", tuple(SPRINGS), SPRINGS.__getitem__),
        Control("h", "step size h", (0.001, 0.002, 0.005, 0.01), H, (0.002, 0.005), seconds),
    ),
    show=show_stiff,
    table=table_stiff,
)
ROUNDING = Experiment(
    name="round-off",
    title="A long sum",
    controls=(
        Control("compensated", "show compensated sums too", NO_YES, False, NO_YES),
        Control("steps", "steps", STEPS, 100_000, (10_000, 100_000, 200_000), lambda n: f"{n:,}".replace(",", " ")),
        Control("h", "step size h", (0.001, 0.01, 0.1), 0.01, (), seconds),
    ),
    show=show_rounding,
    table=table_rounding,
)
CHAOS = Experiment(
    name="chaos",
    title="Two starts",
    controls=(
        Control("delta", "difference of the releases [rad]", APART, DELTA, APART, small),
        Control("scheme", "method", tuple(PENDULUMS), "rattle", tuple(PENDULUMS), PENDULUMS.__getitem__),
        Control("h", "step size h", (0.002, 0.005, 0.01), H, (), seconds),
        Control("t_end", "length of the run", (10.0, 20.0, 30.0, 40.0), 40.0, (), seconds),
    ),
    show=show_chaos,
    table=table_chaos,
)
MAP = Experiment(
    name="map",
    title="Every release",
    controls=(
        Control("scheme", "method", tuple(PENDULUMS), "rattle", tuple(PENDULUMS), PENDULUMS.__getitem__),
        Control("h", "step size h", (0.002, 0.005, 0.01, 0.02), 0.01, (0.01, 0.02), seconds),
        Control("t_end", "length of the runs", (2.0, 5.0, 10.0, 20.0), 10.0, (), seconds),
    ),
    show=show_map,
    table=table_map,
)
EXPERIMENTS = (LOCK, STIFF, ROUNDING, CHAOS, MAP)


def thumbnail(axis: Any) -> None:
    """Draw the time at which a double pendulum first turns over, for each release at rest."""
    edges, when = releases()[0], turned(**defaults(MAP.controls))[0]
    axis.grid(visible=False)
    drawn = axis.pcolormesh(edges, edges, np.where(np.isfinite(when), when, np.nan), cmap="cividis_r", rasterized=True)
    axis.set(xticks=[-3, 0, 3], yticks=[-3, 0, 3])
    axis.figure.colorbar(drawn, ax=axis).ax.set_title("s", fontsize=7.5)
    axis.set_xlabel("upper arm  [rad]", loc="right")
    axis.set_ylabel("lower arm  [rad]")
    axis.set_title("double pendulum: first turn", loc="left")


def preparations() -> list[Preparation]:
    """Return the kernels that have to be compiled before the controls respond."""
    tasks: list[Preparation] = [(f"compiling {name} for the crank", partial(locked, name, 2.0, 0.01)) for name in CRANKS]
    tasks += [(f"compiling {name}", partial(penalised, name, 0.1, 0.01)) for name in SPRINGS]
    tasks += [(f"compiling rattle, {SUMS[compensated]}", partial(summed, compensated, 0.1, 1000)) for compensated in NO_YES]
    tasks += [(f"compiling {name} for two arms", partial(released, name, 0.0, 0.01, 0.1)) for name in PENDULUMS]
    return tasks + [(f"compiling {name} for thousands of starts", partial(turned, name, 0.02, 0.1)) for name in PENDULUMS]


def facts() -> SimpleNamespace:
    """Return the numbers of the text; the first sentence that does not hold raises ClaimRefuted."""
    lock = {rod: locked("rattle", rod, H) for rod in (2.0, NEARLY, 1.0)}
    energy = {rod: float(np.max(np.abs(outcome[1]))) for rod, outcome in lock.items()}
    rounding = {compensated: float(np.max(np.abs(summed(compensated, 0.01, MANY)[1]))) for compensated in NO_YES}
    stiff = {name: penalised(name, TIGHT, 0.005) for name in SPRINGS}
    chaos = {name: parted(*apart(defaults(CHAOS.controls) | {"scheme": name})[:2]) for name in PENDULUMS}
    nearer = parted(*apart(defaults(CHAOS.controls) | {"delta": DELTA / 100})[:2])
    require(energy[NEARLY] > 10 * energy[2.0], "the energy error grows as the rod comes close to the crank", energy)
    require(lock[1.0][0].failure is not None, "a rod as long as the crank locks", lock[1.0][0].t[-1])
    require(rounding[True] < 0.5 * rounding[False], "compensated sums lose less", rounding)
    require(
        stiff["stiff:rk4"][0].failure is not None and stiff["stiff:midpoint"][0].failure is None,
        "the explicit method ends, the implicit one does not",
        stiff["stiff:rk4"][0].t[-1],
    )
    when, _ = turned(**defaults(MAP.controls))
    below = int(np.sum(np.isfinite(when[cannot_turn()])))
    require(below == 0, "no arm with too little energy turns over", below)
    length = float(defaults(MAP.controls)["t_end"])
    early, late = alike(when, 0.0, EARLY), alike(when, LATE, length)
    require(late < 0.25 < 0.5 < early, "most neighbours turn over together early, and few late", (early, late))
    require(all(np.isfinite(time) for time in (*chaos.values(), nearer)), "all of the pendulums separate", chaos)
    require(nearer > chaos["rattle"], "a smaller difference takes longer", nearer)
    return SimpleNamespace(
        energy=energy,
        lock=lock,
        rounding=rounding,
        stiff=stiff,
        chaos=chaos,
        nearer=nearer,
        delta=DELTA,
        many=MANY,
        tight=TIGHT,
        nearly=NEARLY,
        releases=when.size,
        turn=float(np.mean(np.isfinite(when))),
        cannot=float(np.mean(cannot_turn())),
        length=length,
        early=EARLY,
        late=LATE,
        alike_early=early,
        alike_late=late,
    )

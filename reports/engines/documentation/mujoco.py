"""MuJoCo's sentences on its integrators, measured on the pendulum model of its documentation, and on its constraints."""

import time
from functools import cache
from typing import Any

import numpy as np

from daebench.pages.report.sentences import number
from daebench.reports.engines.adapters import mujoco as adapter
from daebench.reports.engines.documentation import NOT, PART, row
from daebench.reports.engines.motions import BY_KEY, T_END, reference_of
from daebench.systems.lazily import mujoco

MODEL = """<mujoco>
  <option timestep="{h}" integrator="{integrator}"><flag constraint="disable" energy="enable"/></option>
  <worldbody>
    <body>
      <joint type="hinge" axis="0 1 0"/>
      <geom type="cylinder" size="0.02" fromto="0 -0.02 0 0 0.02 0"/><geom type="capsule" size="0.02" fromto="0 0 0 0.1 0 0"/>
      <body pos="0.1 0 0">
        <joint type="slide" axis="1 0 0" stiffness="200"/><geom type="capsule" size="0.015" fromto="-0.1 0 0 0.1 0 0"/>
        <body pos="0.1 0 0">
          <joint type="ball"/><geom type="box" size="0.02" fromto="0 0 0 0 0.1 0"/>
          <body pos="0 0.1 0"><joint axis="1 0 0"/><geom type="capsule" size="0.02" fromto="0 0 0 0 0.1 0"/></body>
        </body>
      </body>
    </body>
  </worldbody>
</mujoco>"""
"""The numbers of doc/_static/pendulum.xml: a hinge, a slide with a spring, a ball and a hinge, one after the other."""

STEP = 0.002
"""Its default step size, s."""

SECONDS = 100.0
"""How long the model is run, s."""

COMPUTATION = "Computation, “Numerical integration”"
MODELING = "Modeling, “Solver parameters”"


@cache
def energies(integrator: str, h: float) -> Any:
    """Return the energies of the model every 0.1 s, up to where MuJoCo says that the simulation is unstable."""
    mujoco.set_mju_user_warning(lambda text: None)
    model = mujoco.MjModel.from_xml_string(MODEL.format(h=h, integrator=integrator))
    data, values = mujoco.MjData(model), []
    for _ in range(round(SECONDS / 0.1) + 1):
        mujoco.mj_forward(model, data)
        values.append(float(data.energy.sum()))
        mujoco.mj_step(model, data, nstep=round(0.1 / h))
        if any(warning.number for warning in data.warning):
            break
    return np.array(values)


def scale() -> float:
    """Return the range of the kinetic energy of the model under RK4, J: from 0 at its start to what its potential gives."""
    model = mujoco.MjModel.from_xml_string(MODEL.format(h=STEP, integrator="RK4"))
    data, most = mujoco.MjData(model), 0.0
    for _ in range(1000):
        mujoco.mj_step(model, data, nstep=5)
        most = max(most, float(data.energy[1]))
    return most


def share(integrator: str, h: float) -> tuple[float, float, float]:
    """Return the largest gain and loss of energy in parts of the largest kinetic energy, and the time when it first is off by all of it."""
    values, whole = energies(integrator, h), scale()
    error = (values - values[0]) / whole
    off = np.flatnonzero(np.abs(error) > 1)
    unstable = len(values) < round(SECONDS / 0.1) + 1
    first = 0.1 * off[0] if len(off) else 0.1 * len(values) if unstable else np.inf
    return float(error.max()) if not unstable else np.inf, float(-error.min()), float(first)


def check() -> list[dict[str, str]]:
    """Return the sentences with their measurements."""
    shares = {name: share(name, STEP) for name in adapter.TREE}
    gains = [shares[name] for name in ("Euler", "implicitfast")]
    diverged = all(gain > 1 for gain, _, _ in gains)
    words = "; ".join(f"{name}: off by the whole kinetic energy at t = {number(shares[name][2])} s" for name in ("Euler", "implicitfast"))
    never = f"neither gains the kinetic energy within {SECONDS:g} s"
    rk4, implicit = shares["RK4"], shares["implicit"]
    strayed = max(rk4[0], rk4[1])
    return [
        row(COMPUTATION, "Its pendulum model diverges quickly under Euler and implicitfast.", words if diverged else never, diverged),
        row(
            COMPUTATION,
            "RK4 conserves the energy of this model well.",
            f"within {SECONDS:g} s it strays by {number(100 * strayed)} % of the kinetic energy",
            strayed < 0.05,
        ),
        row(
            COMPUTATION,
            "Under implicit the model does not diverge, and loses energy.",
            f"it gains at most {number(100 * implicit[0])} % of the kinetic energy, and loses {number(100 * implicit[1])} %",
            implicit[0] < 0.05 < implicit[1],
        ),
        quarter(),
        double(),
        cost(),
        safe(),
    ]


def quarter() -> dict[str, str]:
    """Return whether RK4 keeps the energy of the model better than single-step methods with a quarter of its step."""
    rk4 = max(share("RK4", STEP)[:2])
    others = {name: max(share(name, STEP / 4)[:2]) for name in ("Euler", "implicitfast", "implicit")}
    words = ", ".join(f"{name} {'diverges' if not np.isfinite(value) else f'{number(100 * value)} %'}" for name, value in others.items())
    sentence = (
        "For systems that conserve energy RK4 is better than single-step methods with a quarter of its step; here by energy, on its model."
    )
    return row(COMPUTATION, sentence, f"strays by {number(100 * rk4)} %; with h/4: {words}", rk4 < min(others.values()))


def double() -> dict[str, str]:
    """Return the same by accuracy at the end, on the double pendulum."""
    known, h = reference_of("double"), 1 / 256

    def error(name: str, step: float) -> float:
        states = adapter.run(adapter.tree, name, BY_KEY["double"].ivp, step, np.array([T_END]))
        return float(np.max(np.abs(states.q[-1] - known.value)))

    rk4, others = error("RK4", h), {name: error(name, h / 4) for name in ("Euler", "implicitfast", "implicit")}
    words = ", ".join(f"{name} {number(value)}" for name, value in others.items())
    sentence = "The same, by accuracy at t = 10 on the double pendulum, h = 1/256."
    return row(COMPUTATION, sentence, f"error {number(rk4)} m; with h/4: {words}", rk4 < min(others.values()))


def cost() -> dict[str, str]:
    """Return how many times longer a step of implicitfast takes than one of Euler on the model, best of several turns."""
    best = dict.fromkeys(("Euler", "implicitfast"), np.inf)
    for _ in range(40):
        for name in best:
            model = mujoco.MjModel.from_xml_string(MODEL.format(h=1e-5, integrator=name))
            data = mujoco.MjData(model)
            began = time.process_time()
            mujoco.mj_step(model, data, nstep=2000)
            best[name] = min(best[name], time.process_time() - began)
    ratio = best["implicitfast"] / best["Euler"]
    return row(
        COMPUTATION, "implicitfast costs about as much as Euler.", f"{number(ratio)} times as much on its pendulum model", ratio < 1.5
    )


def safe() -> dict[str, str]:
    """Return whether time constants of constraints below two steps let the slider crank fail, and those above do not."""
    motion, h = BY_KEY["slider"], 1 / 256

    def stable(constant: float) -> bool:
        try:
            states = adapter.run_hard(adapter.slider_crank, "implicitfast", constant, 1.0, motion.ivp, h, np.arange(1, 11) * 1.0)
        except ArithmeticError:
            return False
        return float(np.max(np.abs(motion.ivp.along("g", states.q)))) < 0.1

    good = {constant: stable(constant) for constant in (0.5, 1.0, 1.5, 2.0, 3.0, 4.0, 8.0)}
    above, below = [ok for constant, ok in good.items() if constant >= 2], [ok for constant, ok in good.items() if constant < 2]
    words = ", ".join(f"{constant:g} h {'ok' if ok else 'lost'}" for constant, ok in good.items())
    verdict: bool | str = PART if all(above) and all(below) else all(above) if not all(below) else NOT
    sentence = (
        "A time constant of a constraint below two steps can be unstable; here of the slider crank under implicitfast, damping ratio 1."
    )
    return row(MODELING, sentence, f"{words} (|g| below 0.1 m² to t = 10)", verdict)

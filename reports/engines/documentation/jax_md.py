"""jax-md's sentences on its constraints and on its NVE simulation, measured on butane and on the top."""

from functools import partial

import numpy as np

from daebench.diagnostics.order import fit_order
from daebench.pages.report.sentences import number
from daebench.reports.engines.adapters import jax_md as adapter
from daebench.reports.engines.documentation import NOT, PART, row
from daebench.reports.engines.motions import BY_KEY, T_END, reference_of
from daebench.systems.lazily import jax_md, jax_md_constraints, jnp

ROUND_OFF = 1e-9
"""An energy error up to this is round-off."""


def check() -> list[dict[str, str]]:
    """Return the sentences with their measurements."""
    return [projection(), in_a_step(), energy()]


def projection() -> dict[str, str]:
    """Return whether its projection puts a molecule that is off by a tenth of an Angstrom onto the constraints."""
    adapter.doubles()
    ivp = BY_KEY["butane"].ivp
    masses, r, _, _, pairs, _ = adapter.molecule(ivp)
    distances = np.array([float(np.linalg.norm(r[j] - r[i])) for i, j in pairs])
    _, ties = jax_md_constraints.prepare_settle_ccma(np.array(pairs), distances, masses)
    off = r + 0.1 * np.random.default_rng(20).standard_normal(r.shape)
    displacement, shift = jax_md.space.free()
    placed = np.array(
        jax_md_constraints.ccma_apply_positions(jnp.asarray(off), ties, jnp.asarray(masses), displacement, shift, **adapter.TIGHT)
    )
    worst = float(np.max(np.abs([np.linalg.norm(placed[j] - placed[i]) / d - 1 for (i, j), d in zip(pairs, distances, strict=True)])))
    sentence = "CCMA puts positions onto distance constraints within a tolerance."
    return row("amber.constraints", sentence, f"off by {number(worst)} of a distance, tolerance 1e-12", worst <= 1.1e-12)


def in_a_step() -> dict[str, str]:
    """Return order and energy of velocity Verlet with its projections in the place of RATTLE's."""
    ivp, known = BY_KEY["pendulum"].ivp, reference_of("pendulum")
    steps = [2.0**-k for k in range(13, 17)]
    runs = [partial(adapter.run, adapter.hanging, adapter.TIGHT)(ivp, h, np.array([T_END])) for h in steps]
    errors = [float(np.max(np.abs(run.q[-1] - known.value))) for run in runs]
    slope = fit_order(steps, errors, floor=known.bound).slope
    loss = float(ivp.value("H", ivp.p0, ivp.q0) - ivp.value("H", runs[0].p[-1], runs[0].q[-1]))
    sentence = (
        "It is an analogue of OpenMM's CCMA, for the positions as they are. (OpenMM's, within a step, moves them along the bonds at the "
        "step's start, as SHAKE and RATTLE do; this one along those at its end, which costs an order and the energy.)"
    )
    words = (
        f"as RATTLE's projection: order {number(slope, 2)}, energy {number(loss)} J lost of the pendulum by t = 10, h = 2<sup>-13</sup> s"
    )
    return row("amber.constraints", sentence, words, PART if abs(slope - 1) < 0.2 and loss > ROUND_OFF else NOT)


def energy() -> dict[str, str]:
    """Return whether the energy of the top stays, and the order of its rigid body."""
    motion, known = BY_KEY["top"], reference_of("top")
    steps = [2.0**-k for k in range(11, 15)]
    runs = [adapter.run_top(motion.ivp, h, np.array([T_END / 2, T_END])) for h in steps]
    errors = [float(np.max(np.abs(run.q[-1][6:9] - known.value))) for run in runs]
    slope = fit_order(steps, errors, floor=known.bound).slope
    H0 = float(motion.ivp.value("H", motion.ivp.p0, motion.ivp.q0))
    off = float(np.max(np.abs(motion.ivp.along("H", runs[-1].p, runs[-1].q) - H0)))
    sentence = "Rigid bodies are integrated by a symplectic scheme for quaternions, with the energy held constant."
    words = f"order {number(slope, 3)}, energy off by {number(off)} J with h = 2<sup>-14</sup> s"
    return row("rigid_body, simulate.nve", sentence, words, abs(slope - 2) < 0.1 and off < 0.05)

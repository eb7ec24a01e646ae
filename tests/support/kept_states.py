"""States of some 300 pairs of problem and method after ten and after a thousand steps, kept from machine code that numba made.

``python -m tests.support.kept_states`` makes the file anew. That is right only where bits change for a reason that the changelog states.
"""

import hashlib
import json
import platform
import sys
from pathlib import Path

import numpy as np

import daebench
from daebench.errors import DaebenchError
from daebench.methods.catalogue import problems

FILE = Path(__file__).with_name("kept_states.json")

CONSTRAINED = """
energy_momentum gauss2 gauss3 gauss4 generalized_alpha ggl_vi ggl_vi_mod implicit_euler lie lie_adjoint livens lobatto2 lobatto3 lobatto4
lobatto5 lobatto6 midpoint radau2_ggl radau2_index2 radau3_ggl radau3_index2 rattle rattle_conformal rattle_gauss_seidel rattle_ilves
rattle_lincs rattle_settle rk4 se seproj shake strang symplectic_euler symplectic_euler_adjoint rattle/kahan_li8 rattle/triple_jump4
lobatto2/suzuki4 gauss3+proj rk4+proj rk4+symproj midpoint+symproj local:rk4 local:gauss3 canonical:gauss3 canonical:midpoint
canonical:se stiff:midpoint stiff:gauss2 baumgarte:rk4 baumgarte:gauss2
"""
POISSON = """
lie lie_adjoint midpoint rk4 strang symplectic_euler symplectic_euler_adjoint verlet strang/kahan_li8 verlet/triple_jump4
darboux:midpoint darboux:rk4
"""
"""Methods, of which constrained problems have every fourth, each problem another fourth; Poisson systems have all."""

STEPS, FEW = 1000, 10
SMALL = {"andrews_squeezer": 1e-5, "double_wishbone": 1e-4, "car_axis": 5e-4, "lotka_volterra_3d": 1e-4}
"""Step sizes where 1e-3 is too large."""

MORE = (
    *(
        ("pendulum_chain", method, {"links": 40.0}, "float64")
        for method in ("rattle", "shake", "lobatto2", "se", "ggl_vi", "rattle/kahan_li8")
    ),
    *(("ablowitz_ladik", method, {"sites": 64.0}, "float64") for method in ("strang", "rk4", "verlet")),
    *((problem, "rattle", {}, kind) for problem in ("double_pendulum", "torus", "rigid_water", "butane") for kind in ("float32", "mixed")),
    *((problem, "lobatto3", {}, "float32") for problem in ("spherical_pendulum", "slider_crank", "car_axis")),
    ("free_rigid_body", "strang", {}, "float32"),
    ("lotka_volterra", "midpoint", {}, "float32"),
)
"""Further pairs: (problem, method, parameters, precision)."""


def pairs():
    """Return (problem, method, parameters, precision) of all pairs, those that daebench refuses among them."""
    found = []
    kinds = {name: problem.kind for name, problem in problems().items() if problem.kind in ("constrained", "poisson")}
    for i, (name, kind) in enumerate(kinds.items()):
        methods = POISSON.split() if kind == "poisson" else CONSTRAINED.split()[i % 4 :: 4]
        found += [(name, method, {}, "float64") for method in methods]
    return [*found, *MORE]


def final(problem, method, parameters, precision, steps, stretch=1.0):
    """Return the state after so many steps as one row, and the work and why the run stopped."""
    h = SMALL.get(problem, 1e-3) * stretch
    run = daebench.run(problem, method=method, h=h, steps=steps, every=steps, parameters=parameters or None, precision=precision)
    row = run.y[-1] if hasattr(run, "y") else np.concatenate([run.q[-1], run.p[-1]])
    return np.asarray(row, dtype=float), run.work, run.failure


def kept_of(pair):
    """Return what is kept of a pair: the hash of the state, some of its numbers, the work, and by what a perturbation grows."""
    row, work, failure = final(*pair, STEPS)
    some = some_of(row)
    early = final(*pair, FEW)[0][some]
    moved = final(*pair, STEPS, stretch=1 + 2.0**-36)[0]
    growth = float(np.max(np.abs(moved - row)) * 2.0**36)
    return {
        "hash": hashed(row),
        "work": list(work.values()),
        "stopped": bool(failure),
        "early": early.tolist(),
        "late": row[some].tolist(),
        "growth": growth,
    }


def hashed(row):
    """Return the hash of a state."""
    return hashlib.sha256(row.tobytes()).hexdigest()[:16]


def some_of(row):
    """Return the places of eight of its numbers, or of all."""
    return np.unique(np.linspace(0, len(row) - 1, 8).astype(int))


def name_of(pair):
    """Return the name of a pair in the file."""
    problem, method, parameters, precision = pair
    return " ".join(
        [problem, method, *(f"{name}={value:g}" for name, value in parameters.items()), *[precision] * (precision != "float64")]
    )


def made_on():
    """Return the platform on whose functions of mathematics bits depend."""
    from llvmlite import binding

    fused = binding.get_host_cpu_features().get("fma", False)
    return f"{sys.platform} {platform.machine()} {' '.join(platform.libc_ver())} {'fma' if fused else 'no fma'}"


def written(states, refused):
    """Write the file."""
    lines = ",\n".join(f"{json.dumps(name)}: {json.dumps(kept)}" for name, kept in states.items())
    FILE.write_text(f'{{"made on": {json.dumps(made_on())},\n"refused": {json.dumps(refused)},\n"states": {{\n{lines}\n}}}}\n')


def main():
    """Make the file."""
    states, refused = {}, []
    for pair in pairs():
        try:
            states[name_of(pair)] = kept_of(pair)
        except DaebenchError as error:
            refused.append(name_of(pair))
            print(name_of(pair), str(error), file=sys.stderr)
    written(states, refused)


if __name__ == "__main__":
    main()

"""What index reduction costs, on two motions: sentences hold for all methods of the catalogue, and runs that refute them are refused."""

from pathlib import Path

import numpy as np
import pytest

from daebench.errors import DaebenchError
from daebench.methods.names import parse
from daebench.methods.names_tables import CONSTRAINED
from daebench.reports.index_reduction.two_motions import (
    EARLY,
    FLOOR,
    LEVEL,
    LOST,
    METHODS,
    PENDULUM,
    SYMMETRIC,
    TORUS,
    Run,
    check_motions,
    measure_motions,
    measured,
)

ROOT = Path(__file__).parent.parent.parent

FORMED = ("rk4", "midpoint", "gauss2", "gauss3", "gauss4")
SWEPT = sorted(
    {method.name for method in CONSTRAINED.listed()}
    | {f"{form}:{scheme}" for form in ("local", "canonical") for scheme in FORMED}
    | {"canonical:se", "midpoint+symproj", "gauss2+symproj", "gauss2+proj", "rk4+proj", "midpoint/suzuki4", "rattle/suzuki4"}
)
"""The methods of the catalogue, and those on its forms and with its projections."""

KINDS = ("rattle", "gauss2", "local:gauss2", "rk4+proj", "rattle/suzuki4", "seproj")
"""One of each kind: on (p, q), reduced, on a form, projected, composed, lost at once; others are for the day of a release."""

AT_ONCE = ("se", "seproj")
"""They have lost the motion before their first level is known."""


def made_up(motion, level, slope=0.0, failure=None, t_end=None):
    """Return a run whose energy error is level sin t + slope t."""
    t = motion.h * np.arange(round((t_end or motion.t_end) / motion.h) + 1)
    return Run(t, np.zeros((len(t), 3)), level * np.sin(t) + slope * t, 0.0, failure)


@pytest.fixture
def story():
    torus = {name: made_up(TORUS, 1e-4) for name in METHODS} | {"rattle": made_up(TORUS, 2e-2)}
    torus |= {"gauss2": made_up(TORUS, 1e-6, 2e-5), "local:gauss2": made_up(TORUS, 1e-5, 1e-6)}
    gone = {"rk4": made_up(PENDULUM, 1e-6, failure="not finite", t_end=2000.0)}
    return {TORUS.problem: torus, PENDULUM.problem: {name: made_up(PENDULUM, 1e-4) for name in SYMMETRIC} | gone}


def test_numbers_of_the_picture_are_those_of_the_runs(story):
    facts = check_motions(story)
    assert facts.flat == pytest.approx(2e-2, rel=1e-2)
    assert facts.crossing == pytest.approx(2e-2 / 2e-5, abs=3)
    assert facts.end == pytest.approx(0.2, rel=1e-2)
    assert facts.gone == 2000.0


FALSE = {
    "rattle on the torus stays level": (TORUS, "rattle", (2e-2, 1e-5)),
    "lobatto3 on the torus stays level": (TORUS, "lobatto3", (1e-4, 0.0, "no solution", 500.0)),
    "canonical:gauss2 on the torus stays level": (TORUS, "canonical:gauss2", (1e-5, 1e-6)),
    "error of gauss2 on the torus grows": (TORUS, "gauss2", (1e-5,)),
    "crosses the line of RATTLE": (TORUS, "gauss2", (1e-5, 5e-6)),
    "local:gauss2 on the torus grows": (TORUS, "local:gauss2", (1e-5,)),
    "gauss2 on the pendulum stays level": (PENDULUM, "gauss2", (1e-5, 1e-6)),
    "RK4 on the pendulum does not reach the end": (PENDULUM, "rk4", (1e-5,)),
}
"""Claims, and runs that refute them."""


@pytest.mark.parametrize(("claim", "changed"), FALSE.items())
def test_a_story_that_does_not_hold_is_refused(story, claim, changed):
    check_motions(story)
    motion, name, planted = changed
    with pytest.raises(DaebenchError, match=claim):
        check_motions({**story, motion.problem: story[motion.problem] | {name: made_up(motion, *planted)}})


@pytest.mark.slow
def test_readme_and_docs_say_what_is_measured():
    facts = check_motions(measure_motions())
    told = (
        f"begins {facts.better:.0f} times as accurate as RATTLE, crosses its level at t = {facts.crossing:.0f} and ends at {facts.end:.1f}"
    )
    for file in ("README.md", "docs/index.md"):
        assert told in (ROOT / file).read_text(encoding="utf-8")


@pytest.mark.slow
@pytest.mark.sampled(by=lambda case: case in KINDS)
@pytest.mark.parametrize("name", SWEPT)
def test_on_the_torus_the_two_form_decides_for_every_method_of_the_catalogue(name):
    method = parse(name)
    if method.knob != "h" or method.refusal(TORUS.ivp()):
        pytest.skip("no fixed-step method for this problem")
    run = measured(TORUS, name)
    if method.claims.symplectic:
        assert run.growth <= LEVEL
    elif method.claims.system in ("ode", "local"):
        assert run.growth >= LOST or name in AT_ONCE or run.largest[-1] < FLOOR
        assert name not in AT_ONCE or run.largest[min(len(run.t), round(EARLY / TORUS.h)) - 1] > 1


@pytest.mark.slow
@pytest.mark.sampled(by=lambda case: case in KINDS)
@pytest.mark.parametrize("name", SWEPT)
def test_on_the_pendulum_every_symmetric_method_of_the_catalogue_holds(name):
    method = parse(name)
    if method.knob != "h" or method.refusal(PENDULUM.ivp()) or not method.claims.symmetric:
        pytest.skip("no symmetric fixed-step method for this problem")
    assert measured(PENDULUM, name).growth <= LEVEL

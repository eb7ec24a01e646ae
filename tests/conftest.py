"""What all tests share: a cache directory of their own, the problems that every scheme is swept over, and the command line."""

import gc
import os
import signal
import sys
import tempfile

import numpy as np
import pytest

gc.disable()  # until all is collected: what is imported stays, so that looking for cycles in it costs time and frees nothing
signal.signal(signal.SIGINT, signal.default_int_handler)  # it is ignored in what a shell runs in the background, and in what that starts
os.environ.setdefault("DAEBENCH_CACHE", tempfile.mkdtemp(prefix="daebench-tests-"))
os.environ["DAEBENCH_REFERENCES"] = f"{os.environ['DAEBENCH_CACHE']}/no-references"

import planting
import uncompiled
from browser import chromium, looks_right, seen, still  # noqa: F401  defined once: a process can start one browser
from ending_code import ending_library, ends  # noqa: F401
from ivps import ivp, swept
from outside_code import library, mine, program  # noqa: F401
from own_files import ORBIT, RING

from daebench.methods.fixed_step.poisson import PoissonStep
from daebench.methods.initial_value_problem import initial_value_problem

UNCOLLECTED = 50_000
"""Objects that may be made before Python looks for cycles among the youngest: compiling makes millions that live, and few cycles."""


@pytest.hookimpl(tryfirst=True)
def pytest_configure(config):
    """Draw the order of the tests by the hash of the tree, unless a seed is given: the same tree, the same order."""
    if config.getoption("randomly_seed", "") == "default":
        config.option.randomly_seed = int(planting.digest()[:8], 16)


@pytest.hookimpl(wrapper=True)
def pytest_collection():
    try:
        return (yield)
    finally:
        gc.freeze()
        gc.enable()
        gc.set_threshold(UNCOLLECTED, 20, 20)


def pytest_collection_modifyitems(config, items):
    sampled = {}
    for item in items:
        test, _, case = item.nodeid.rstrip("]").partition("[")
        for mark in item.iter_markers("sampled"):
            sample(item, case, **mark.kwargs)
            sampled.setdefault(test, {name for names in ("left_out", "slow") for name in mark.kwargs.get(names, ())}).discard(case)
        if item.get_closest_marker("exhaustive"):
            item.add_marker(pytest.mark.slow)  # an exhaustive test is a slow one: the README's command leaves it out
    absent = {test: names for test, names in sampled.items() if names}
    if absent and not any("[" in argument for argument in config.args):
        raise pytest.UsageError(f"marks name cases that are not there: {absent}")


KILLERS = {test for fault in planting.faults().values() for test in fault.killers}
"""Tests that catch planted faults; the gate leaves out none of them."""


def sample(item, case, *, left_out=(), slow=(), by=None):
    """Mark one case of a test as slow, or as one for the day of a release."""
    if item.nodeid not in KILLERS and (case in left_out or (by is not None and not by(case))):
        item.add_marker(pytest.mark.exhaustive)
    if case in slow:
        item.add_marker(pytest.mark.slow)


@pytest.fixture(params=swept())
def each_ivp(request):
    return ivp(request.param)


@pytest.fixture
def get_ivp():
    return ivp


@pytest.fixture(scope="module")
def pendulum():
    return initial_value_problem("spherical_pendulum", "fig1.2")


@pytest.fixture
def random():
    return np.random.default_rng(20240607)


@pytest.fixture
def plain_functions(monkeypatch):
    """Have formulations, and so reference solutions, run uncompiled."""
    monkeypatch.setattr("daebench.methods.formulations.constrained._module", uncompiled.kept_module)


@pytest.fixture
def interrupted_in_the_loop(monkeypatch):
    """Have Ctrl-C come while the compiled loop of IDA and CVODE takes its first piece of a run; return the list of signals sent."""
    from daebench.methods.solvers.native import loop, run

    sent, advance = [], run._Run._advance

    def interrupted(self, times, rows, budget):
        reason = advance(self, times, rows, budget)
        if reason == loop.BUDGET and budget and not sent:  # without a budget the loop is compiled, and takes no step
            sent.append(signal.SIGINT)
            signal.raise_signal(signal.SIGINT)
        return reason

    monkeypatch.setattr(run._Run, "_advance", interrupted)
    return sent


@pytest.fixture
def forty_digits():
    """Have mpmath work with 40 digits."""
    from mpmath import mp

    with mp.workdps(40):
        yield


@pytest.fixture
def daebench(monkeypatch, capsys):
    """Run the command line in this process; return exit status, standard output and standard error.

    The error that ended the last call, if one did, is ``daebench.error``.

    What takes long on a loaded machine says nothing of it here: tests hold standard error against what a command means to say.
    """
    from daebench.cli import app, console

    monkeypatch.setattr(console, "SILENCE", 1e6)
    ending = app.ending

    def observed(error):
        call.error = error
        return ending(error)

    monkeypatch.setattr(app, "ending", observed)

    def call(*words):
        call.error = None
        monkeypatch.setattr(sys, "argv", ["daebench", *map(str, words)])
        with pytest.raises(SystemExit) as stop:
            app.main()
        printed = capsys.readouterr()
        return stop.value.code, printed.out, printed.err

    return call


@pytest.fixture(scope="session")
def references(tmp_path_factory):
    """Build a small reference, planar_pendulum-rotating to t = 4, and return the folder it is in."""
    from daebench.reference.make.build import build

    folder = tmp_path_factory.mktemp("references")
    build("planar_pendulum-rotating", folder=folder, t_end=4)
    return folder


@pytest.fixture
def copied(references, tmp_path):
    """Return a copy of that folder, to be altered."""
    import shutil

    return shutil.copytree(references, tmp_path / "references")


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """A folder to work in, with a problem of either kind."""
    (tmp_path / "ring.py").write_text(RING)
    (tmp_path / "orbit.py").write_text(ORBIT)
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.fixture
def uncompiled_poisson_schemes(monkeypatch):
    """Run schemes on Poisson systems without the compiler."""
    monkeypatch.setattr(
        "daebench.methods.names.PoissonStep", lambda *settings, **more: PoissonStep(*settings, **more | {"compiled": False})
    )


@pytest.fixture
def uncompiled_schemes(monkeypatch):
    """Run schemes on constrained problems without the compiler."""
    monkeypatch.setattr("daebench.methods.names.FixedStep", uncompiled.Uncompiled)

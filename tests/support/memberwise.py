"""Runs of members of an ensemble held against runs of their own."""

from dataclasses import replace

import numpy as np

from daebench.runs.request import Request


def moving(ivp, n, *, spread=0.1):
    """Return n starts with momenta, or states, up to so much larger; they stay on the manifold where G H_p is linear in p."""
    factors = 1 + spread * np.random.default_rng(7).random((n, 1))
    first, *others = ivp.start
    return (factors * first, *(np.repeat(vector[None], n, axis=0) for vector in others))


def alone(method, members, request, i):
    """Return the trajectory of one member by itself, and its states as rows."""
    settings = replace(request, value=members.step_size(i), every=request.every or 0)
    own = method if members.weights is None else method.weighted(members.weights[i])
    run = own.solve(members.member(i), settings)
    return run, np.concatenate([run.p, run.q], axis=1) if hasattr(run, "p") else run.y


def differences(method, members, request, ensemble):
    """Return in what, if anything, members differ from runs of their own, to the bit: (member, what) pairs."""
    found = []
    for i in range(len(members)):
        run, rows = alone(method, members, request, i)
        pivot = np.inf if run.pivot is None else run.pivot
        pairs = {
            "end": (rows[-1], ensemble.ends[i]),
            "steps": (run.steps, ensemble.steps[i]),
            "pivot": (pivot, ensemble.pivots[i]),
            "failure": (run.failure, ensemble.failure(i)),
        }
        pairs |= {name: (value, ensemble.maxima[name][i]) for name, value in run.maxima.items()}
        pairs |= {name: (value, ensemble.work[name][i]) for name, value in run.work.items()}
        stored = ensemble.states[: len(rows), i] if run.failure is None else ensemble.states[ensemble.index <= run.steps, i]
        pairs["states"] = (rows[: len(stored)], stored)
        found += [(i, what) for what, (mine, theirs) in pairs.items() if not _same(mine, theirs)]
    return found


def _same(a, b):
    return a == b if isinstance(a, str | None) else np.array_equal(a, b, equal_nan=True)


def request(steps, **settings):
    """Return a request of so many steps."""
    return Request(value=1.0, steps=steps, **settings)

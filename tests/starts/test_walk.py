"""The random walk on an ellipse: what is distributed by the density that is wanted stays so, against quadrature."""

import numpy as np
import pytest

from daebench.starts.walk import begun, step

AXES = np.array([1.0, 0.3])
ANGLES = np.linspace(0, 2 * np.pi, 40001)[:-1]
ARC = np.hypot(AXES[0] * np.sin(ANGLES), AXES[1] * np.cos(ANGLES))
CHAINS, STEPS = 80_000, 10
MOMENTS = (lambda x: x[0], lambda x: x[0] ** 2, lambda x: np.abs(x[1]) > 0.27)


def points(angles):
    return AXES[:, None] * np.array([np.cos(angles), np.sin(angles)])


class Ellipse:
    """x1^2 / a^2 + x2^2 / b^2 = 1 with the density exp(slope x1) on it."""

    noise = 0

    def __init__(self, slope):
        self.slope = slope

    def conditions(self, x, rows):
        scaled = x / AXES[:, None] ** 2
        return np.sum(scaled * x, axis=0)[None] - 1, 2 * scaled[None]

    def weighed(self, x, C, noise, rows):
        return self.slope * x[0], np.empty((0, x.shape[1]))


@pytest.mark.parametrize(("slope", "sigma"), [(0.0, 0.4), (2.0, 0.3)], ids=str)
def test_chains_keep_the_distribution_that_is_wanted(random, slope, sigma):
    density = ARC * np.exp(slope * np.cos(ANGLES))
    first = np.interp(random.uniform(size=CHAINS), np.cumsum(density) / np.sum(density), ANGLES)
    chains = begun(Ellipse(slope), points(first), np.empty((0, CHAINS)))
    for _ in range(STEPS):
        chains = step(Ellipse(slope), chains, sigma, random)
    assert np.mean(chains.moved) > 0.5
    for moment in MOMENTS:
        values, expected = moment(chains.x).astype(float), np.sum(moment(points(ANGLES)) * density) / np.sum(density)
        assert abs(np.mean(values) - expected) < 4 * np.std(values) / np.sqrt(CHAINS)

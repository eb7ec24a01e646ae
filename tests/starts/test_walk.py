"""The random walk on an ellipse, against the arc length and against a density on it, by quadrature."""

import numpy as np
import pytest

from daebench.starts.walk import begun, step

AXES = np.array([1.0, 0.3])
ANGLES = np.linspace(0, 2 * np.pi, 20001)[:-1]
ARC = np.hypot(AXES[0] * np.sin(ANGLES), AXES[1] * np.cos(ANGLES))


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
def test_chains_are_distributed_as_they_are_to_be(random, slope, sigma):
    first = random.uniform(0, 2 * np.pi, 4000)
    chains = begun(Ellipse(slope), AXES[:, None] * np.array([np.cos(first), np.sin(first)]), np.empty((0, len(first))))
    for _ in range(80):
        chains = step(Ellipse(slope), chains, sigma, random)
    density = ARC * np.exp(slope * AXES[0] * np.cos(ANGLES))
    for moment in (lambda x: x[0], lambda x: x[0] ** 2, lambda x: np.abs(x[1]) > 0.27):
        expected = np.sum(moment(AXES[:, None] * np.array([np.cos(ANGLES), np.sin(ANGLES)])) * density) / np.sum(density)
        values = moment(chains.x).astype(float)
        assert abs(np.mean(values) - expected) < 4.5 * np.std(values) / np.sqrt(len(values))

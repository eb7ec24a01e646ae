"""The weights of compositions, against their order conditions and what was published, at high precision."""

import math
from fractions import Fraction

import mpmath as mp
import pytest

from daebench.methods.fixed_step.compositions import COMPOSITIONS

pytestmark = pytest.mark.usefixtures("forty_digits")

NAMES = list(COMPOSITIONS)


# The middle weights as published: they are not in the package, so that they tell whether the others were typed correctly.
MIDDLE = {
    "yoshida6": "1.31518632068391121888424973",
    "kahan_li6": "0.79854399093482996339895035",
    "suzuki_umeno8": "-0.79688793935291635401978884",
    "kahan_li8": "-0.60550853383003451169892108",
    "sofroniou_spaletta10": "0.04931773575959453791768001",
}

# Numbers published to 26 digits meet the conditions to 2e-25 at worst (yoshida6); the next condition fails by 1e-6 at least.
TOLERANCE = 1e-24


def exact_weights(composition):
    """Return all weights to forty digits, the published ones taken as exact."""
    half = [mp.mpf(gamma) for gamma in composition.gamma]
    return (*half, 1 - 2 * mp.fsum(half), *reversed(half))


def words(weight):
    """Return the words of odd letters whose sum is the weight: products X_i X_j ... of the free associative algebra."""
    if weight == 0:
        return [()]
    return [(*word, letter) for letter in range(1, weight + 1, 2) for word in words(weight - letter)]


def product(weights, highest):
    """Return the coefficients of prod exp(gamma X_1 + gamma^3 X_3 + gamma^5 X_5 + ...) up to a weight.

    A symmetric map of order 2 or more is such an exponential with the exact X_1, and its other X_i are arbitrary. The coefficient of
    a word in one factor is gamma^weight / length!.
    """
    basis = [word for weight in range(highest + 1) for word in words(weight)]
    result = {word: mp.mpf(not word) for word in basis}
    for gamma in weights:
        result = {
            word: mp.fsum(result[word[:k]] * gamma ** sum(word[k:]) / math.factorial(len(word) - k) for k in range(len(word) + 1))
            for word in basis
        }
    return result


def defects(weights, highest):
    """Return how far the product is from exp(X_1), weight by weight from 1: zero below the order of the composition plus 1."""
    found = product(weights, highest)
    return [
        max(abs(found[word] - (mp.mpf(1) / math.factorial(weight) if set(word) == {1} else 0)) for word in words(weight))
        for weight in range(1, highest + 1)
    ]


@pytest.mark.parametrize("name", NAMES, ids=str)
def test_a_composition_has_its_order_and_no_higher_one(name):
    composition = COMPOSITIONS[name]
    found = defects(exact_weights(composition), composition.order + 1)
    assert max(found[:-1]) < TOLERANCE
    assert found[-1] > 1e-6


@pytest.mark.parametrize("name", NAMES, ids=str)
def test_the_weights_are_symmetric_and_their_sum_is_one(name):
    composition = COMPOSITIONS[name]
    half = composition.stages // 2
    for weights in (composition.weights, exact_weights(composition)):
        assert weights == weights[::-1]
    assert abs(mp.fsum(exact_weights(composition)) - 1) < 1e-39
    assert math.fsum(composition.weights) == 1.0
    error = abs(sum(map(Fraction, composition.weights)) - 1)
    assert error <= Fraction(math.ulp(composition.weights[half])) / 2


@pytest.mark.parametrize("name", NAMES, ids=str)
def test_the_weights_are_those_of_high_precision_rounded(name):
    composition = COMPOSITIONS[name]
    half = composition.stages // 2
    expected = [float(weight) for weight in exact_weights(composition)]
    assert composition.weights[:half] == tuple(expected[:half])
    # the middle one makes up for the rounding of the others, each at most half a unit in the last place
    assert abs(composition.weights[half] - expected[half]) <= sum(map(math.ulp, expected))


@pytest.mark.parametrize("name", list(MIDDLE), ids=str)
def test_the_middle_weight_is_the_published_one(name):
    composition = COMPOSITIONS[name]
    # half a unit in the 26th place for itself and for each of the others
    assert abs(exact_weights(composition)[composition.stages // 2] - mp.mpf(MIDDLE[name])) <= 0.5e-26 * composition.stages

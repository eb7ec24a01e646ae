"""Parameters that differ from member to member, uniform in a box."""

from dataclasses import dataclass, field

import numpy as np

from daebench.errors import BadInput, unknown
from daebench.runs.ivp import Array, Ivp
from daebench.studies.ensemble.distributions.box import Bounds, bounds_of, in_words


@dataclass(frozen=True)
class Vary:
    """Parameters uniform between bounds, independent of each other and of the starts.

    Parameters
    ----------
    box : mapping of str to (float, float)
        Bounds by the names of parameters.
    """

    box: Bounds = field(default_factory=dict)

    def parameters(self, ivp: Ivp, n: int, seed: int) -> dict[str, Array]:
        """Return the values of each parameter, shape(n,); those of a member are the same however many there are.

        Raises
        ------
        BadInput
            If a name is unknown, bounds are no bounds, or a parameter that must be positive could be zero.
        """
        values = {}
        names = list(ivp.parameters)
        for name, given in self.box.items():
            if name not in ivp.parameters:
                raise unknown(f"parameter of {ivp.problem}", name, names)
            lo, hi = bounds_of(name, given)
            if name in ivp.facts.POSITIVE and not lo > 0:
                raise BadInput(f"{name} of {ivp.problem} must be greater than 0, and its lower bound is {lo:g}.")
            values[name] = np.random.default_rng([seed, 6, names.index(name)]).uniform(lo, hi, n)
        return values

    @property
    def about(self) -> str:
        """The distribution as part of a sentence."""
        return f"parameters uniform in {in_words(self.box)}"

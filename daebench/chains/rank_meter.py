"""The meter of a tolerance-driven run on a chain: it watches whether G keeps its rank, in a number of operations linear in the nodes."""

from collections.abc import Callable

from daebench.reference.rank_meter import RankMeter
from daebench.reference.tolerance import Array


class ChainRankMeter(RankMeter):
    """A meter for unknowns that are arrays, without a word on how the force of constraint grew, which takes G as a matrix.

    Its parameters are those of :class:`daebench.reference.rank_meter.RankMeter`.
    """

    def _measure(self) -> Callable[..., float]:
        d, independence = self.dae.d, self.dae.ivp.functions("independence").independence
        return lambda y, par: float(independence(y[d : 2 * d], y[:d], par))

    def _spike(self, y: Array) -> str:
        return ""

    def _keep(self) -> None:
        """Keep nothing: no force is told of."""

"""The meter of a tolerance-driven run on a chain: it watches whether G keeps its rank, in a number of operations linear in the nodes."""

from collections.abc import Callable

from daebench.methods.solvers.drive import Array
from daebench.methods.solvers.rank_meter import RankMeter


class ChainRankMeter(RankMeter):
    """A meter for unknowns that are arrays, without a word on how the force of constraint grew, which takes G as a matrix.

    Its parameters are those of :class:`daebench.methods.solvers.rank_meter.RankMeter`.
    """

    def _measure(self) -> Callable[..., float]:
        d, independence = self.dae.d, self.dae.ivp.functions("independence").independence
        return lambda y, par: float(independence(y[d : 2 * d], y[:d], par))

    def _spike(self, y: Array) -> str:
        return ""

    def _keep(self) -> None:
        """Keep nothing: no force is told of."""

"""What the loop does beside stepping a Poisson lattice: as for other Poisson systems, but that whole arrays are stored."""

from daebench.poisson_watch import PoissonWatch
from daebench.watch import stored_as


class LatticeWatch(PoissonWatch):
    """Source of the functions declared in ``kernels/hole.py`` under *what only Newton and the loop use*, for states that are arrays."""

    def source(self, name: str) -> str | None:
        """Return the source of the function of this name, or None if it is none of these."""
        if name == "store" and not self.sampled:
            return stored_as("X[row, :] = x")
        return super().source(name)
